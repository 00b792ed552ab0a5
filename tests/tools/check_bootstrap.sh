#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Follows the first two commands of the README on a bare Debian 12, from nothing to the end, and says how long each took:
#   check_bootstrap.sh FOLDER
# The last commit of this checkout is cloned into a Debian that debootstrap makes in FOLDER/debian. Compilers, libraries and
# all else come from bootstrap itself. What the two commands print is in FOLDER. Needs root, debootstrap and a mirror.
# DOCENT_MIRROR is the mirror (default http://deb.debian.org/debian).
set -euo pipefail

(($# == 1)) || { echo "Usage: check_bootstrap.sh FOLDER" >&2; exit 2; }
readonly source=$(realpath "$(dirname "${BASH_SOURCE[0]}")/../..")
mkdir -p "$1"
readonly folder=$(realpath "$1") mirror=${DOCENT_MIRROR:-http://deb.debian.org/debian}
readonly root=$folder/debian

say() { printf 'check_bootstrap: %4d s: %s\n' "$SECONDS" "$*"; }
fail() { printf 'check_bootstrap: %s\n' "$*" >&2; exit 1; }

((EUID == 0)) || fail "only root can make a bare Debian"
command -v debootstrap >/dev/null || fail "debootstrap is missing: ./bootstrap tools"
[[ ! -e "$root" ]] || fail "$root exists already; remove it"

# In a mount namespace of its own, so that the devices of this machine are never below $root for others.
inside() {
  unshare --mount --pid --fork --mount-proc="$root/proc" bash -c 'mount --rbind /dev "$0/dev" && exec chroot "$0" "$@"' "$root" \
    /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C.UTF-8 TERM=dumb "$@"
}

# follow COMMAND: runs ./bootstrap COMMAND and says how long it took.
follow() {
  local begin=$SECONDS
  say "./bootstrap $1"
  inside bash -c "cd /root/docent && ./bootstrap $1" >"$folder/$1.log" 2>&1 </dev/null ||
    { tail -40 "$folder/$1.log" >&2; fail "./bootstrap $1 failed after $((SECONDS - begin)) s; see $folder/$1.log"; }
  say "./bootstrap $1 took $(((SECONDS - begin) / 60)) minutes $(((SECONDS - begin) % 60)) seconds"
}

say "a bare Debian 12 from $mirror"
debootstrap --variant=minbase bookworm "$root" "$mirror" >"$folder/debootstrap.log" 2>&1 ||
  { tail "$folder/debootstrap.log" >&2; fail "debootstrap failed"; }
cp /etc/resolv.conf "$root/etc/resolv.conf"
git clone --quiet --no-hardlinks "$source" "$root/root/docent"
say "$(inside dpkg-query --show | wc -l) packages; the sources are $(git -C "$source" log -1 --format='%h, %s')"
follow demo
for image in "$root"/root/docent/build/demo/tour-*.png; do
  [[ -s "$image" ]] || fail "the demonstration has made no images"
done
follow test
grep -E 'tests passed|Total Test time' "$folder/test.log"
say "all good: $(inside dpkg-query --show | wc -l) packages, $(du -sm "$root" | cut -f1) MB"
