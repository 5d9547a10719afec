#!/bin/sh
# llvm-mca's estimate of a Cortex-M4's cycles for one piece_step(): QEMU names the instructions that the last of a few
# calls executes, and llvm-mca, told that each follows the one before, adds up what they take:    tests/target/mca.sh
# FOLDER SOURCE.c ... [CFLAGS ...] An estimate: it knows latencies, and neither wait states of the flash nor the refill
# after a branch. 77 where a tool is absent.
set -eu
here=$(dirname "$0")
qemu=${TARGET_QEMU:-qemu-system-arm}
for tool in llvm-mca llvm-objdump "$qemu"; do command -v "$tool" >/dev/null || exit 77; done
out=$1
shift
"$here/run_on.sh" m4f "$out/mca.elf" "$@" -DSTEPS=40u >"$out/mca.log"
# One instruction a block, so that the log names each.
single=-singlestep
if "$qemu" -accel tcg,help 2>&1 | grep -q one-insn-per-tb || "$qemu" -help | grep -q one-insn-per-tb; then single="-accel tcg,one-insn-per-tb=on"; fi
# shellcheck disable=SC2086
timeout 600 "$qemu" -M mps2-an386 -display none -monitor none -serial none -icount shift=10 $single -d exec,nochain -D "$out/mca.trace" \
    -chardev null,id=out -semihosting-config enable=on,target=native,chardev=out -kernel "$out/mca.elf" </dev/null
llvm-objdump -d --no-show-raw-insn "$out/mca.elf" | awk '
    FILENAME == "-" && /^ +[0-9a-f]+:/ {
        at = $1
        sub(/:/, "", at)
        sub(/^ *[0-9a-f]+:[ \t]*/, "")
        sub(/[ \t]*[@<].*/, "")
        text[at] = $0
        next
    }
    # Trace 0: HOST [BASE/PC/FLAGS/...] SYMBOL
    FILENAME != "-" && /^Trace/ {
        split($4, word, "/")
        pc = word[2]
        sub(/^0+/, "", pc)
        if ($NF == "piece_step" && outside) { n = 0; outside = 0 }
        if ($NF == "main") outside = 1
        if (!outside) step[n++] = pc
    }
    # A call counts as a branch: what it calls follows.
    END { for (i = 0; i < n; i++) { line = text[step[i]]; sub(/^blx?[ \t]/, "b ", line); print line } }' - "$out/mca.trace" >"$out/mca.s"
rm "$out/mca.trace"
llvm-mca -mtriple=thumbv7em-none-eabi -mcpu=cortex-m4 -iterations=1 "$out/mca.s" 2>"$out/mca.log" | awk '/^Instructions:/ { print "mca_instructions", $2 } /^Total Cycles:/ { print "mca_cycles", $3 }'
