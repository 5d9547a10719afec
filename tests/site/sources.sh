#!/bin/sh
# tests/site/sources.sh [broken]: links, anchors, navigation and formulas of the documentation as it stands; `broken`
# puts mistakes into a copy and wants each found. Wants python3 alone.
set -eu
command -v python3 >/dev/null || { echo "no python3"; exit 77; }
export PYTHONDONTWRITEBYTECODE=1
if [ $# = 0 ]; then exec python3 docs/site/stage.py --check; fi

tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
copy() {
    rm -rf "$tmp/tree"
    mkdir -p "$tmp/tree"
    cp -R ./*.md LICENSE docs examples "$tmp/tree/"
    [ ! -f python/README.md ] || { mkdir -p "$tmp/tree/python" && cp python/README.md "$tmp/tree/python/"; }
}
wants() { # WHAT, in the copy
    if said=$(python3 "$tmp/tree/docs/site/stage.py" --check); then echo "not seen: $1"; exit 1; fi
    case $said in *"$1"*) ;; *) echo "not seen: $1; said: $said"; exit 1 ;; esac
}
copy
echo 'See [it](docs/NOTHING.md).' >>"$tmp/tree/README.md"
wants "README.md: no docs/NOTHING.md"
copy
echo 'See [it](docs/GLOSSARY.md#no-such-heading).' >>"$tmp/tree/README.md"
wants "has no heading for #no-such-heading"
copy
echo '# New' >"$tmp/tree/docs/NEW.md"
wants "docs/NEW.md has no line"
copy
sed -i 's/claims.md/claim.md/' "$tmp/tree/docs/site/mkdocs.yml"
wants "nobody makes claim.md"
copy
echo 'and `(a + b`' >>"$tmp/tree/docs/EQUATIONS.md"
wants "no ) in"
