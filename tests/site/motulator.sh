#!/bin/sh
# docs/site/pages/motulator.md: what export.py writes of a motulator drive gives the machine that was put in. motulator
# is in the environment that `make strangers` makes.
set -eu
BUILD=${BUILD:-build}
python=$BUILD/bench/venv_motulator/bin/python
"$python" -c 'import motulator' 2>/dev/null || { echo "no motulator ($BUILD/bench/venv_motulator; make strangers gets it)"; exit 77; }
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
"$python" -W ignore examples/motulator/export.py "$tmp/log.csv"
"$BUILD/dqwatch" fit "$tmp/log.csv" --pole-pairs 3 --json >"$tmp/fit.json" 2>"$tmp/notes"
"$python" - "$tmp/fit.json" <<'PYTHON'
import json, sys
parameters = json.load(open(sys.argv[1]))["parameters"]
for name, true in {"R_ohm": 3.6, "Ld_H": 0.036, "Lq_H": 0.051, "psi_Wb": 0.545}.items():
    off = abs(parameters[name]["value"] / true - 1)
    print(f"{name} off by {off:.1e}")
    assert off < 1e-4, name
PYTHON
