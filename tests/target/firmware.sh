#!/bin/sh
# What the monitor costs on a Cortex-M4F: runs budget.c and the example under QEMU over a simulated log, counts bytes of
# flash, and prints them: `tests/target/firmware.sh` as `name value` lines, `tests/target/firmware.sh FILE.md` writes
# the table into FILE.md. The example must give the same lines on the host, also where the model lacks something. BUILD:
# build folder. 77 where a tool is absent.
set -eu
here=$(dirname "$0")
BUILD=${BUILD:-build}
cc=${TARGET_CC:-arm-none-eabi-gcc}
out=$BUILD/target
rm -rf "$out"
mkdir -p "$out"
flags="-mcpu=cortex-m4 -mthumb -mfloat-abi=hard -mfpu=fpv4-sp-d16 -std=c99 -ffp-contract=off -fno-math-errno -DDQW_EFFECT_WEIGHTS=0 -Os"

# The rows as floats: parsing decimals is not what is measured. The machine loses flux; and has an effect that the plain
# model lacks.
${CC:-cc} -std=c99 -O2 "$here/rows.c" -o "$out/rows"
rows() { # NAME KEY=VALUE...
    name=$1
    shift
    for setting in nonideal.dead_time_V=0.24 nonideal.dead_time_width_A=0.05 "$@"; do set -- "$@" --set "$setting"; shift; done
    "$BUILD/dqwatch" sim joint_24v "$@" --out "$out" >/dev/null
    "$out/rows" <"$out/joint_24v.csv" >"$out/$name.bin"
}
rows fault duration_s=4 nonideal.demagnetisation=0.05 nonideal.demagnetisation.t_start_s=2.4 nonideal.demagnetisation.t_end_s=2.5
rows lacks duration_s=1.5 nonideal.flux_harmonic_6d_Wb=12e-4 nonideal.flux_harmonic_6q_Wb=9e-4

"$here/run.sh" "$out/budget.elf" "$here/budget.c" lib/*.c -- -DDQW_EFFECT_WEIGHTS=0 -Os -fno-math-errno -Iexamples -- "$out/fault.bin" >"$out/budget" || {
    status=$?
    cat "$out/budget"
    exit $status
}
# The example on the target and on the host: the same lines.
example() { # NAME WEIGHTS ARGUMENTS...
    name=$1 weights=-DDQW_EFFECT_WEIGHTS=$2
    shift 2
    "$here/run.sh" "$out/$name.elf" "$here/firmware.c" examples/foc_monitor.c lib/*.c -- "$weights" -Os -fno-math-errno -Werror -Iexamples \
        -- "$@" >"$out/$name.target.txt"
    ${CC:-cc} -std=c99 -O2 -ffp-contract=off "$weights" -Ilib -Iexamples -I"$here/.." "$here/firmware.c" examples/foc_monitor.c lib/*.c -lm -o "$out/$name"
    "$out/$name" "$@" >"$out/$name.host.txt"
    if cmp -s "$out/$name.target.txt" "$out/$name.host.txt"; then echo 1; else echo 0; fi
}
{
    # It stores at row 40000, before the fault; a power cycle; and goes on at row 50000, after it.
    echo "host_equal $(example firmware 0 "$out/fault.bin" 40000 50000)"
    echo "events $(grep -c '^row [0-9]* demagnetisation: psi_Wb' "$out/firmware.target.txt")"
    echo "circle_equal $(example circle 4 "$out/lacks.bin")"
    echo "circles $(grep -c '^row [0-9]* way back' "$out/circle.target.txt")"
} >>"$out/budget"

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
    echo "flash_bytes $(($(text) - none))"
    echo "flash_lent_bytes $(($(text -DLENT) - none))"
    echo "flash_stored_bytes $(($(text -DSTORED) - none))"
    echo "flash_example_bytes $(($(text -DEXAMPLE examples/foc_monitor.c) - none))"
    echo "flash_lto_bytes $(($(text -flto) - none))"
} >>"$out/budget"

value() { awk -v name="$1" '$1 == name { print $2 }' "$out/budget"; }
if [ $# = 0 ]; then
    cat "$out/budget"
    exit 0
fi
cat >"$1" <<END
# What the monitor costs on a Cortex-M4F

Measured under QEMU, which counts instructions exactly and repeatably, with \`examples/foc_config.h\` over a simulated log with a fault, not-a-numbers and a stuck sensor in it: \`make firmware\` writes
this page, and test_target checks it. $("$cc" --version | sed -n 's/.* \([0-9][0-9.]*\) [0-9]*$/gcc \1/p'), \`-Os\`, hard float, \`-ffp-contract=off\`, \`-fno-math-errno\`, \`DQW_EFFECT_WEIGHTS=0\`, no link-time optimisation but
where it says so. Instructions, not cycles: a division or a square root counts one and takes 14 cycles.

| what | measured | limit |
| --- | --: | --: |
| the paper's plain neurons, both axes, a step: instructions | $(value plain_worst) | 120 |
| a sample of the stationary frame, \`dqw_sample_from_alphabeta\`: instructions | $(value make_worst) | |
| interrupt, \`dqw_monitor_sample\`: worst instructions | $(value step_worst) | 900 |
| the same, mean | $(value step_mean) | |
| the same, stack, bytes | $(value step_stack) | 256 |
| background, \`dqw_monitor_background\`, a block: mean instructions | $(value background_mean) | |
| the same, worst (stage 2: an epoch of the Random Learner, where memory is lent) | $(value background_worst) | |
| the same, stack, bytes | $(value background_stack) | |
| start, \`dqw_monitor_init\` and \`dqw_monitor_define\`: stack, bytes | $(value start_stack) | |
| state of a motor, bytes | $(value state_bytes) | 1624 |
| stored across a power cycle, bytes | $(value stored_bytes) | |
| lent for stage 2, if wanted, bytes | $(value lent_bytes) | |
| flash of lib/: \`init\`, \`sample\`, \`background\`, \`event\`, bytes | $(value flash_bytes) | 28500 |
| the same with stage 2's Random Learner | $(value flash_lent_bytes) | |
| the same with \`store\` and \`restore\` | $(value flash_stored_bytes) | |
| all that \`examples/foc_monitor.c\` calls, its texts with it | $(value flash_example_bytes) | |
| the first with link-time optimisation (\`-flto\`) | $(value flash_lto_bytes) | |

A block comes every 20 periods, so the background adds $(($(value background_mean) / 20)) instructions a period on average. The configuration (148 bytes), and sqrtf, fmaxf, fminf, memcpy and memset where a firmware lacks them, come on top.
\`examples/foc_monitor.c\` says the same on the target and on the host, to the last bit: a fault, named $(value events) times, the second time after a power cycle, against what was stored before it; and a way back, after which it is in service with the
effect that it had lacked.
END
