#!/bin/sh
# How the time of `dqwatch trace` grows: the whole catalogue on the servo with dead time and an angle offset. BUILD:
# build folder.
set -u
BUILD=${BUILD:-build}
out=$BUILD/bench/trace_speed
effects() { sed -n '/^ *"effects": \[/,/^ *"rejected":/s/^ *"name": "\(.*\)".*/\1/p' "$1" | tr '\n' ' '; }

mkdir -p "$out"
echo "dqwatch trace, reading and report included; servo with dead time and an angle offset of 0.02 rad, 1 % noise, whole catalogue"
printf '%9s %8s %8s %9s %10s  %s\n' rows wall_s cpu_s peak_MiB rows/s effects
for duration in 1 10 100; do
    "$BUILD/dqwatch" sim effect_dead_time --set nonideal.angle_offset_rad=0.02 --set duration_s=$duration --out "$out" >/dev/null || exit 1
    "$BUILD/bench/usage" "$out/usage" "$BUILD/dqwatch" trace "$out/effect_dead_time.csv" --out "$out" >/dev/null 2>&1 || exit 1
    read -r wall cpu peak <"$out/usage"
    awk "BEGIN { printf \"%9d %8.1f %8.1f %9.0f %10.0f  \", $duration * 1e4, $wall, $cpu, $peak, $duration * 1e4 / $wall }"
    effects "$out/trace.json"
    echo
done
rm -rf "$out"
