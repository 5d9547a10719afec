#!/bin/sh
# package.sh KIND WHAT: one generated package, below build/packages. WHAT: `use`: a consumer is built from the package
# as its ecosystem would, run here, and must learn a motor; `judge`: the ecosystem's own tool, from TOOLS/bin (make
# packages puts it there). Prints what is wrong; 77: what is missing, by name.
set -eu
cd "$(dirname "$0")/../.."
kind=$1 what=$2
BUILD=$(cd "${BUILD:-build}" && pwd)
CC=${CC:-cc}
CXX=${CXX:-c++}
TOOLS=${TOOLS:-$BUILD/packages/tools}
stubs=$PWD/tests/packages/stubs
consumer=$PWD/packages/consumer
out=$BUILD/packages
package=$out/$kind
work=$out/trials/$kind.$what
version=$(sed -n 's/.*DQW_VERSION "\(.*\)"/\1/p' lib/dqw_version.h)
absent() { echo "$1"; exit 77; }
needs() { command -v "$1" >/dev/null || absent "no $1 here"; }
tool() { [ -x "$TOOLS/bin/$1" ] || absent "no $1 in $TOOLS; make packages"; }
quietly() { "$@" >"$work/log" 2>&1 || { cat "$work/log"; exit 1; }; }
learned() { # its output names the version, and its exit code or its last line says that it learned
    said=$("$@") || { echo "$*: $said"; exit 1; }
    case $said in "dqwatch $version"*) ;; *) echo "$*: $said"; exit 1 ;; esac
    case $said in *"not learned"*) echo "$*: $said"; exit 1 ;; esac
}
needs python3
python3 -c 'import tomllib' 2>/dev/null || absent "python3 older than 3.11"
rm -rf "$work"
mkdir -p "$work"
python3 packages/generate.py "$out" "$kind"

