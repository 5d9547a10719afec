#!/bin/sh
# all.sh: every package judged by its ecosystem's tool and used by a consumer; a line each: ok, skip with the reason, or
# FAIL with what was said. The tools come from PyPI into build/packages/tools; what cannot be had is skipped by name.
set -u
cd "$(dirname "$0")/../.." || exit
BUILD=${BUILD:-build}
mkdir -p "$BUILD/packages"
TOOLS=${TOOLS:-$(cd "$BUILD/packages" && pwd)/tools}
export BUILD TOOLS
if [ ! -x "$TOOLS/bin/python" ]; then
    python3 -m venv "$TOOLS" || echo "no virtual environment in $TOOLS: python3-venv is not here"
fi
for package in platformio idf-component-manager pykwalify kconfiglib lxml meson ninja conan; do
    [ ! -x "$TOOLS/bin/pip" ] || "$TOOLS/bin/pip" show -q "$package" >/dev/null 2>&1 || "$TOOLS/bin/pip" install -q "$package" ||
        echo "$package cannot be had from PyPI"
done
failed=0
for trial in platformio.judge platformio.use arduino.judge arduino.use zephyr.judge zephyr.use espidf.judge espidf.use cmsis.judge cmsis.use \
    meson.use conan.use; do
    said=$(tests/packages/package.sh "${trial%.*}" "${trial#*.}" 2>&1)
    case $? in
    0) echo "ok   $trial" ;;
    77) echo "skip $trial: $said" ;;
    *) echo "FAIL $trial"; echo "$said" | sed 's/^/     /'; failed=1 ;;
    esac
done
exit $failed
