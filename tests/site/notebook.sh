#!/bin/sh
# tests/site/notebook.sh NAME PICTURES: the notebook runs, what it asserts holds, and it ends in so many pictures. In
# the environment that `make docs` makes, which runs all of them.
set -eu
BUILD=${BUILD:-build}
python=$BUILD/site/venv/bin/python
"$python" -c 'import dqwatch, jupytext, nbclient, nbconvert' 2>/dev/null || { echo "no $python with dqwatch (make docs makes it)"; exit 77; }
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
"$python" docs/site/notebooks.py "$tmp" "$1" 2>"$tmp/said" || { tail -n 20 "$tmp/said"; exit 1; }
pictures=$(find "$tmp/$1_files" -name '*.png' -size +4k | wc -l)
[ "$pictures" = "$2" ] || { echo "$1: $pictures pictures, not $2"; exit 1; }
