#!/bin/sh
# installed.sh WHAT: `make install` as a user meets it, in a stage below the build folder. WHAT: stage (before the
# others), exports, headers, pkgconfig, find_package, add_subdirectory, cmake_install, fetchcontent, manual, sizes,
# version, abi, uninstall (after them). Consumers are packages/consumer, built from what is installed alone. Prints what
# is wrong; 77: the tool is not here.
set -eu
cd "$(dirname "$0")/../.."
here=$PWD
given=${BUILD:-build}
BUILD=$(cd "$given" && pwd)
CC=${CC:-cc}
stage=$BUILD/tests/stage
lib=$stage/usr/lib
include=$stage/usr/include/dqwatch
unset MAKEFLAGS MAKELEVEL MFLAGS
needs() { command -v "$1" >/dev/null || { echo "no $1 here"; exit 77; }; }
# The build folder by the name that it was given: make knows what depends on a header by that name alone.
made() { make --no-print-directory BUILD="$given" DESTDIR="$stage" PREFIX=/usr "$@" >"$BUILD/tests/made" 2>&1 || { cat "$BUILD/tests/made"; exit 1; }; }
version=$(sed -n 's/.*DQW_VERSION "\(.*\)"/\1/p' lib/dqw_version.h)
# A consumer's output begins with the version; its exit code says whether it learned.
learned() {
    said=$("$@") || { echo "$*: $said"; exit 1; }
    [ "${said%%"
"*}" = "dqwatch $version" ] || { echo "$*: $said"; exit 1; }
}
work=$BUILD/tests/consumer.$1
rm -rf "$work"
mkdir -p "$work"

