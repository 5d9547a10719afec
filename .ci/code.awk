# FILE:LINE: and the line without comments, strings and characters. For C; raw strings of C++ are not known.
FNR == 1 { block = 0 }
{
    line = $0
    code = ""
    while (line != "") {
        if (block) {
            end = index(line, "*/")
            if (!end) break
            line = substr(line, end + 2)
            block = 0
        } else if (substr(line, 1, 2) == "//") {
            break
        } else if (substr(line, 1, 2) == "/*") {
            line = substr(line, 3)
            block = 1
        } else if (match(line, /^"([^"\\]|\\.)*"/) || match(line, /^'([^'\\]|\\.)*'/)) {
            code = code substr(line, 1, 1) substr(line, 1, 1)
            line = substr(line, RLENGTH + 1)
        } else {
            code = code substr(line, 1, 1)
            line = substr(line, 2)
        }
    }
    print FILENAME ":" FNR ": " code
}
