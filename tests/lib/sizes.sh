#!/bin/sh
# sizes.sh COMPILER: both libraries with room for 12 weights, all but one file, which has room for 0. Prints each file
# whose code differs and that offers every name that the rest may want: that would link. 77: the compiler is not here.
set -eu
cd "$(dirname "$0")/../.."
compiler=$1
command -v "$compiler" >/dev/null || { echo "no $compiler here"; exit 77; }
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
for size in 0 12; do
    mkdir "$tmp/$size"
    for file in lib/*.c port_q15/*.c; do echo "$file"; done | xargs -n 1 -P "$(nproc)" sh -c \
        '"$1" -std=c99 -w -Ilib -Iport_q15 -DDQW_EFFECT_WEIGHTS="$2" -c "$4" -o "$3/$2/$(basename "$4" .c).o"' sh "$compiler" "$size" "$tmp"
done
names() { # STATE OBJECTS...
    state=$1
    shift
    nm -P "$@" | awk -v state="$state" '$2 == state { print $1 }' | sort -u
}
failed=0
for object in "$tmp"/12/*.o; do
    name=$(basename "$object")
    # Of the same code whatever the size.
    for size in 0 12; do objdump -d "$tmp/$size/$name" | tail -n +3 >"$tmp/code.$size"; done
    ! cmp -s "$tmp/code.0" "$tmp/code.12" || continue
    names T "$object" >"$tmp/wanted"
    names T "$tmp/0/$name" >"$tmp/offered"
    [ -n "$(comm -23 "$tmp/wanted" "$tmp/offered")" ] || { echo "$name links"; failed=1; }
done
exit $failed
