#!/bin/sh
# The weights' error at every step size and amplitude, float, Q15 and CMSIS-DSP's arm_lms_norm_q15, as a table. BUILD:
# build folder, with bench/step_sizes in it. Half a minute; the peer's first installation apart.
set -u
BUILD=${BUILD:-build}
here=$(dirname "$0")
lines=$BUILD/bench/step_sizes.txt
"$BUILD/bench/step_sizes" >"$lines" || exit 1
skipped=
if python=$(BUILD=$BUILD "$here/package.sh" cmsis cmsisdsp_filtering 'cmsisdsp==1.10.*'); then
    timeout 300 "$python" "$here/step_sizes.py" "$BUILD/bench/step_sizes" <"$lines" >"$lines.peer" 2>"$lines.log" ||
        { skipped="skipped: cmsis (it failed or took over 300 s; see $lines.log)"; : >"$lines.peer"; }
else
    skipped=$python
    : >"$lines.peer"
fi

echo "Four taps learned from white noise: error of the weights in %, RMS over the last quarter of a run; amplitudes in % of full scale"
echo
awk '
    !($2 in step) { step[$2]; steps[++rows] = $2 }
    !($3 in amplitude) { amplitude[$3]; amplitudes[++columns] = $3 }
    !($1 in name) { name[$1]; names[++learners] = $1 }
    { error[$1, $2, $3] = $5 }
    END {
        printf "| step size | learner |"
        for (a = 1; a <= columns; a++) printf " %.0f |", 100 * amplitudes[a]
        printf "\n| --- | --- |"
        for (a = 1; a <= columns; a++) printf " --: |"
        printf "\n"
        for (s = 1; s <= rows; s++) for (n = 1; n <= learners; n++) {
            printf "| %s | %s |", steps[s], names[n]
            for (a = 1; a <= columns; a++) {
                e = error[names[n], steps[s], amplitudes[a]]
                printf e < 100 ? " %.2g |" : " %.0f |", e
            }
            printf "\n"
        }
    }' "$lines" "$lines.peer"
[ -z "$skipped" ] || printf '\n%s\n' "$skipped"
