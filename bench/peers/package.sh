#!/bin/sh
# A package of the Python package index in an environment of its own, shared by all peers: package.sh PEER MODULE
# PACKAGE. Installs it where it is missing and prints the environment's python; or prints `skipped: PEER (why)`, status
# 77. BUILD: build folder.
set -u
BUILD=${BUILD:-build}
venv=$BUILD/bench/venv-online
peer=$1 module=$2 package=$3
skip() {
    echo "skipped: $peer ($1)"
    exit 77
}
command -v python3 >/dev/null || skip "no python3"
mkdir -p "$BUILD/bench/online"
if [ ! -x "$venv/bin/python" ] && ! python3 -m venv "$venv" >/dev/null 2>&1; then
    rm -rf "$venv"
    skip "python3-venv is not installed"
fi
log=$BUILD/bench/online/pip_$peer.log
"$venv/bin/python" -c "import $module" 2>/dev/null ||
    timeout 150 "$venv/bin/python" -m pip install -q --disable-pip-version-check "$package" >"$log" 2>&1 || skip "pip cannot install it; see $log"
echo "$venv/bin/python"
