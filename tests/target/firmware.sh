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
flags="-mcpu=cortex-m4 -mthumb -mfloat-abi=hard -mfpu=fpv4-sp-d16 -std=c99 -ffp-contract=off -fno-math-errno -DDQW_EFFECT_WEIGHTS=0 -Os"

# The rows as floats: parsing decimals is not what is measured.
"$BUILD/dqwatch" sim joint_24v --set duration_s=2.6 --set nonideal.dead_time_V=0.24 --set nonideal.dead_time_width_A=0.05 \
    --set nonideal.demagnetisation=0.05 --set nonideal.demagnetisation.t_start_s=1.5 --set nonideal.demagnetisation.t_end_s=1.6 \
    --out "$out" >/dev/null
${CC:-cc} -std=c99 -O2 "$here/rows.c" -o "$out/rows"
"$out/rows" <"$out/joint_24v.csv" >"$out/rows.bin"

TARGET_TIMEOUT=120 "$here/run.sh" "$out/budget.elf" "$here/budget.c" lib/*.c -- -DDQW_EFFECT_WEIGHTS=0 -Os -fno-math-errno -Iexamples -- "$out/rows.bin" >"$out/budget" || {
    status=$?
    cat "$out/budget"
    exit $status
}
TARGET_TIMEOUT=120 "$here/run.sh" "$out/firmware.elf" "$here/firmware.c" examples/foc_monitor.c lib/*.c -- -DDQW_EFFECT_WEIGHTS=0 -Os -fno-math-errno -Iexamples \
    -- "$out/rows.bin" >"$out/target.txt"
${CC:-cc} -std=c99 -O2 -ffp-contract=off -DDQW_EFFECT_WEIGHTS=0 -Ilib -Iexamples -I"$here/.." "$here/firmware.c" examples/foc_monitor.c lib/*.c -lm -o "$out/firmware"
"$out/firmware" "$out/rows.bin" >"$out/host.txt"
if cmp -s "$out/target.txt" "$out/host.txt"; then echo "host_equal 1" >>"$out/budget"; else echo "host_equal 0" >>"$out/budget"; fi
echo "events $(grep -c '^event' "$out/target.txt")" >>"$out/budget"

# Flash: a firmware that monitors, less one that has the configuration and calls sqrtf, fmaxf, fminf, memcpy and memset.
text() { # FLAGS...
    # shellcheck disable=SC2086
    "$cc" $flags -ffunction-sections -fdata-sections -Ilib -Iexamples "$@" "$here/flash.c" lib/*.c -nostartfiles --specs=nosys.specs -Wl,--gc-sections -lm \
        -o "$out/flash.elf" 2>"$out/flash.log" || {
        cat "$out/flash.log"
        exit 1
    }
    "${cc%gcc}size" "$out/flash.elf" | awk 'NR == 2 { print $1 }'
}
none=$(text -DNOTHING)
{
    echo "flash_bytes $(($(text -flto) - none))"
    echo "flash_with_random_bytes $(($(text -flto -DLEND) - none))"
    echo "flash_without_lto_bytes $(($(text) - none))"
} >>"$out/budget"

value() { awk -v name="$1" '$1 == name { print $2 }' "$out/budget"; }
if [ $# = 0 ]; then
    cat "$out/budget"
    exit 0
fi
cat >"$1" <<END
# What the monitor costs on a Cortex-M4F

Measured under QEMU, which counts instructions exactly and repeatably, over a simulated log with a fault, not-a-numbers and a stuck sensor in it: \`make firmware\` writes this page, and
test_target checks it. $("$cc" --version | sed -n 's/.* \([0-9][0-9.]*\) [0-9]*$/gcc \1/p'), \`-Os\`, hard float, \`-ffp-contract=off\`, \`-fno-math-errno\`, \`DQW_EFFECT_WEIGHTS=0\`. Instructions, not cycles: a division
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
| flash of lib/, bytes, link-time optimisation (\`-flto\`) | $(value flash_bytes) | 12288 |
| the same with stage 2's Random Learner | $(value flash_with_random_bytes) | |
| flash without link-time optimisation and stage 2 | $(value flash_without_lto_bytes) | |

A block comes every 20 periods, so the background adds $(($(value background_mean) / 20)) instructions a period on average. The configuration (140 bytes), and sqrtf, fmaxf, fminf, memcpy and memset where a firmware lacks them, come on top. \`examples/foc_monitor.c\` gives
the same events on the target and on the host, to the last bit: $(value events) event over this log.
END