# FLAGS: every source of src/ under these, and the consumers.
compile_flat() {
    mkdir "$work/objects"
    # shellcheck disable=SC2086
    (cd "$work/objects" && quietly "$CC" -std=c99 -O1 $1 -I"$package/src" -c "$package"/src/*.c)
    for part in learn learn_q15; do
        quietly "$CC" -std=c99 -I"$package/src" "$consumer/main.c" "$consumer/$part.c" "$work"/objects/*.o -lm -o "$work/$part"
        learned "$work/$part"
    done
}
# COMMANDS WEIGHTS: by these compile_commands.json the consumers have what the package hands on: room for weights, and
# flags in float.
travelled() {
    python3 - "$@" <<'END'
import json, shlex, sys, tomllib
with open("packages/facts.toml", "rb") as file:
    flags = tomllib.load(file)["float_flags"]
weights = f"-DDQW_EFFECT_WEIGHTS={sys.argv[2]}"
with open(sys.argv[1]) as file:
    commands = json.load(file)
for name, wanted in {"learn.c": {weights, *flags}, "learn_q15.c": {weights}}.items():
    lines = [shlex.split(c["command"]) for c in commands if c["file"].endswith("/" + name)]
    for line in lines or [[]]:
        if missing := wanted - set(line):
            sys.exit(f"{name} is compiled without {' '.join(sorted(missing))}: {' '.join(line)}")
END
}
# LINES: a CMake project of these, then both consumers on the target named by $2; their sources are learn and learn_q15.
compile_cmake() {
    needs cmake
    cat >"$work/CMakeLists.txt" <<END
cmake_minimum_required(VERSION 3.16)
project(consumer C)
set(learn $consumer/learn.c)
set(learn_q15 $consumer/learn_q15.c)
$1
foreach(part learn learn_q15)
    add_executable(\${part} $consumer/main.c \${\${part}})
    target_link_libraries(\${part} $2 m)
endforeach()
END
    quietly cmake -S "$work" -B "$work/build" -DCMAKE_C_COMPILER="$CC" -DCMAKE_EXPORT_COMPILE_COMMANDS=ON
    quietly cmake --build "$work/build" -j2
    travelled "$work/build/compile_commands.json" 4
    learned "$work/build/learn"
    learned "$work/build/learn_q15"
}

case $kind.$what in
platformio.use)
    compile_flat "$(python3 -c 'import json, sys; print(" ".join(json.load(open(sys.argv[1]))["build"]["flags"]))' "$package/library.json")"
    ;;
platformio.judge) # its check of the licence's name wants the network, so the copy that is judged has none
    tool pio
    export PLATFORMIO_CORE_DIR="$work/core" PLATFORMIO_SETTING_ENABLE_TELEMETRY=no
    cp -r "$package" "$work/copy"
    sed -i '/"license":/d' "$work/copy/library.json"
    quietly "$TOOLS/bin/pio" pkg pack -o "$work/dqwatch.tar.gz" "$work/copy"
    tar -tzf "$work/dqwatch.tar.gz" >"$work/list"
    for file in library.json LICENSE src/dqw.h src/dqw_monitor_q15.c examples/learn/main.c; do
        grep -qx "$file" "$work/list" || { echo "not in the archive: $file"; exit 1; }
    done
    sed -i 's/"version": "/&not /' "$work/copy/library.json"
    ! "$TOOLS/bin/pio" pkg pack -o "$work/wrong.tar.gz" "$work/copy" >"$work/log" 2>&1
    ;;
arduino.use) # the sketch as Arduino's builder has it: C++, the core's header before it; here, and on two cores of ARM
    sketch=$package/examples/LearnMotor
    { echo '#include <Arduino.h>'; cat "$sketch/LearnMotor.ino"; } >"$work/sketch.cpp"
    quietly "$CC" -std=gnu11 -O2 -w -I"$package/src" -I"$sketch" -c "$sketch/learn.c" -o "$work/learn.o"
    mkdir "$work/host"
    (cd "$work/host" && quietly "$CC" -std=gnu11 -O1 -w -I"$package/src" -c "$package"/src/*.c)
    quietly "$CXX" -std=gnu++11 -Wall -I"$stubs" -I"$package/src" -I"$sketch" "$work/sketch.cpp" "$stubs/arduino_main.cpp" "$work/learn.o" \
        "$work"/host/*.o -lm -o "$work/sketch"
    learned "$work/sketch"
    needs arm-none-eabi-g++
    for cpu in cortex-m0plus "cortex-m4 -mfloat-abi=hard -mfpu=fpv4-sp-d16"; do
        cpu="-mcpu=$cpu -mthumb -Os -ffunction-sections -fdata-sections"
        folder=$work/${cpu#-mcpu=} && folder=${folder%% *}
        mkdir "$folder"
        # shellcheck disable=SC2086
        (cd "$folder" && quietly arm-none-eabi-gcc -std=gnu11 -w $cpu -I"$package/src" -I"$sketch" -c "$package"/src/*.c "$sketch"/*.c &&
            quietly arm-none-eabi-g++ -std=gnu++11 -fno-exceptions -fno-rtti $cpu -I"$stubs" -I"$package/src" -I"$sketch" "$work/sketch.cpp" \
                "$stubs/arduino_main.cpp" ./*.o --specs=nosys.specs -Wl,--gc-sections,--no-warnings -lm -o sketch.elf) || exit 1
    done
    ;;
arduino.judge) # the specification of libraries, 1.5 format: its required fields, its categories, its folders
    python3 - "$package" "$version" <<'END'
import re, sys
from pathlib import Path
package, problems = Path(sys.argv[1]), []
fields = dict(line.split("=", 1) for line in (package / "library.properties").read_text().splitlines())
for name in "name version author maintainer sentence paragraph category url architectures".split():
    if not fields.get(name):
        problems.append(f"no {name}")
if fields["version"] != sys.argv[2] or not re.fullmatch(r"\d+\.\d+\.\d+", fields["version"]):
    problems.append("version")
if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9 _.-]{0,62}", fields["name"]) or fields["name"].lower().startswith("arduino"):
    problems.append("name")
if fields["category"] not in ("Communication", "Data Processing", "Data Storage", "Device Control", "Display", "Other", "Sensors",
                              "Signal Input/Output", "Timing", "Uncategorized"):
    problems.append("category")
if fields["sentence"].strip() in fields["paragraph"]:
    problems.append("the paragraph repeats the sentence, before which it is shown")
if any(not (package / "src" / name).is_file() for name in fields["includes"].split(",")):
    problems.append("includes")
if any((package / name).exists() for name in ("utility", "extras/src")) or list(package.glob("*.[ch]")):
    problems.append("sources beside src/")
if not [p for p in package.glob("examples/*/*.ino") if p.stem == p.parent.name]:
    problems.append("no example sketch named as its folder")
sys.exit("\n".join(problems) or 0)
END
    ;;
zephyr.use)
    tool menuconfig
    "$TOOLS/bin/python" tests/packages/kconfig.py "$package/zephyr/Kconfig" "$work/config.cmake" DQWATCH=y DQWATCH_Q15=y DQWATCH_EFFECT_WEIGHTS=4
    compile_cmake "include($stubs/zephyr.cmake)
include(config.cmake)
add_subdirectory($package/zephyr module)
target_link_libraries(zephyr_interface INTERFACE module)
target_sources(app PRIVATE \${learn})
set(learn \$<TARGET_OBJECTS:app>)" zephyr_interface
    ;;
zephyr.judge) # Kconfig's ranges and defaults by kconfiglib; module.yml by pykwalify, by Zephyr's own script where ZEPHYR_BASE says where that is
    tool pykwalify
    "$TOOLS/bin/python" tests/packages/kconfig.py "$package/zephyr/Kconfig" "$work/off.cmake"
    ! grep -q DQWATCH "$work/off.cmake" || { cat "$work/off.cmake"; exit 1; }
    "$TOOLS/bin/python" tests/packages/kconfig.py "$package/zephyr/Kconfig" "$work/on.cmake" DQWATCH=y DQWATCH_FLOAT=n
    for line in 'DQWATCH y' 'DQWATCH_Q15 y' 'DQWATCH_EFFECT_WEIGHTS 12'; do
        grep -qx "set(CONFIG_$line)" "$work/on.cmake" || { cat "$work/on.cmake"; exit 1; }
    done
    ! "$TOOLS/bin/python" tests/packages/kconfig.py "$package/zephyr/Kconfig" "$work/wide.cmake" DQWATCH=y DQWATCH_EFFECT_WEIGHTS=25 >"$work/log" 2>&1
    quietly "$TOOLS/bin/pykwalify" -d "$package/zephyr/module.yml" -s tests/packages/zephyr_module.yml
    [ -n "${ZEPHYR_BASE:-}" ] || absent "module.yml and Kconfig by pykwalify and kconfiglib pass; Zephyr's own script not: ZEPHYR_BASE is not set"
    quietly "$TOOLS/bin/python" "$ZEPHYR_BASE/scripts/zephyr_module.py" -z "$ZEPHYR_BASE" -m "$package" --kconfig-out "$work/Kconfig.modules" \
        --cmake-out "$work/modules.txt"
    grep -q '^"dqwatch":' "$work/modules.txt" && grep -q "$package/zephyr/Kconfig" "$work/Kconfig.modules"
    ;;
