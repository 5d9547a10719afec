#!/bin/sh
# Runs every fixed-point module with each compiler and on each core there is (hash.c), and compares the trajectories to
# the last bit: a table with a row a machine and a column a module. Status 1 where one differs or fails; a row whose
# tool is absent says so. BUILD: build folder.
set -eu
here=$(dirname "$0")
out=${BUILD:-build}/target_q15
rm -rf "$out"
mkdir -p "$out"
sources="$here/hash*.c $here/stimulus.c port_q15/*.c lib/dqw_gate.c lib/dqw_stage.c lib/dqw_change.c lib/dqw_watch.c lib/dqw_effect_name.c"
# Room for the effects of hash_effect.c; the smallest board has 16 kB for the objects of all modules and the stack.
room=-DDQW_EFFECT_WEIGHTS=12

host() { # NAME COMPILER FLAGS...
    name=$1 compiler=$2
    shift 2
    command -v "$compiler" >/dev/null || {
        echo "skipped: no $compiler here"
        return 77
    }
    # shellcheck disable=SC2086
    "$compiler" -std=c99 "$@" $room -I"$here/.." -Ilib -Iport_q15 $sources "$here/say.c" -o "$out/$name" && "$out/$name"
}
row() { # NAME COMMAND...
    file=$out/$1.txt
    shift
    status=0
    "$@" >"$file" 2>&1 || status=$?
    echo "$status" >"$file.status"
}
(
    row gcc host gcc gcc -O2
    row clang host clang clang -O2
    row gcc-ubsan host gcc-ubsan gcc -O1 -fsanitize=undefined -fno-sanitize-recover=undefined
    # Stops at an overflow, a shift that C does not define, or a conversion that loses a bit or the sign.
    row clang-trap host clang-trap clang -O1 -fsanitize=undefined,implicit-conversion -fsanitize-trap=all
    row m0 "$here/run_on.sh" m0 "$out/m0.elf" $sources $room
) &
(
    for core in m3 m4f m33 rv32; do row $core "$here/run_on.sh" $core "$out/$core.elf" $sources $room; done
) &
wait

for machine in gcc clang gcc-ubsan clang-trap m0 m3 m4f m33 rv32; do
    echo "$machine $(cat "$out/$machine.txt.status")"
    cat "$out/$machine.txt"
done | awk '
    function line(first, cells, i) { printf "%-10s", first; for (i = 1; i <= columns; i++) printf " %16s", cells[i]; print "" }
    # A row begins with its name and its status.
    NF == 2 && $2 ~ /^[0-9]+$/ && $1 ~ /^(gcc|clang|gcc-ubsan|clang-trap|m0|m3|m4f|m33|rv32)$/ { machine = $1; order[++rows] = $1; status[$1] = $2; next }
    NF == 2 && status[machine] == 0 && $2 ~ /^[0-9a-f]+$/ {
        got[machine, $1] = $2
        if (!($1 in right)) { right[$1] = $2; first[$1] = machine; name[++columns] = $1 }
        next
    }
    { said[machine] = said[machine] (said[machine] == "" ? "" : "\n    ") $0 }
    END {
        line("", name)
        for (r = 1; r <= rows; r++) {
            m = order[r]
            if (status[m] != 0) {
                printf "%-10s %s%s\n", m, status[m] == 77 ? "" : "FAIL, status " status[m] ": ", said[m]
                if (status[m] != 77) failed = 1
                continue
            }
            ran++
            for (i = 1; i <= columns; i++) {
                k = name[i]
                cell[i] = first[k] == m ? right[k] : got[m, k] == right[k] ? "same" : "DIFFERS"
                if (got[m, k] != right[k]) failed = 1
            }
            line(m, cell)
        }
        if (failed) print "FAIL"
        exit failed || ran == 0
    }'
