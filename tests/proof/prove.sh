#!/bin/sh
# Frama-C's Eva over the arithmetic and the plain learner's step (q15.c): for every value that they may be given, no
# overflow, no shift that C leaves open, no signed narrowing that changes a value, nothing read before it is written.
# Prints what it cannot prove, and fails where that is not what stands in `stops`. 77 where frama-c is absent. Three
# seconds.
set -eu
here=$(dirname "$0")
# The gain: its bound needs the error and the norm seen together, (1 + |x|_1) / (1 + |x|^2) < 2, and intervals see each
# by itself. And what the proof itself says of dqw_q28_sat where the learner calls it, and shows elsewhere.
stops="dqw_q_mul32x16 dqw_q28_sat"
command -v frama-c >/dev/null || {
    echo "skipped: no frama-c here"
    exit 77
}
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
trap 'exit 1' HUP INT TERM
frama-c -eva -eva-precision 6 -eva-slevel 400 -machdep gcc_x86_32 -cpp-extra-args="-Iport_q15 -Ilib" -warn-signed-downcast -warn-left-shift-negative \
    -warn-right-shift-negative "$here/q15.c" -then -report-csv "$tmp/report" >"$tmp/log" 2>&1 || {
    cat "$tmp/log"
    exit 1
}
sed -n 's/^ *\([0-9]* functions analyzed\).*/\1/p; s/^ *In these functions, \(.*\)/\1/p' "$tmp/log" | tail -n 2
awk -F '\t' -v stops="$stops" '
    NR > 1 && $6 != "Considered valid" && $6 !~ /^Valid|^Surely valid|^Partially proven$/ {
        print $2 ":" $3 ": " $4 ": " $5 ": " $6
        open[$4]
    }
    END {
        n = split(stops, known, " ")
        for (i = 1; i <= n; i++) {
            if (known[i] in open) { print "not proved, as known: " known[i]; delete open[known[i]] }
            else { print known[i] ": proved now; prove.sh says that it is not"; failed = 1 }
        }
        for (f in open) { print "not proved: " f; failed = 1 }
        exit failed
    }' "$tmp/report"