espidf.use)
    compile_cmake "include($stubs/espidf.cmake)
set(CONFIG_DQWATCH_EFFECT_WEIGHTS 4)
add_subdirectory($package component)" component
    ;;
espidf.judge)
    tool compote
    export IDF_TOOLS_PATH="$work/idf"
    quietly "$TOOLS/bin/compote" component pack --name dqwatch --project-dir "$package" --dest-dir "$work"
    tar -tzf "$work/dqwatch_$version.tgz" | sed 's|^\./||' >"$work/list"
    for file in idf_component.yml CMakeLists.txt Kconfig lib/dqw.h port_q15/dqw_monitor_q15.c; do
        grep -qx "$file" "$work/list" || { echo "not in the archive: $file"; exit 1; }
    done
    "$TOOLS/bin/python" tests/packages/kconfig.py "$package/Kconfig" "$work/config.cmake" DQWATCH_EFFECT_WEIGHTS=0
    ;;
cmsis.use)
    for part in Float Q15; do
        files=$(python3 tests/packages/cmsis.py "$package" "$work/$part.h" Common $part) || exit 1
        learn=learn.c
        [ $part = Float ] || learn=learn_q15.c
        # shellcheck disable=SC2086
        quietly "$CC" -std=c99 -O2 -include "$work/$part.h" -I"$consumer" $files "$consumer/main.c" "$consumer/$learn" -lm -o "$work/$part"
        learned "$work/$part"
        grep -q '^#define DQW_EFFECT_WEIGHTS ' "$work/$part.h"
    done
    # A product and a sum stay two roundings on a core that has both in one; without the header they do not.
    echo 'float both(float a, float b, float c); float both(float a, float b, float c) { return a * b + c; }' >"$work/both.c"
    needs arm-none-eabi-gcc
    core="-mcpu=cortex-m55 -mthumb -mfloat-abi=hard -std=gnu11 -O2"
    clang=
    command -v clang >/dev/null && clang="clang --target=thumbv7em-none-eabihf"
    for compiler in arm-none-eabi-gcc ${clang:+"$clang"}; do
        # shellcheck disable=SC2086
        for header in Float Q15; do
            $compiler $core -S -o - -include "$work/$header.h" "$work/both.c" >"$work/both.$header"
        done
        ! grep vfma "$work/both.Float" || { echo "$compiler: fused"; exit 1; }
        grep -q vfma "$work/both.Q15" || { echo "$compiler: never fused, so this shows nothing"; exit 1; }
    done
    ;;
