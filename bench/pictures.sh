#!/bin/sh
# Renders the first screen of every report of a folder with headless Chromium, HEIGHT pixels high: pictures REPORTS OUT
set -u
reports=$1 out=$2
# A stub that a snap leaves behind answers no version.
chromium --version >/dev/null 2>&1 || { echo "skipped: pictures of the reports (no chromium; make tools installs it on Debian)"; exit 0; }
mkdir -p "$out"
profile=$(mktemp -d)
trap 'rm -rf "$profile"' EXIT
count=0
for page in "$reports"/*.html; do
    png=$out/$(basename "$page" .html).png
    chromium --headless=new --no-sandbox --no-first-run --disable-gpu --hide-scrollbars --disable-dev-shm-usage --disable-extensions \
        --user-data-dir="$profile" --virtual-time-budget=2000 --window-size=1280,"${HEIGHT:-640}" --force-device-scale-factor=0.75 --screenshot="$png" "file://$(realpath "$page")" >/dev/null 2>&1
    [ -s "$png" ] || { echo "pictures: $(basename "$page") did not render" >&2; exit 1; }
    count=$((count + 1))
done
echo "wrote $count pictures into $out"
