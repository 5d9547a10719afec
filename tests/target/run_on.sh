#!/bin/sh
# Compiles C that needs no C library for one core and runs it in QEMU, where an instruction takes exactly 1024 ns (see
# board.h):
#   tests/target/run_on.sh CORE OUT.elf SOURCE.c ... [CFLAGS ...]        CORE: m0 m3 m4f m33 rv32
# Prints what main prints with say.h, and ends with main's status; 99 after a fault, 98 where the count is not exact,
# 124 after TARGET_TIMEOUT (600) seconds, 77 where a tool is absent. `run_on.sh CORE` alone prints compiler and its flags
# for the core.
set -eu
usage() {
    echo "usage: tests/target/run_on.sh m0|m3|m4f|m33|rv32 [OUT.elf SOURCE.c ... [CFLAGS ...]]" >&2
    exit 2
}
here=$(dirname "$0")
[ $# = 1 ] || [ $# -ge 3 ] || usage
cc=${TARGET_CC:-arm-none-eabi-gcc}
qemu=${TARGET_QEMU:-qemu-system-arm}
code=0 ram=0x21000000
case $1 in
m0) core="-mthumb -mcpu=cortex-m0" board=microbit ram=0x20000000 ;;
m3) core="-mthumb -mcpu=cortex-m3" board=mps2-an385 ;;
m4f) core="-mthumb -mcpu=cortex-m4 -mfloat-abi=hard -mfpu=fpv4-sp-d16" board=mps2-an386 ;;
m33) core="-mthumb -mcpu=cortex-m33 -mfloat-abi=hard -mfpu=fpv5-sp-d16" board=mps2-an505 code=0x10000000 ram=0x38000000 ;;
rv32)
    cc=${TARGET_RISCV_CC:-riscv64-unknown-elf-gcc} qemu=${TARGET_RISCV_QEMU:-qemu-system-riscv32}
    core="-march=rv32imc -mabi=ilp32 -msmall-data-limit=0" board="virt -bios none" code=0x80000000 ram=0x80400000
    ;;
*) usage ;;
esac
for tool in "$cc" "$qemu" timeout; do
    command -v "$tool" >/dev/null || {
        echo "skipped: no $tool here"
        exit 77
    }
done
# Freestanding, so that the compiler's own headers do; yet it may put in fabsf and the like where it knows better than a
# call.
flags="$core -std=c99 -ffreestanding -fbuiltin -ffp-contract=off -fno-math-errno -ffunction-sections -fdata-sections"
if [ $# = 1 ]; then
    echo "$cc $flags"
    exit 0
fi
elf=$2
shift 2

# shellcheck disable=SC2086
"$cc" $flags -Os -Wall -Wextra -fno-tree-loop-distribute-patterns -DSTACK_PAINTED=4096 -c "$here/bare.c" -I"$here/.." -o "$elf.bare.o"
# shellcheck disable=SC2086
"$cc" $flags -Os -Wall -Wextra -DSTACK_PAINTED=4096 -I"$here/.." -I"$here/../../lib" -I"$here/../../port_q15" "$elf.bare.o" \
    "$here/say.c" "$here/count.c" "$here/stack.c" "$@" -nostdlib -T "$here/bare.ld" -Wl,--defsym=CODE=$code,--defsym=RAM=$ram,--gc-sections -lgcc -o "$elf"
status=0
# shellcheck disable=SC2086
timeout "${TARGET_TIMEOUT:-600}" "$qemu" -M $board -display none -monitor none -serial none -icount shift=10 -chardev stdio,id=out,signal=off \
    -semihosting-config enable=on,target=native,chardev=out -kernel "$elf" </dev/null || status=$?
[ $status != 124 ] || echo "tests/target/run_on.sh: $elf: no end after ${TARGET_TIMEOUT:-600} s" >&2
exit $status
