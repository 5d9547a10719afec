#!/bin/sh
# Compiles C for a Cortex-M4F and runs it in QEMU, where an instruction takes exactly 1024 ns (see board.h):
#   tests/target/run.sh OUT.elf SOURCE.c ... [-- CFLAGS ... [-- ARGUMENTS ...]]
# Prints what main prints, and ends with main's status; 99 after a hard fault, 98 where the count is not exact, 124
# after TARGET_TIMEOUT (600) seconds, 77 where a tool is absent. main's argv is OUT.elf and ARGUMENTS, without blanks;
# the program opens files of the host.
set -eu
usage() {
    echo "usage: tests/target/run.sh OUT.elf SOURCE.c ... [-- CFLAGS ... [-- ARGUMENTS ...]]" >&2
    exit 2
}
here=$(dirname "$0")
cc=${TARGET_CC:-arm-none-eabi-gcc}
qemu=${TARGET_QEMU:-qemu-system-arm}
skip() {
    echo "skipped: $1"
    exit 77
}
for tool in "$cc" "$qemu" timeout; do
    command -v "$tool" >/dev/null || skip "no $tool here"
done
case $("$cc" -print-file-name=rdimon.specs) in */*) ;; *) skip "no newlib with rdimon.specs for $cc" ;; esac

[ $# -ge 2 ] || usage
elf=$1
shift
# The words up to the last `--` become the compiler's, in their order; what follows becomes QEMU's.
part=0 sources=0 count=$# config=enable=on,target=native,chardev=out
comma() { printf '%s\n' "$1" | sed 's/,/,,/g'; }
config=$config,arg=$(comma "$elf")
while [ "$count" -gt 0 ]; do
    word=$1
    shift
    count=$((count - 1))
    if [ "$word" = -- ] && [ $part -lt 2 ]; then
        part=$((part + 1))
    elif [ $part = 2 ]; then
        config=$config,arg=$(comma "$word")
    else
        [ $part = 1 ] || sources=$((sources + 1))
        set -- "$@" "$word"
    fi
done
[ $sources -gt 0 ] || usage

"$cc" -mcpu=cortex-m4 -mthumb -mfloat-abi=hard -mfpu=fpv4-sp-d16 -O2 -std=c99 -ffp-contract=off -ffunction-sections -fdata-sections \
    -Wall -Wextra "$@" -I"$here/.." -I"$here/../../lib" "$here/startup.c" "$here/count.c" "$here/stack.c" \
    --specs=rdimon.specs -nostartfiles -T "$here/m4f.ld" -Wl,--gc-sections -lm -o "$elf"

status=0
timeout "${TARGET_TIMEOUT:-600}" "$qemu" -M mps2-an386 -display none -monitor none -serial none -icount shift=10 \
    -chardev stdio,id=out,signal=off -semihosting-config "$config" -kernel "$elf" </dev/null || status=$?
[ $status != 124 ] || echo "tests/target/run.sh: $elf: no end after ${TARGET_TIMEOUT:-600} s" >&2
exit $status
