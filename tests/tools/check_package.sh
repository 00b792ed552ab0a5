#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Makes the Debian package of a build twice, compares and checks it, and installs it into a bare Debian 12, where docent
# is run and removed again: check_package.sh BUILD_FOLDER
# What a check needs and is missing here (lintian; root, debootstrap and a mirror, for the bare Debian) is said.
# DOCENT_MIRROR is the mirror (default http://deb.debian.org/debian).
set -euo pipefail

(($# == 1)) || { echo "Usage: check_package.sh BUILD_FOLDER" >&2; exit 2; }
readonly build=$(realpath "$1")
readonly mirror=${DOCENT_MIRROR:-http://deb.debian.org/debian}
readonly work=$(mktemp -d)
trap 'rm -rf --one-file-system "$work"' EXIT

say() { printf 'check_package: %4d s: %s\n' "$SECONDS" "$*"; }
fail() { printf 'check_package: %s\n' "$*" >&2; exit 1; }

# pack NAME: the package of the build, in $work/NAME.
pack() {
  cpack --config "$build/CPackConfig.cmake" -B "$work/$1" >"$work/$1.log" 2>&1 || { cat "$work/$1.log" >&2; fail "cpack failed"; }
}

check_reproducible() {
  say "packing twice"
  pack first
  pack second
  packages=("$work"/first/docent_*_"$(dpkg --print-architecture)".deb)
  [[ -f ${packages[0]} ]] || fail "cpack wrote no docent_VERSION_ARCHITECTURE.deb"
  deb=${packages[0]}
  cmp "$deb" "$work/second/$(basename "$deb")" || fail "two packages of one build differ"
  SOURCE_DATE_EPOCH=86400 pack dated
  dpkg-deb -c "$work/dated/$(basename "$deb")" >"$work/dated.txt"
  grep -q ' 1970-01-02 00:00 ./usr/bin/docent$' "$work/dated.txt" ||
    fail "SOURCE_DATE_EPOCH does not set the time of the files"
}

# check_with TOOL COMMAND...: runs the command, if the tool is installed.
check_with() {
  local tool=$1
  shift
  command -v "$tool" >/dev/null || { say "skipped: $tool is not installed"; return 0; }
  say "$tool"
  "$@" >"$work/$tool.log" 2>&1 || { cat "$work/$tool.log" >&2; fail "$tool finds faults (see above)"; }
}

# Both builds of the program, and the launcher that chooses between them.
check_programs() {
  local level
  [[ "$(dpkg --print-architecture)" == amd64 ]] || return 0
  for level in x86-64 x86-64-v3; do
    [[ -x "$work/contents/usr/libexec/docent/$level/docent" ]] || fail "the program for $level is missing: ./bootstrap package adds it"
  done
  if readelf -n "$work/contents/usr/libexec/docent/x86-64/docent" "$work/contents/usr/bin/docent" | grep 'ISA needed.*v3'; then
    fail "a program for all processors needs x86-64-v3"
  fi
}

check_contents() {
  local page warnings
  dpkg-deb -x "$deb" "$work/contents"
  local share=$work/contents/usr/share
  if compgen -G "$work/contents/usr/include" >/dev/null || compgen -G "$work/contents/usr/lib" >/dev/null; then
    fail "the package holds parts for developers"
  fi
  # The address of the maintainer is given by who distributes the package (DOCENT_PACKAGE_CONTACT).
  check_with lintian lintian --allow-root --fail-on error,warning \
    --suppress-tags bogus-mail-host,bogus-mail-host-in-debian-changelog "$deb"
  check_with desktop-file-validate desktop-file-validate "$share"/applications/*.desktop
  check_with appstreamcli appstreamcli validate --no-net "$share"/metainfo/*.xml
  check_with bash bash -n "$share/bash-completion/completions/docent"
  check_with zsh zsh -n "$share/zsh/vendor-completions/_docent"
  check_with fish fish -n "$share/fish/vendor_completions.d/docent.fish"
  command -v man >/dev/null || { say "skipped: man is not installed"; return 0; }
  for page in "$share"/man/man1/*.gz; do
    warnings=$(man --warnings -E UTF-8 -l -Tutf8 -Z "$page" </dev/null 2>&1 >/dev/null)
    [[ -z $warnings ]] || fail "$(basename "$page"): $warnings"
  done
}

# The words that bash offers after a command line.
check_completion() {
  local offered
  offered=$(bash -c 'source "$1"; shift; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _docent; echo "${COMPREPLY[*]}"' \
    bash "$work/contents/usr/share/bash-completion/completions/docent" "$@")
  printf '%s' "$offered"
}

check_completions() {
  [[ $(check_completion docent maps re) == "rename remove recover" ]] || fail "the completion misses subcommands of maps"
  [[ $(check_completion docent tour --pace e) == eager ]] || fail "the completion misses the values of --pace"
  [[ $(check_completion docent author --autos) == --autosave ]] || fail "the completion misses an option of author"
  [[ -z $(check_completion docent tour --library "") ]] || fail "the completion offers words where a file is expected"
}

inside() { unshare --mount --pid --fork --mount-proc="$root/proc" chroot "$root" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin \
  HOME=/root LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive "$@"; }

# Paths below the folders that packages share, without what apt and caches write.
installed_files() {
  (cd "$root" && find usr etc var/lib -path var/lib/apt -prune -o -path var/lib/dpkg -prune -o -print | sort)
}

check_bare_debian() {
  ((EUID == 0)) || { say "skipped: only root can install into a bare Debian"; return 0; }
  command -v debootstrap >/dev/null || { say "skipped: debootstrap is not installed"; return 0; }
  root=$work/debian
  say "a bare Debian 12 from $mirror"
  if ! debootstrap --variant=minbase bookworm "$root" "$mirror" >"$work/debootstrap.log" 2>&1; then
    grep -q 'Failed getting release file\|Unable to' "$work/debootstrap.log" || { tail "$work/debootstrap.log" >&2; fail "debootstrap failed"; }
    say "skipped: the mirror $mirror cannot be reached"
    return 0
  fi
  cp /etc/resolv.conf "$root/etc/resolv.conf"
  cp "$deb" "$root/tmp/docent.deb"
  say "installing"
  inside apt-get update -qq
  inside apt-get install -y -qq --no-install-recommends bash-completion man-db /tmp/docent.deb >"$work/install.log" 2>&1 ||
    { tail -20 "$work/install.log" >&2; fail "the package cannot be installed"; }
  run_in_bare_debian
  say "removing"
  inside apt-get purge -y -qq docent >"$work/purge.log" 2>&1 || fail "the package cannot be removed"
  local path
  while read -r path; do
    [[ -d $root$path && ! -L $root$path ]] || [[ ! -e $root$path ]] || fail "the package leaves $path"
  done <"$work/files.txt"
  if installed_files | grep -i docent; then fail "the package leaves the files above"; fi
}

run_in_bare_debian() {
  say "running"
  inside dpkg -L docent | sort >"$work/files.txt"
  [[ "$(inside docent --version)" == "docent $(dpkg-deb -f "$deb" Version)" ]] || fail "docent has another version than its package"
  inside man -w docent docent-maps-list >/dev/null || fail "man does not find the pages"
  inside bash -ic 'source /usr/share/bash-completion/bash_completion; _completion_loader docent; complete -p docent' \
    >"$work/completion.log" 2>&1 || true
  grep -q -- '-F _docent docent' "$work/completion.log" || fail "bash does not load the completion: $(cat "$work/completion.log")"
  echo '0 map new "Room"' >"$root/tmp/author.txt"
  inside docent author --library /tmp/room.docent --camera sim:room,duration=3 --headless --script /tmp/author.txt --output /tmp/author
  inside docent maps verify --library /tmp/room.docent
  inside env LIBGL_ALWAYS_SOFTWARE=1 docent tour --library /tmp/room.docent --camera sim:room,duration=1 --headless \
    --record /tmp/tour.mp4
  [[ -s $root/tmp/tour.mp4 ]] || fail "the tour recorded no video"
  run_on_old_processors
}

run_on_old_processors() {
  [[ -x $root/usr/libexec/docent/x86-64/docent ]] || return 0
  inside env DOCENT_PROCESSOR=x86-64 docent tour --library /tmp/room.docent --camera sim:room,duration=1 --headless --output /tmp/old
  grep -q ',sixdof,Room,' "$root/tmp/old/frames.csv" || fail "the build for all processors does not recognize the map of the other"
  command -v qemu-x86_64-static >/dev/null || { say "skipped: qemu-x86_64-static, an old processor, is not installed"; return 0; }
  say "a processor without AVX"
  cp "$(command -v qemu-x86_64-static)" "$root/tmp/qemu"
  local emulated=(inside /tmp/qemu -cpu Nehalem /usr/libexec/docent/x86-64/docent)
  "${emulated[@]}" author --library /tmp/old.docent --camera sim:room,duration=2,fps=10 --headless --script /tmp/author.txt --output /tmp/emulated
  "${emulated[@]}" maps verify --library /tmp/old.docent
  grep -q ',sixdof,Room,' "$root/tmp/emulated/frames.csv" || fail "no map has depth on a processor without AVX"
}

check_reproducible
check_contents
check_programs
check_completions
check_bare_debian
say "all good: $(basename "$deb"), $(stat -c %s "$deb") bytes, $(dpkg-deb -c "$deb" | grep -vc '/$') files"
