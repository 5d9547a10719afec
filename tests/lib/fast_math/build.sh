#!/bin/sh
# build.sh OUT COMPILER FLAGS...: lib/ and the harness by this compiler with these flags, into the program OUT. 77: the
# compiler is not here.
set -eu
cd "$(dirname "$0")/../../.."
out=$1 compiler=$2
shift 2
command -v "$compiler" >/dev/null || { echo "no $compiler here"; exit 77; }
exec "$compiler" -std=c99 -w "$@" -Ilib lib/*.c tests/lib/fast_math/harness.c -lm -o "$out"
