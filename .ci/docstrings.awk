# Functions of a header that have no `///` directly above. Prototypes on neighbouring lines share one docstring.
FNR == 1 { depth = 0; statement = ""; comment = shared = continued = 0 }
{
    # A name that carries its size stands between the docstring and its function.
    if (/^#define .* DQW_SIZED\(/) next
    directive = continued || /^[ \t]*#/
    continued = directive && /\\$/
    if (directive || /^extern "C"/ || /^}$/ && depth == 0) { comment = shared = 0; next }
    if (/^[ \t]*\/\/\//) { comment = 1; shared = 0; next }
    code = $0
    sub(/\/\/.*/, "", code)
    if (code ~ /^[ \t]*$/) { comment = shared = 0; next }
    if (statement == "" && depth == 0) { start = FNR; first = comment || shared }
    statement = statement " " code
    opened = gsub(/{/, "{", code)
    depth += opened - gsub(/}/, "}", code)
    comment = 0
    if (depth > 0 || statement !~ /[;}][ \t]*$/) next
    shared = 0
    if (statement !~ /^ *(typedef|struct|enum|union)[^(]*({|;)/ && match(statement, /[A-Za-z_][A-Za-z_0-9]* *\(/)) {
        name = substr(statement, RSTART, RLENGTH - 1)
        if (!first) print FILENAME ":" start ": " name " has no /// directly above"
        shared = first
    }
    statement = ""
}