cmsis.judge) # CMSIS_PACK_XSD: the specification's schema/PACK.xsd, which no registry has
    [ -f "$out/dqwatch.dqwatch.$version.pack" ]
    [ -n "${CMSIS_PACK_XSD:-}" ] || absent "PACK.xsd: CMSIS_PACK_XSD is not set"
    tool python
    "$TOOLS/bin/python" - "$CMSIS_PACK_XSD" "$package"/*.pdsc <<'END'
import sys
from lxml import etree
schema = etree.XMLSchema(etree.parse(sys.argv[1]))
if not schema.validate(etree.parse(sys.argv[2])):
    sys.exit(str(schema.error_log))
END
    ;;
meson.use) # as a subproject, without a fallback to the network
    tool meson
    mkdir -p "$work/consumer/subprojects"
    cp -r "$package" "$work/consumer/subprojects/dqwatch"
    cp "$consumer"/*.[ch] "$work/consumer"
    cat >"$work/consumer/meson.build" <<'END'
project('consumer', 'c', default_options: ['c_std=c99'])
subproject('dqwatch', default_options: ['effect_weights=4'])
executable('learn', 'main.c', 'learn.c', dependencies: dependency('dqwatch'))
executable('learn_q15', 'main.c', 'learn_q15.c', dependencies: [dependency('dqwatch_q15'), meson.get_compiler('c').find_library('m')])
END
    PATH="$TOOLS/bin:$PATH"
    quietly meson setup --wrap-mode=nodownload "$work/build" "$work/consumer"
    quietly meson compile -C "$work/build"
    travelled "$work/build/compile_commands.json" 4
    learned "$work/build/learn"
    learned "$work/build/learn_q15"
    ;;
conan.use)
    tool conan
    needs cmake
    export CONAN_HOME="$work/home"
    unset CC CXX # a profile is found for compilers by their own names, not for cc
    export CMAKE_EXPORT_COMPILE_COMMANDS=ON
    quietly "$TOOLS/bin/conan" profile detect
    for weights in 12 0; do
        rm -rf "$package/test_package/build"
        quietly "$TOOLS/bin/conan" create "$package" -nr -o "dqwatch/*:effect_weights=$weights"
        [ "$(grep -c "^dqwatch $version\$" "$work/log")" = 2 ] || { cat "$work/log"; exit 1; }
        travelled "$(find "$package/test_package/build" -name compile_commands.json)" $weights
    done
    ;;
*) echo "package.sh: no '$2' of '$1'"; exit 2 ;;
esac
