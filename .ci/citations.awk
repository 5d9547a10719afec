# Arguments: the registry, then code, then, after `code=0`, documents. Each (E<n>) cited must have an entry, a line of the
# registry that begins with **(E<n>)**; ranges "(E<a>) to (E<b>)" cite all between. (P<n>) lie in 1 to 21.
function cite(kind, n) {
    if (kind == "P") {
        if (n < 1 || n > 21) print FILENAME ":" FNR ": (P" n ") is outside (P1) to (P21)"
        return
    }
    if (!(n in entry) && !((FILENAME, FNR, n) in said)) print FILENAME ":" FNR ": (E" n ") has no entry in " registry
    said[FILENAME, FNR, n] = 1
    if (code) cited[n] = 1
}
BEGIN { code = 1; registry = ARGV[1] }
FILENAME == registry && pass != 2 && match($0, /^\*\*\(E[0-9]+\)\*\*/) {
    n = substr($0, 5, RLENGTH - 7) + 0
    if (n in entry) print FILENAME ":" FNR ": (E" n ") is there already, in line " entry[n]
    else entry[n] = FNR
}
FILENAME == registry && pass != 2 { next }
{
    line = $0
    before = 0
    while (match(line, /\([EP][0-9]+\)/)) {
        kind = substr(line, RSTART + 1, 1)
        n = substr(line, RSTART + 2, RLENGTH - 3) + 0
        cite(kind, n)
        if (before && kind == was && substr(line, 1, RSTART - 1) ~ /^ +to +$/)
            for (i = before; i < n; i++) cite(kind, i)
        before = n
        was = kind
        line = substr(line, RSTART + RLENGTH)
    }
}
END { for (n in entry) if (!(n in cited)) print "warn: " registry ":" entry[n] ": (E" n ") is cited by no code" }
