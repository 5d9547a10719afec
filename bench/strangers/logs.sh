#!/bin/sh
# Fresh logs of motulator and gym-electric-motor from the Python package index, each in an environment of its own,
# traced and judged: bench/strangers.py. One that cannot be had is skipped by name. BUILD: build folder. SEED: others
# are drawn; COUNT: so many.
set -u
BUILD=${BUILD:-build}
SEED=${SEED:-1}
command -v python3 >/dev/null || { echo "skipped: motulator, gym-electric-motor (no python3)"; exit 0; }

# ENVIRONMENT MODULE PACKAGE
environment() {
    venv=$BUILD/bench/$1
    "$venv/bin/python" -W ignore -c "import $2" 2>/dev/null && return
    mkdir -p "$BUILD/bench"
    rm -rf "$venv"
    python3 -m venv "$venv" >/dev/null 2>&1 || { echo "skipped: $3 (python3-venv is not installed)"; rm -rf "$venv"; return; }
    timeout 300 "$venv/bin/python" -m pip install -q --disable-pip-version-check "$3" >"$BUILD/bench/pip_$2.log" 2>&1 ||
        { echo "skipped: $3 (pip cannot install it; see $BUILD/bench/pip_$2.log)"; rm -rf "$venv"; }
}
environment venv_motulator motulator 'motulator==0.5.0'
environment venv gym_electric_motor 'gym-electric-motor==3.0.3'
python3 bench/strangers.py --build "$BUILD" --from "$((SEED * 1000))" --count "${COUNT:-60}"
