#!/bin/sh
# Online estimators of other projects on the same logs: PEER, LOG, R, Ld, Lq, psi, parted by tabs, one line a peer and
# log; or `skipped: PEER (why)`. Arguments: logs. BUILD: build folder. SMOOTH, READ: see online.py. 1 to 1.5 s a log for
# all three.
set -u
BUILD=${BUILD:-build}
here=$(dirname "$0")
out=$BUILD/bench/online
rust=$BUILD/bench/oxictl
limit=$((60 + 5 * $#))
[ $# -gt 0 ] || { echo "usage: $0 LOG.csv ..." >&2; exit 2; }
mkdir -p "$out" "$rust/src" || exit 1
printf '%s\n' "$@" >"$out/logs"

# NAME COMMAND...: runs it; it prints one line a log.
report() {
    peer=$1
    shift
    timeout "$limit" "$@" >"$out/$peer.txt" 2>"$out/$peer.log" ||
        { echo "skipped: $peer (it failed or took over $limit s; see $out/$peer.log)"; return; }
    paste "$out/logs" "$out/$peer.txt" | awk -F '\t' '{ split($2, f, " "); printf "%s\t%s\t%s\t%s\t%s\t%s\n", f[1], $1, f[2], f[3], f[4], f[5] }'
}

# The sources are copied, so that cargo's lock file stays out of the tree.
oxictl() {
    command -v cargo >/dev/null || { echo "skipped: oxictl (no cargo)"; return; }
    version=$(cargo --version 2>/dev/null | awk '{ print $2 }')
    echo "$version" | awk -F . '{ exit !($1 > 1 || ($1 == 1 && $2 >= 75)) }' ||
        { echo "skipped: oxictl (cargo ${version:-of no version}, 1.75 or newer needed)"; return; }
    cp -p "$here/oxictl/Cargo.toml" "$rust/" && cp -p "$here/oxictl/src/main.rs" "$rust/src/" || return
    CARGO_TARGET_DIR=$rust timeout 150 cargo build --release --quiet --manifest-path "$rust/Cargo.toml" >"$out/cargo.log" 2>&1 ||
        { echo "skipped: oxictl (cargo cannot build it; see $out/cargo.log)"; return; }
    report oxictl "$rust/release/oxictl-peer" "$@"
}

# NAME MODULE PACKAGE LOG...
python_peer() {
    peer=$1 module=$2 package=$3
    shift 3
    python=$(BUILD=$BUILD "$here/package.sh" "$peer" "$module" "$package") || { echo "$python"; return; }
    report "$peer" env OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 "$python" "$here/online.py" "$peer" "$@"
}

oxictl "$@"
python_peer padasip padasip 'padasip==1.2.*' "$@"
python_peer cmsis cmsisdsp_filtering 'cmsisdsp==1.10.*' "$@"
exit 0
