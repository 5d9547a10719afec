#!/bin/sh
# full.sh [clean] [debian]: what needs bare systems, as root; debootstrap, from this machine's own mirror. What is
# committed is what is tried. clean   on Debian 12 and 13 with make and a C compiler alone: make lib, make install-lib,
# programs on it; then make install and make
#         packages, which install what they need
# debian  on Debian 13: dpkg-buildpackage, lintian without an error or a warning; then in a second bare one the packages
# installed, and
#         autopkgtest
# A line a step; logs in build/packages/full. SUITES: which of bookworm and trixie are tried.
set -eu
cd "$(dirname "$0")/../.."
[ "$(id -u)" = 0 ] || { echo "make packages-full: needs root, for chroots" >&2; exit 1; }
command -v debootstrap >/dev/null || { apt-get update -qq; apt-get install -y -qq --no-install-recommends debootstrap debian-archive-keyring >/dev/null; }
mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' | grep '/debian/*$' | head -n 1)
full=${BUILD:-build}/packages/full
mkdir -p "$full"
full=$(cd "$full" && pwd)
[ $# != 0 ] || set -- clean debian
root=
trap '[ -z "$root" ] || rm -rf --one-file-system "$root"' EXIT
trap 'exit 1' HUP INT TERM
failed=0

# SUITE PACKAGES: a bare system in $root, with this machine's certificates.
bare() {
    [ -z "$root" ] || rm -rf --one-file-system "$root"
    root=$(mktemp -d)
    chmod 755 "$root"
    debootstrap --variant=minbase --include="$2" "$1" "$root" ${mirror:+"$mirror"} >"$full/$1.debootstrap" 2>&1 || { tail "$full/$1.debootstrap"; exit 1; }
    [ ! -f "${PIP_CERT:-}" ] || cp "$PIP_CERT" "$root/etc/host.crt"
    mkdir "$root/dqwatch"
}
# NAME COMMANDS: in $root, a line of what came of it.
step() {
    log=$full/$1.log
    begun=$(date +%s)
    status=0
    unshare --mount --pid --fork sh -ec '
        mount -t proc proc "$1/proc"
        mount -t tmpfs tmpfs "$1/dev/shm"
        mount --rbind /dev/pts "$1/dev/pts"
        certificate=
        [ ! -f "$1/etc/host.crt" ] || certificate=PIP_CERT=/etc/host.crt
        exec chroot "$1" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root DEBIAN_FRONTEND=noninteractive $certificate sh -ec "cd /dqwatch; $2"' \
        sh "$root" "$2" >"$log" 2>&1 </dev/null || status=$?
    [ $status = 0 ] && echo "ok   $1 ($(($(date +%s) - begun)) s)" || { echo "FAIL $1: $log"; tail -n 15 "$log" | sed 's/^/     /'; failed=1; }
    grep -E '^(skip|FAIL) ' "$log" || :
    return $status
}

for part in "$@"; do
    case $part in
    clean)
        for suite in ${SUITES:-bookworm trixie}; do
            bare $suite make,gcc,libc6-dev,ca-certificates
            git archive HEAD | tar -x -C "$root/dqwatch"
            step $suite-lib 'make lib; make install-lib; from=packages/consumer
                cc -I/usr/local/include/dqwatch $from/main.c $from/learn.c -ldqwatch -lm -o /tmp/learn; /tmp/learn
                cc -I/usr/local/include/dqwatch $from/main.c $from/learn_q15.c -ldqwatch_q15 -lm -o /tmp/learn_q15; /tmp/learn_q15
                make uninstall; test -z "$(find /usr/local ! -type d -name "*dqw*")"' || continue
            step $suite-packages 'make packages' || :
            step $suite-install 'make demo; make install DESTDIR=/stage PREFIX=/usr; LD_LIBRARY_PATH=/stage/usr/lib /stage/usr/bin/dqwatch --version;
                make uninstall DESTDIR=/stage PREFIX=/usr; test -z "$(find /stage/usr -name "*dqw*")"' || :
        done
        ;;
    debian)
        python3 packages/generate.py "$full" debian
        bare trixie build-essential,ca-certificates
        cp -r "$full/debian" "$root/dqwatch/source"
        step debian-build 'apt-get update -qq; cd source; apt-get build-dep -y -qq --no-install-recommends ./ >/dev/null; dpkg-buildpackage -us -uc' || continue
        step debian-lintian 'apt-get install -y -qq --no-install-recommends lintian >/dev/null
            useradd someone; su someone -c "lintian --fail-on error,warning /dqwatch/*.changes"' || :
        rm -rf "$full/debs"
        mkdir "$full/debs"
        find "$root/dqwatch" -maxdepth 1 -type f ! -name '*dbgsym*' -exec cp {} "$full/debs" \;
        bare trixie ca-certificates
        cp "$full"/debs/* "$root/dqwatch"
        step debian-installed 'apt-get update -qq; apt-get install -y -qq --no-install-recommends ./libdqwatch*_*.deb ./dqwatch_*.deb >/dev/null
            dqwatch --version; cd /tmp; dqwatch demo; ldconfig -p | grep libdqwatch.so.0' || :
        step debian-autopkgtest 'apt-get install -y -qq --no-install-recommends autopkgtest >/dev/null
            cd /tmp; autopkgtest --output-dir=/tmp/results /dqwatch/*.deb /dqwatch/*.dsc -- null' || :
        ;;
    *) echo "full.sh [clean] [debian]" >&2; exit 2 ;;
    esac
done
exit $failed
