#!/bin/sh
# examples.sh NAME: compiles an example of examples/ for its core with its project's own flags, against stubs of that
# project's headers, and shows that the library has all that it calls. m0_run: the Cortex-M0's under QEMU at a simulated
# motor; what it takes, in instructions, and what it has learned, over the truth. 77: the compiler or QEMU is not here.
set -eu
cd "$(dirname "$0")/../.."
name=$1
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
command -v arm-none-eabi-gcc >/dev/null || { echo "no arm-none-eabi-gcc here"; exit 77; }
stubs=tests/examples/stubs/$name
m4="-mthumb -mcpu=cortex-m4 -mfloat-abi=hard -mfpu=fpv4-sp-d16"
strict="-Wall -Wextra -Wundef -Wshadow -Werror"
weights=
case $name in
vesc) # make/fw.mk: USE_OPT, CWARN
    flags="$m4 -O2 -fno-math-errno -ggdb -fomit-frame-pointer -falign-functions=16 -std=gnu99 -D_GNU_SOURCE -fsingle-precision-constant"
    flags="$flags -Wdouble-promotion -Wstrict-prototypes"
    # shellcheck disable=SC2086
    arm-none-eabi-gcc $flags $strict -I$stubs -Ilib -c examples/vesc/app_dqwatch.c -o "$tmp/example.o"
    ;;
moteus) # fw/BUILD: COPTS
    flags="$m4 -O2 -std=c++17 -fno-exceptions -fno-rtti -Wdouble-promotion -gdwarf-4"
    cat >"$tmp/owner.cc" <<'END'
#include "dqwatch_moteus.h"
enum dqw_status start(moteus::DqwatchMoteus *watch, const moteus::BldcServoMotor &motor);
enum dqw_status start(moteus::DqwatchMoteus *watch, const moteus::BldcServoMotor &motor)
{
    return watch->Start(motor, 1.0f / 30000.0f, 24.0f, 60.0f, 100.0f);
}
bool period(moteus::DqwatchMoteus *watch, const moteus::SinCos &sin_cos, const moteus::BldcServoStatus &status,
            const moteus::BldcServoControl_Control &control);
bool period(moteus::DqwatchMoteus *watch, const moteus::SinCos &sin_cos, const moteus::BldcServoStatus &status,
            const moteus::BldcServoControl_Control &control)
{
    watch->Sample(sin_cos, status, control, 1.0f, 1.0f, 0.0f);
    dqw_monitor_change change;
    return watch->Poll(&change) && watch->Read(DQW_WATCH_R).usable;
}
END
    # shellcheck disable=SC2086
    arm-none-eabi-g++ $flags $strict -I$stubs -Iexamples/moteus -Ilib -c "$tmp/owner.cc" -o "$tmp/example.o"
    ;;
stm32_m0) # STM32CubeMX's Makefile
    weights=-DDQW_EFFECT_WEIGHTS=0
    flags="-mcpu=cortex-m0 -mthumb -mfloat-abi=soft -Os -ffunction-sections -fdata-sections -std=gnu11 $weights"
    # shellcheck disable=SC2086
    arm-none-eabi-gcc $flags $strict -Itests/examples/stubs/stm32 -Ilib -Iport_q15 -c examples/stm32_m0/foc_q15_loop.c -o "$tmp/example.o"
    ;;
m0_run)
    set -- port_q15/*.c
    for file in change effect_name gate stage text watch; do set -- "$@" lib/dqw_$file.c; done
    status=0
    tests/target/run_on.sh m0 "$tmp/m0.elf" tests/examples/m0_board.c "$@" -DDQW_EFFECT_WEIGHTS=0 -Itests/examples/stubs/stm32 \
        -Iexamples/stm32_m0 -I. >"$tmp/said" 2>&1 || status=$?
    cat "$tmp/said"
    [ $status = 0 ] || exit $status
    # Measured with gcc 12: 2845, 199378; 1000, 997, 998, 1000. Other compilers count otherwise.
    awk '/^interrupt_worst/ { ok += $2 > 2000 && $2 < 3300 }
         /^block_mean/ { ok += $2 > 150000 && $2 < 250000 }
         /^usable_permille/ { ok += $2 >= 990 && $2 <= 1010 }
         END { exit ok != 6 }' "$tmp/said" || { echo "not as it was measured"; exit 1; }
    exit 0
    ;;
simplefoc) # STM32's Arduino core: platform.txt
    flags="$m4 -Os -std=gnu++17 -fno-exceptions -fno-rtti -fno-threadsafe-statics -ffunction-sections"
    # shellcheck disable=SC2086
    arm-none-eabi-g++ $flags -Wall -Wextra -Werror -I$stubs -Ilib -x c++ -include Arduino.h -c examples/simplefoc/simplefoc.ino -o "$tmp/example.o"
    ;;
*) echo "examples.sh: no example '$name'"; exit 2 ;;
esac
# Each dqw_ name that it leaves open is one that the library exports.
arm-none-eabi-nm -u "$tmp/example.o" | sed -n 's/^ *U \(dqw_.*\)/\1/p' | sort >"$tmp/open"
[ -s "$tmp/open" ] || { echo "calls nothing of the library"; exit 1; }
for header in lib/*.h port_q15/*.h; do
    # shellcheck disable=SC2086
    arm-none-eabi-gcc -std=c99 $weights -Ilib -Iport_q15 -E -P "$header"
done | grep -o 'dqw_[a-z0-9_]*' | sort -u | comm -23 "$tmp/open" - >"$tmp/missing"
[ ! -s "$tmp/missing" ] || { cat "$tmp/missing"; exit 1; }
