#!/bin/sh
# RMS error in % of the online estimators of other projects (run.sh) over three logs of the joint per noise level, plain
# and smoothed. BUILD: build folder, with bench/accuracy in it. READ: see online.py.
set -u
BUILD=${BUILD:-build}
here=$(dirname "$0")
logs=$BUILD/bench/online/logs_joint
mkdir -p "$logs" || exit 1
trap 'rm -rf "$logs"' EXIT
trap 'exit 1' HUP INT TERM
"$BUILD/bench/accuracy" --csv "$logs" || exit 1

echo "Peers on the joint, start values 30 % wrong: RMS error in % over 3 logs; rows smoothed by a moving mean over so many"
echo
echo "| peer       | smoothed | noise | R         | L_d       | L_q       | flux      |"
echo "| ---------- | -------: | ----: | --------: | --------: | --------: | --------: |"
for smooth in 1 80; do
    BUILD=$BUILD SMOOTH=$smooth "$here/run.sh" "$logs"/*.csv | awk -v rows="$smooth" '{ print rows "\t" $0 }'
done | awk -F '\t' '
    BEGIN { split("0.5 1e-3 1.4e-3 20e-3", truth, " "); split("0 1 5 20", level, " ") }
    NF == 2 { if (!told[$2]++) skipped = skipped $2 "\n"; next }
    {
        noise = $3
        sub(/.*\//, "", noise)
        sub(/_.*/, "", noise)
        if (!known[$1, $2]++) order[++groups] = $1 SUBSEP $2
        count[$1, $2, noise]++
        for (i = 1; i <= 4; i++) {
            off = 100 * ($(3 + i) / truth[i] - 1)
            if ($(3 + i) == "-") lost[$1, $2, noise, i] = 1
            square[$1, $2, noise, i] += off * off
        }
    }
    END {
        for (g = 1; g <= groups; g++) for (l = 1; l <= 4; l++) {
            at = order[g] SUBSEP level[l]
            if (!count[at]) continue
            split(order[g], name, SUBSEP)
            printf "| %-10s | %8d | %3d %% |", name[2], name[1], level[l]
            for (i = 1; i <= 4; i++)
                if (lost[at, i]) printf " %9s |", "-"
                else printf " %9.3f |", sqrt(square[at, i] / count[at])
            printf "\n"
        }
        if (skipped != "") printf "\n%s", skipped
    }'
