#!/bin/sh
# What a step costs on each core, float beside Q15: instructions under QEMU, flash, state and stack; and what of it has
# a limit. Prints the tables of docs/cost.md; `tests/target/numbers.sh FILE.md` writes them there between `<!-- numbers
# -->` and `<!-- /numbers -->`. A further row is a piece_NAME.c and a line of `pieces`. BUILD: build folder. 77 where a
# tool is absent.
set -eu
here=$(dirname "$0")
out=${BUILD:-build}/numbers
cores="m0 m3 m4f m33 rv32"
# Name, cores, what the table says.
pieces="neurons_float|$cores|the paper's neurons, both axes, float
neurons_q15|$cores|the same, Q15
sample_float|m0 m3 m4f m33|\`dqw_sample_from_dq\`
sample_q15|$cores|\`dqw_sample_from_dq_q15\`
alphabeta_float|m0 m3 m4f m33|\`dqw_sample_from_alphabeta\`
alphabeta_q15|$cores|\`dqw_sample_from_alphabeta_q15\`
estimator_float|m0 m3 m4f m33|\`dqw_estimator_sample\`, dead time, angle and a leg that rests
estimator_q15|$cores|\`dqw_estimator_sample_q15\`, the same
held_float|m0 m3 m4f m33|\`dqw_estimator_sample\`, \`voltage_next\` and \`voltage_held\` too
held_q15|$cores|\`dqw_estimator_sample_q15\`, the same
shaft_float|m0 m3 m4f m33|\`dqw_shaft_sample\`, a soft friction
shaft_q15|$cores|\`dqw_shaft_sample_q15\`, the same
monitor_float|m0 m3 m4f m33|\`dqw_monitor_sample\`, dead time, angle and a leg that rests
monitor_q15|$cores|\`dqw_monitor_sample_q15\`, the same"

# Each further weight of an effect: its name and how many weights it has, in the order of dqw_effect_name.h.
weights=12
effects="saturation 5
cross_saturation 3
winding_temperature, by heating 1
magnet_temperature, by heating 1
iron_loss 1
flux_harmonics 4
current_offset 2
current_gain_mismatch 2
angle_offset 1
delay 1
skin_effect 1
phase_resistance_imbalance 2
voltage_offset 2
flux_map 2"

# The libraries with room for so many weights, and the piece with the list of one effect, 0 without: out NAME.txt.
effect_piece() { # CORE PIECE ROOM LIST
    dir=$out/$1/room$3
    elf=$dir/$2.$4
    # shellcheck disable=SC2086
    "$here/run_on.sh" "$1" "$elf" "$here/numbers.c" "$here/stimulus.c" "$here/piece_$2.c" -DSTEPS=600u -DLIST="$4" -DDQW_EFFECT_WEIGHTS="$3" -Ilib -Iport_q15 \
        -I"$here/.." "$dir/lib.a" -lm -lc >"$elf.txt" </dev/null || {
        cat "$elf.txt" >&2
        exit 1
    }
}
effect_core() { # CORE
    compile=$("$here/run_on.sh" "$1") || exit 0
    cc=${compile%% *}
    for room in $weights $((weights - 1)) 0; do
        dir=$out/$1/room$room
        mkdir -p "$dir"
        defines="-DDQW_EFFECT_WEIGHTS=$room -Ilib -Iport_q15 -I$here/.."
        for source in lib/*.c port_q15/*.c; do
            # shellcheck disable=SC2086
            $compile -Os $defines -c "$source" -o "$dir/$(basename "$source" .c).o"
        done
        "${cc%gcc}ar" rcs "$dir/lib.a" "$dir"/*.o
        for piece in effect_float effect_q15; do
            effect_piece "$1" "$piece" "$room" 0
            # shellcheck disable=SC2086
            $compile -Os $defines -DLIST=7 "$here/piece_$piece.c" "$dir/$piece.0.bare.o" "$dir/lib.a" -nostdlib \
                -Wl,-e,piece_step,-u,piece_start,-u,piece_background,--gc-sections -lm -lc -lgcc -o "$dir/$piece.flash"
            "${cc%gcc}size" "$dir/$piece.flash" | awk 'NR == 2 { print "flash", $1 + $2 }' >>"$dir/$piece.0.txt"
        done
    done
    for piece in effect_float effect_q15; do
        list=1
        echo "$effects" | while read -r _; do
            list=$((list + 1))
            effect_piece "$1" "$piece" "$weights" "$list"
        done
    done
}
[ "${1:-}" != --effects ] || {
    effect_core "$2"
    exit 0
}

# One core: the libraries once, then each piece: run, and linked alone for its bytes of flash.
if [ "${1:-}" = --core ]; then
    core=$2
    mkdir -p "$out/$core"
    compile=$("$here/run_on.sh" "$core") || exit 0
    math="-lm -lc" sources="lib/*.c port_q15/*.c"
    # Without a C library there is no <math.h>.
    # shellcheck disable=SC2046,SC2086
    [ "$core" != rv32 ] || { math='' sources="$(grep -L 'math[.]h' lib/*.c) port_q15/*.c"; }
    defines="-DDQW_EFFECT_WEIGHTS=0 -Iexamples -Ilib -Iport_q15 -I$here/.."
    for source in $sources; do
        # shellcheck disable=SC2086
        $compile -Os $defines -c "$source" -o "$out/$core/$(basename "$source" .c).o" 2>"$out/$core/log" || [ "$core" = rv32 ] || cat "$out/$core/log" >&2
    done
    cc=${compile%% *}
    "${cc%gcc}ar" rcs "$out/$core/lib.a" "$out/$core"/*.o
    flash_of() { # SOURCE FLAGS...
        # shellcheck disable=SC2086
        $compile -Os $defines "$@" "$elf.bare.o" "$out/$core/lib.a" -nostdlib -Wl,-e,piece_step,-u,piece_start,-u,piece_background,--gc-sections \
            $math -lgcc -o "$elf.flash"
        "${cc%gcc}size" "$elf.flash" | awk 'NR == 2 { print "flash", $1 + $2 }'
    }
    echo "$pieces" | while IFS='|' read -r piece on _; do
        source=$here/piece_$piece.c
        case " $on " in *" $core "*) ;; *) continue ;; esac
        [ -f "$source" ] || continue
        elf=$out/$core/$piece
        # shellcheck disable=SC2086
        "$here/run_on.sh" "$core" "$elf" "$here/numbers.c" "$here/stimulus.c" "$source" $defines "$out/$core/lib.a" $math >"$elf.txt" </dev/null || {
            cat "$elf.txt" >&2
            exit 1
        }
        flash_of "$source" >>"$elf.txt"
        case $piece in monitor_*)
            flash_of "$source" -DLENT >>"$elf.lent.txt"
            flash_of "$source" -DSTORED >>"$elf.stored.txt"
            ;;
        esac
    done
    exit 0
fi

rm -rf "$out"
mkdir -p "$out"
for core in $cores; do "$here/run_on.sh" "$core" >"$out/$core.compiler" || {
    cat "$out/$core.compiler"
    exit 77
}; done
export BUILD="${BUILD:-build}"
for core in $cores; do echo "$core"; done | xargs -n 1 -P "$(nproc)" "$0" --core
printf '%s\n' m0 m4f | xargs -n 1 -P "$(nproc)" "$0" --effects

value() { # CORE PIECE NAME
    awk -v name="$3" '$1 == name { print $2 }' "$out/$1/$2.txt"
}
version() { $(cut -d ' ' -f 1 "$out/$1.compiler") -dumpfullversion; }
cell() { # PIECE CORE WHICH
    if [ ! -f "$out/$2/$1.txt" ]; then
        printf ' | –'
    elif [ "$3" = instructions ]; then
        printf ' | %s, %s' "$(value "$2" "$1" worst)" "$(value "$2" "$1" mean)"
    else
        printf ' | %s, %s, %s' "$(value "$2" "$1" flash)" "$(value "$2" "$1" state)" "$(value "$2" "$1" stack)"
    fi
}
# Of the last of a few steps, whose instructions stand beside them.
estimates() {
    said=
    echo "$pieces" | while IFS='|' read -r piece _ label; do
        source=$here/piece_$piece.c
        [ -f "$source" ] || continue
        cycles=$("$here/mca.sh" "$out" "$here/numbers.c" "$here/stimulus.c" "$source" -DDQW_EFFECT_WEIGHTS=0 -Iexamples "$out/m4f/lib.a" -lm -lc </dev/null |
            awk '$1 == "mca_instructions" { n = $2 } $1 == "mca_cycles" { print $2 " (" n ")" }')
        [ -z "$cycles" ] || printf '%s' "${said:+; }$label $cycles"
        said=1
    done
}
of_effect() { # CORE PIECE ROOM LIST NAME
    awk -v name="$5" '$1 == name { print $2 }' "$out/$1/room$3/$2.$4.txt"
}
effects_of() { # CORE PIECE NAME: of every effect, least first
    for list in $(seq 2 $((1 + $(echo "$effects" | wc -l)))); do of_effect "$1" "$2" $weights "$list" "$3"; done | sort -n
}
# What any list takes is what the cheapest does.
cheapest() { effects_of "$1" "$2" mean | head -n 1; }
further() { # CORE PIECE LIST WEIGHTS: instructions
    awk "BEGIN { printf \" | %.0f\", ($(of_effect "$1" "$2" $weights "$3" mean) - $(cheapest "$1" "$2")) / $4 }"
}
any_list() { # CORE PIECE
    printf ' | %s' $(($(cheapest "$1" "$2") - $(of_effect "$1" "$2" $weights 0 mean)))
}
effect_table() {
    printf '| each further weight of an effect: instructions in the interrupt | M4F, float | M4, Q15 | M0, float | M0, Q15 |\n| --- | --: | --: | --: | --: |\n'
    printf '| any list of effects, once'
    for core in m4f m0; do for piece in effect_float effect_q15; do any_list $core $piece; done; done
    printf ' |\n'
    list=1
    echo "$effects" | while read -r line; do
        list=$((list + 1))
        printf '| %s' "${line% *}"
        for core in m4f m0; do for piece in effect_float effect_q15; do further $core $piece $list "${line##* }"; done; done
        printf ' |\n'
    done
    printf '| worst step of the estimator with one of these effects'
    for core in m4f m0; do for piece in effect_float effect_q15; do printf ' | %s' "$(effects_of $core $piece worst | tail -n 1)"; done; done
    printf ' |\n'
    for name in state flash; do
        case $name in state) printf '| bytes of state a weight' ;; flash) printf '| bytes of flash, all effects' ;; esac
        for core in m4f m0; do for piece in effect_float effect_q15; do
            least=$([ $name = state ] && echo $((weights - 1)) || echo 0)
            printf ' | %s' $(($(of_effect $core $piece $weights 0 $name) - $(of_effect $core $piece "$least" 0 $name)))
        done; done
        printf ' |\n'
    done
    printf '\nMean step of the estimator with that effect, less one with the cheapest, divided by its weights; a heating state takes about 60 more at the end of a half. dead_time is a weight of the estimator itself.\n'
}
# What has a limit: MEASURED [AT_MOST]
limit() {
    if [ $# = 1 ]; then printf ' | %s' "$1"; elif [ "$1" -le "$2" ]; then printf ' | %s of %s' "$1" "$2"; else printf ' | **%s, over %s**' "$1" "$2"; fi
}
worst_of() { # CORE NAMES...: the most instructions of these pieces
    core=$1
    shift
    for piece; do value "$core" "$piece" worst; done | sort -n | tail -n 1
}
limits() {
    printf '| measured, and its limit | M4F, float | M4, Q15 | M0, Q15 |\n| --- | --: | --: | --: |\n| every step of an interrupt, dead time, angle and a leg that rests, worst: instructions'
    limit "$(worst_of m4f sample_float alphabeta_float estimator_float shaft_float monitor_float)" 900
    limit "$(worst_of m4f sample_q15 alphabeta_q15 estimator_q15 shaft_q15 monitor_q15)" 900
    limit "$(worst_of m0 sample_q15 alphabeta_q15 estimator_q15 shaft_q15 monitor_q15)" 2100
    printf ' |\n| the same with `voltage_next` and `voltage_held`'
    limit "$(value m4f held_float worst)" 900
    limit "$(value m4f held_q15 worst)" 900
    limit "$(value m0 held_q15 worst)" 2100
    printf ' |\n| state of a motor, monitor: bytes'
    limit "$(value m4f monitor_float state)" 1624
    limit "$(value m4f monitor_q15 state)" 1912
    limit "$(value m0 monitor_q15 state)" 1912
    printf ' |\n| flash, monitor with `init`, `sample`, `background`, `event`: bytes'
    limit "$(value m4f monitor_float flash)" 29150
    limit "$(value m4f monitor_q15 flash)" 39800
    limit "$(value m0 monitor_q15 flash)" 45050
    for more in lent stored; do
        case $more in lent) printf ' |\n| with memory lent to stage 2, its Random Learner' ;; *) printf ' |\n| with `store` and `restore`' ;; esac
        for piece in m4f/monitor_float m4f/monitor_q15 m0/monitor_q15; do limit "$(value "${piece%/*}" "${piece#*/}.$more" flash)"; done
    done
    printf ' |\n| each further weight of an effect without a table, worst: instructions'
    limit "$(worst_weight m4f effect_float)" 40
    limit "$(worst_weight m4f effect_q15)"
    limit "$(worst_weight m0 effect_q15)"
    printf ' |\n| a flux map, both its weights: instructions'
    limit "$(of_map m4f effect_float)" 140
    limit "$(of_map m4f effect_q15)"
    limit "$(of_map m0 effect_q15)"
    printf ' |\n\nM4F, M4: one core, with and without its floating-point unit in use. No link-time optimisation.\n'
}
# The last of the effects.
of_map() { # CORE PIECE
    further "$1" "$2" $((1 + $(echo "$effects" | wc -l))) 1 | tr -d ' |'
}
worst_weight() { # CORE PIECE
    list=1
    echo "$effects" | grep -v '^flux_map' | while read -r line; do
        list=$((list + 1))
        further "$1" "$2" $list "${line##* }" | tr -d ' |'
        echo
    done | sort -n | tail -n 1
}
table() {
    printf '| one step: instructions, worst and mean; bytes of flash, state, stack | M0 | M3 | M4F | M33 | RV32IMC |\n| --- | --: | --: | --: | --: | --: |\n'
    echo "$pieces" | while IFS='|' read -r piece _ label; do
        [ -f "$here/piece_$piece.c" ] || continue
        for which in instructions bytes; do
            printf '| %s' "$label: $which"
            for core in $cores; do cell "$piece" "$core" "$which"; done
            printf ' |\n'
        done
    done
    printf '\nUnder QEMU, `make numbers`, `-Os`; arm-none-eabi-gcc %s, riscv64-unknown-elf-gcc %s. Flash holds the compiler'\''s own float where the core has none.\n' \
        "$(version m4f)" "$(version rv32)"
    estimated=$(estimates)
    [ -z "$estimated" ] || printf 'Cycles of a Cortex-M4, as llvm-mca %s estimates them, for a step of so many instructions: %s.\n' "$(llvm-mca --version | sed -n 's/.*LLVM version \([0-9.]*\).*/\1/p')" "$estimated"
}
{
    limits
    echo
    table
    echo
    effect_table
} >"$out/table.md"
[ $# = 1 ] || {
    cat "$out/table.md"
    exit 0
}
grep -q '^<!-- numbers -->$' "$1"
awk -v table="$out/table.md" '
    /^<!-- \/numbers -->$/ { inside = 0 }
    !inside { print }
    /^<!-- numbers -->$/ { inside = 1; while ((getline line < table) > 0) print line }' "$1" >"$out/page.md"
cat "$out/page.md" >"$1"
