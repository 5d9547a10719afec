#!/bin/sh
# PySINDy from the Python package index, in a virtual environment of its own, on the logs that dqwatch traces. BUILD:
# build folder.
set -u
BUILD=${BUILD:-build}
venv=$BUILD/bench/venv_sindy
out=$BUILD/bench/sindy
command -v python3 >/dev/null || { echo "skipped: PySINDy (no python3)"; exit 0; }
if ! "$venv/bin/python" -c 'import pysindy' 2>/dev/null; then
    rm -rf "$venv"
    python3 -m venv "$venv" >/dev/null 2>&1 || { echo "skipped: PySINDy (python3-venv is not installed)"; rm -rf "$venv"; exit 0; }
    timeout 200 "$venv/bin/python" -m pip install -q --disable-pip-version-check 'pysindy==2.1.*' >"$BUILD/bench/pip_sindy.log" 2>&1 ||
        { echo "skipped: PySINDy (pip cannot install it; see $BUILD/bench/pip_sindy.log)"; rm -rf "$venv"; exit 0; }
fi
for log in servo effect_dead_time effect_angle_offset; do
    mkdir -p "$out/$log"
    "$BUILD/dqwatch" sim $log --out "$out" >/dev/null || exit 1
    "$BUILD/bench/usage" "$out/$log/usage" "$BUILD/dqwatch" trace "$out/$log.csv" --out "$out/$log" >/dev/null 2>&1 || exit 1
done
timeout 300 "$venv/bin/python" bench/sindy.py "$out" 0.9 2>"$BUILD/bench/sindy.log" || echo "skipped: PySINDy (it failed; see $BUILD/bench/sindy.log)"
rm -rf "$out"