# LINES OPTIONS WEIGHTS: a project that gets dqwatch by these lines of CMake, configured so, and must see so many
# weights.
cmake_project() {
    needs cmake
    cat >"$work/CMakeLists.txt" <<END
cmake_minimum_required(VERSION 3.16)
project(consumer C)
$1
foreach(kind dqwatch q15)
    if(kind STREQUAL q15)
        add_executable(q15 main.c learn_q15.c)
    else()
        add_executable(dqwatch_float main.c learn.c)
    endif()
endforeach()
target_link_libraries(dqwatch_float dqwatch::dqwatch)
target_link_libraries(q15 dqwatch::q15)
find_library(LIBM m)
target_link_libraries(q15 \${LIBM})
file(GENERATE OUTPUT interface.txt CONTENT
    "\$<TARGET_PROPERTY:dqwatch::dqwatch,INTERFACE_COMPILE_DEFINITIONS> \$<TARGET_PROPERTY:dqwatch::q15,INTERFACE_COMPILE_DEFINITIONS>")
file(GENERATE OUTPUT flags.txt CONTENT "\$<TARGET_PROPERTY:dqwatch_float,COMPILE_OPTIONS>")
END
    cp packages/consumer/*.[ch] "$work"
    cmake -S "$work" -B "$work/build" -DCMAKE_C_COMPILER="$CC" $2 >"$work/log" 2>&1 && cmake --build "$work/build" >>"$work/log" 2>&1 || {
        cat "$work/log"
        exit 1
    }
    weights="DQW_EFFECT_WEIGHTS=$3"
    [ "$(cat "$work/build/interface.txt")" = "$weights $weights" ] || { cat "$work/build/interface.txt"; exit 1; }
    learned "$work/build/dqwatch_float"
    learned "$work/build/q15"
}

case $1 in
stage)
    rm -rf "$stage"
    made install
    ;;
exports) # nothing but what the preprocessor finds declared in the public headers, and all of that
    for name in dqwatch dqwatch_q15; do
        nm -D --defined-only "$lib/lib$name.so" | sed -n 's/^.* T \([^@]*\).*/\1/p' | sort >"$work/$name"
        [ -s "$work/$name" ] || echo "lib$name.so exports nothing"
        grep -v '^dqw_' "$work/$name" || :
        [ "$(readelf -d "$lib/lib$name.so" | sed -n 's/.*SONAME.*\[\(.*\)\]/\1/p')" = "lib$name.so.0" ] || echo "lib$name.so: SONAME"
        [ -e "$lib/lib$name.so.0" ] || echo "lib$name.so.0 leads nowhere"
    done >"$work/found"
    # A prototype is a name before a bracket outside of all braces; those of the umbrella header are all public.
    "$CC" -std=c99 -E -P -I"$include" "$include/dqw.h" | tr '\n' ' ' | sed 's/[;{}]/&\n/g' | awk '
        depth == 0 && !/^ *(typedef|static) / && match($0, /dqw_[a-z0-9_]* *[(]/) { print substr($0, RSTART, RLENGTH - 1) }
        /[{]$/ { depth++ }
        /[}]$/ { depth-- }' | sort -u >"$work/declared"
    [ "$(wc -l <"$work/declared")" -gt 30 ] || echo "few functions in dqw.h" >>"$work/found"
    comm -23 "$work/declared" "$work/dqwatch" | sed 's/^/not exported: /' >>"$work/found"
    # A twin of each, but for texts, which have no arithmetic, and for what is a name alone.
    sed 's/_w[0-9]*$//; /_text$/d; s/$/_q15/' "$work/declared" >"$work/twins"
    sed 's/_w[0-9]*$//' "$work/dqwatch_q15" | sort >"$work/there"
    sort "$work/twins" | comm -23 - "$work/there" | sed 's/^/no twin exported: /' >>"$work/found"
    cat "$work/found"
    [ ! -s "$work/found" ]
    ;;
headers) # each alone, from where it was installed
    for header in "$include"/*.h; do
        printf '#include "%s"\ntypedef int not_empty;\n' "$(basename "$header")" | "$CC" -std=c99 -Wall -Wextra -pedantic -Werror -fsyntax-only -I"$include" -x c -
    done
    [ -f "$include/dqw.h" ] && [ -f "$include/dqw_monitor_q15.h" ] && [ ! -f "$include/dqw_estimator_block.h" ]
    ;;
pkgconfig)
    needs pkg-config
    export PKG_CONFIG_LIBDIR="$lib/pkgconfig" PKG_CONFIG_SYSROOT_DIR="$stage"
    [ "$(pkg-config --modversion dqwatch)" = "$version" ]
    pkg-config --cflags dqwatch | grep -q -- '-DDQW_EFFECT_WEIGHTS=12 -ffp-contract=off'
    for way in "" --static; do
        for name in dqwatch dqwatch-q15; do
            file=learn.c
            [ $name = dqwatch ] || file=learn_q15.c
            # pkg-config's --static names private libraries; -static is what links without the shared one.
            # shellcheck disable=SC2046
            "$CC" -std=c99 -O2 packages/consumer/main.c packages/consumer/$file $(pkg-config --cflags $name) ${way:+-static} \
                $(pkg-config $way --libs $name) -lm -o "$work/$name$way"
            LD_LIBRARY_PATH=$lib learned "$work/$name$way"
        done
    done
    ;;
find_package)
    cmake_project 'find_package(dqwatch 0.2 REQUIRED)' "-Ddqwatch_DIR=$lib/cmake/dqwatch" 12
    grep -q -e '-ffp-contract=off' "$work/build/flags.txt" || grep -rq -e '-ffp-contract=off' "$work/build/CMakeFiles/dqwatch_float.dir/flags.make"
    # Another second number is another interface.
    sed -i 's/dqwatch 0.2 REQUIRED/dqwatch 0.1 REQUIRED/' "$work/CMakeLists.txt"
    ! cmake -S "$work" -B "$work/old" "-Ddqwatch_DIR=$lib/cmake/dqwatch" >"$work/log" 2>&1
    ;;
add_subdirectory) cmake_project "add_subdirectory($here dqwatch)" -DDQW_EFFECT_WEIGHTS=0 0 ;;
cmake_install) # by CMake alone, as on a machine without make: the same two files are found
    needs cmake
    { cmake -S . -B "$work/library" -DCMAKE_C_COMPILER="$CC" -DCMAKE_INSTALL_LIBDIR=lib/some-arch && cmake --build "$work/library" -j2 &&
        cmake --install "$work/library" --prefix "$work/prefix"; } >"$work/log" 2>&1 || { cat "$work/log"; exit 1; }
    cmake_project 'find_package(dqwatch 0.2 REQUIRED)' "-DCMAKE_PREFIX_PATH=$work/prefix -Ddqwatch_DIR=$work/prefix/lib/some-arch/cmake/dqwatch" 12
    ;;
fetchcontent)
    cmake_project "include(FetchContent)
FetchContent_Declare(dqwatch GIT_REPOSITORY none)
FetchContent_MakeAvailable(dqwatch)" "-DFETCHCONTENT_SOURCE_DIR_DQWATCH=$here" 12
    ;;
sizes) # a program whose size is not the library's does not link
    export PKG_CONFIG_LIBDIR="$lib/pkgconfig" PKG_CONFIG_SYSROOT_DIR="$stage"
    needs pkg-config
    ! "$CC" -std=c99 packages/consumer/main.c packages/consumer/learn.c -DDQW_EFFECT_WEIGHTS=0 -I"$include" -L"$lib" -ldqwatch -lm \
        -o "$work/two" 2>"$work/log"
    grep -q 'dqw_estimator_init_w0' "$work/log"
    ;;
manual) # a page a subcommand, which man prints without a warning
    for name in dqwatch dqwatch-fit dqwatch-trace dqwatch-monitor; do
        [ -s "$stage/usr/share/man/man1/$name.1" ] || echo "no page $name"
    done >"$work/found"
    if command -v man >/dev/null; then
        for page in "$stage"/usr/share/man/man1/*.1; do
            { LC_ALL=C.UTF-8 MANROFFSEQ='' man --warnings -E UTF-8 -l -Tutf8 -Z "$page" >/dev/null; } 2>&1
        done >>"$work/found"
    fi
    cat "$work/found"
    [ ! -s "$work/found" ]
    ;;
version) # one number and one date, wherever one stands
    date=$(sed -n 's/^date = "\(.*\)"/\1/p' packages/facts.toml)
    grep -qxF "## [$version] - $date" CHANGELOG.md || echo "CHANGELOG.md has no heading [$version] - $date" >"$work/found"
    python3 -c 'import tomllib' 2>/dev/null || { cat "$work/found" 2>/dev/null; echo "python3 older than 3.11, or none"; exit 77; }
    python3 packages/generate.py "$work/packages" platformio arduino espidf cmsis meson conan
    cd "$work/packages"
    for file in platformio/library.json arduino/library.properties espidf/idf_component.yml cmsis/*.pdsc meson/meson.build conan/conanfile.py; do
        [ "$(grep -o '[0-9]\+\.[0-9]\+\.[0-9]\+' "$file" | grep -cxF "$version")" -ge 1 ] || echo "$file: not version $version"
        ! grep -q '@[A-Z_]*@' "$file" || echo "$file: a template's key is left"
    done >>"$work/found"
    cat "$work/found"
    [ ! -s "$work/found" ]
    ;;
uninstall)
    touch "$stage/usr/share/man/man1/other.1"
    made uninstall
    [ "$(cd "$stage" && find . ! -type d)" = ./usr/share/man/man1/other.1 ] || { find "$stage" ! -type d; exit 1; }
    ;;
abi)
    needs abidiff
    [ "$(uname -m)" = x86_64 ] || { echo "the interface is kept for x86-64"; exit 77; }
    made abi-test || exit 1
    ;;
*) echo "installed.sh: no test '$1'"; exit 2 ;;
esac
