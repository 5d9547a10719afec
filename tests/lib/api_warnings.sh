#!/bin/sh
# api_warnings.sh COMPILER: do the public headers, and configurations as a user writes them, compile in every language
# of that compiler without a warning? Prints what it says. 77: the compiler is not here.
# A configuration is one line of CONFIGURATIONS: header, type, its default from a nameplate ("-": none), and a field
# with a value.
set -eu
cd "$(dirname "$0")/../.."
compiler=$1
command -v "$compiler" >/dev/null || { echo "no $compiler here"; exit 77; }
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT

HEADERS='dqw.h dqw_paper.h dqw_text.h dqw_nameplate.h dqw_q15.h dqw_paper_q15.h dqw_nameplate_q15.h dqw_monitor_q15.h'
CONFIGURATIONS='
dqw_nameplate.h     dqw_nameplate       -  dt_s      5e-5f
dqw_scale.h         dqw_scale           -  dt_ns     50000
dqw_estimator.h     dqw_estimator_config  dqw_estimator_config_default  R_ohm 0.5f
dqw_monitor.h       dqw_monitor_config  dqw_monitor_config_default  J_kgm2    1e-5f
dqw_learner.h       dqw_learner_config  -  step_size 0.5f
'
WARNINGS="-Wall -Wextra -pedantic -Wshadow -Wmissing-field-initializers -Wconversion -Wsign-conversion -Wdouble-promotion -Wundef -Werror"

# Designated initialisers are no part of C++ before C++20, where gcc warns of every field that is left out: so a
# nameplate, all of it, then the default, then one field after the other. In C what is left out is zero without a word.
{
    for header in $HEADERS; do echo "#include \"$header\""; done
    echo "#if !defined(__cplusplus) || __cplusplus >= 202002L"
    echo "extern const dqw_nameplate plate_of_motor;"
    echo "const dqw_nameplate plate_of_motor = {.dt_s = 5e-5f, .v_V = 14.0f, .i_A = 6.0f, .w_m_rad_s = 110.0f, .pole_pairs = 4};"
    echo "#endif"
    echo "$CONFIGURATIONS" | while read -r header type default field value; do
        [ -n "$header" ] || continue
        echo "#include \"$header\""
        echo "$type use_${type}(const dqw_nameplate *plate);"
        echo "$type use_${type}(const dqw_nameplate *plate)"
        echo "{"
        echo "    (void)plate;"
        if [ "$default" = - ]; then
            printf '#ifdef __cplusplus\n    %s x = %s();\n#else\n    %s x = {0};\n#endif\n' "$type" "$type" "$type"
        else
            echo "    $type x = $default(plate);"
        fi
        echo "    x.$field = $value;"
        echo "    return x;"
        echo "}"
        echo "#ifndef __cplusplus"
        echo "extern const $type constant_${type};"
        echo "const $type constant_${type} = {.$field = $value};"
        echo "#endif"
    done
} >"$tmp/use.c"
cp "$tmp/use.c" "$tmp/use.cpp"

failed=0
for language in c99 c11 gnu99 c++11 c++14 c++17 c++20; do
    case $language in c++*) file=$tmp/use.cpp ;; *) file=$tmp/use.c ;; esac
    "$compiler" -std=$language $WARNINGS -Ilib -Iport_q15 -fsyntax-only "$file" 2>"$tmp/said" || {
        echo "$compiler -std=$language:"
        cat "$tmp/said"
        failed=1
    }
done
exit $failed
