#!/bin/sh
# What the monitor costs on a Cortex-M4F: runs budget.c and the example under QEMU over a simulated log, counts bytes of flash, and
# prints them: `tests/target/firmware.sh` as `name value` lines, `tests/target/firmware.sh FILE.md` writes the table into FILE.md.
# The example must give the same lines on the host. BUILD: build folder. 77 where a tool is absent.
set -eu
here=$(dirname "$0")
BUILD=${BUILD:-build}
cc=${TARGET_CC:-arm-none-eabi-gcc}
out=$BUILD/target
rm -rf "$out"
mkdir -p "$out"
flags="-mcpu=cortex-m4 -mthumb -mfloat-abi=hard -mfpu=fpv4-sp-d16 -std=c99 -ffp-contract=off -DDQW_EFFECT_WEIGHTS=0 -Os"

# The rows as floats: parsing decimals is not what is measured.
"$BUILD/dqwatch" sim joint_24v --set duration_s=2.6 --set nonideal.dead_time_V=0.24 --set nonideal.dead_time_width_A=0.05 \
    --set nonideal.demagnetisation=0.05 --set nonideal.demagnetisation.t_start_s=1.5 --set nonideal.demagnetisation.t_end_s=1.6 \
    --out "$out" >/dev/null
${CC:-cc} -std=c99 -O2 "$here/rows.c" -o "$out/rows"
"$out/rows" <"$out/joint_24v.csv" >"$out/rows.bin"

TARGET_TIMEOUT=120 "$here/run.sh" "$out/budget.elf" "$here/budget.c" lib/*.c -- -DDQW_EFFECT_WEIGHTS=0 -Os -- "$out/rows.bin" >"$out/budget" || {
    status=$?
    cat "$out/budget"
    exit $status
}
TARGET_TIMEOUT=120 "$here/run.sh" "$out/firmware.elf" "$here/firmware.c" examples/foc_monitor.c lib/*.c -- -DDQW_EFFECT_WEIGHTS=0 -Os -Iexamples \
    -- "$out/rows.bin" >"$out/target.txt"
${CC:-cc} -std=c99 -O2 -ffp-contract=off -DDQW_EFFECT_WEIGHTS=0 -Ilib -Iexamples -I"$here/.." "$here/firmware.c" examples/foc_monitor.c lib/*.c -lm -o "$out/firmware"
"$out/firmware" "$out/rows.bin" >"$out/host.txt"
if cmp -s "$out/target.txt" "$out/host.txt"; then echo "host_equal 1" >>"$out/budget"; else echo "host_equal 0" >>"$out/budget"; fi
echo "events $(grep -c '^event' "$out/target.txt")" >>"$out/budget"

# Flash: what the linker keeps of lib/ for a firmware that calls the monitor, without and with stage 2's part.
flash() { # NAME EXTRA
    for file in lib/*.c; do
        # shellcheck disable=SC2086
        "$cc" $flags -ffunction-sections -fdata-sections -Ilib -c "$file" -o "$out/$(basename "$file" .c).o"
    done
    cat >"$out/flash.c" <<'END'
#include "dqw_monitor.h"
extern const dqw_monitor_config config;
extern dqw_monitor_random lent;
dqw_monitor m;
dqw_monitor_event e;
dqw_sample s;
void _start(void)
{
    BEGIN
    for (;;) {
        (void)dqw_monitor_sample(&m, &s, false);
        (void)dqw_monitor_background(&m, &e);
    }
}
END
    sed -i "s/BEGIN/$2/" "$out/flash.c"
    # shellcheck disable=SC2086
    "$cc" $flags -Ilib -c "$out/flash.c" -o "$out/flash.o"
    # shellcheck disable=SC2086
    "$cc" $flags -nostartfiles --specs=nosys.specs -Wl,--gc-sections,--defsym=config=0,--defsym=lent=0 -Wl,-Map="$out/flash.map" "$out/flash.o" "$out"/dqw_*.o -lm \
        -o "$out/flash.elf" 2>/dev/null
    sum=0
    for size in $(awk '/^Linker script and memory map/ { on = 1 }
        on && /^ [.](text|rodata)/ { if (NF == 1) getline; if ($NF ~ /\/dqw_[a-z_]*[.]o$/) print $(NF - 1) }' "$out/flash.map"); do
        sum=$((sum + size))
    done
    echo "$1 $sum"
}
flash flash_bytes "(void)dqw_monitor_init(\&m, \&config, 0);" >>"$out/budget"
flash flash_with_random_bytes "dqw_monitor_random_init(\&lent); (void)dqw_monitor_init(\&m, \&config, \&lent);" >>"$out/budget"

value() { awk -v name="$1" '$1 == name { print $2 }' "$out/budget"; }
if [ $# = 0 ]; then
    cat "$out/budget"
    exit 0
fi
cat >"$1" <<END
# What the monitor costs on a Cortex-M4F

Measured under QEMU, which counts instructions exactly and repeatably, over a simulated log with a fault, not-a-numbers and a stuck sensor in it: \`make firmware\` writes this page, and
test_target checks it. $("$cc" --version | sed -n 's/.* \([0-9][0-9.]*\) [0-9]*$/gcc \1/p'), \`-Os\`, hard float, \`-ffp-contract=off\`, \`DQW_EFFECT_WEIGHTS=0\`. Instructions, not cycles: a division
or a square root counts one and takes 14 cycles.

| what | measured | limit |
| --- | --: | --: |
| the paper's plain neurons, both axes, a step: instructions | $(value plain_worst) | 120 |
| interrupt, \`dqw_monitor_sample\`: worst instructions | $(value step_worst) | 800 |
| the same, mean | $(value step_mean) | |
| the same, stack, bytes | $(value step_stack) | 256 |
| background, \`dqw_monitor_background\`, a block: mean instructions | $(value background_mean) | |
| the same, worst (stage 2: an epoch of the Random Learner) | $(value background_worst) | |
| the same, stack, bytes | $(value background_stack) | |
| state of a motor, bytes | $(value state_bytes) | 768 |
| lent for stage 2, bytes | $(value lent_bytes) | |
| flash of lib/, bytes | $(value flash_bytes) | 12288 |
| the same with stage 2's Random Learner | $(value flash_with_random_bytes) | |

A block comes every 20 periods, so the background adds $(($(value background_mean) / 20)) instructions a period on average. The mathematical library's sqrtf, fmaxf and fminf come on top of the flash. \`examples/foc_monitor.c\` gives
the same events on the target and on the host, to the last bit: $(value events) event over this log.
END
