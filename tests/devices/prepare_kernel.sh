#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Fetches Debian's kernel, busybox and the source of v4l2loopback, unpacks them without installing them, and builds
# the v4l2loopback module: prepare_kernel.sh FOLDER
# Leaves FOLDER/{vmlinuz,busybox,modules/,version}. A second run does nothing. Needs the network only the first time.
# With --ready after the folder, it only reports by its exit status whether everything is there.
set -euo pipefail
readonly folder=$1
# vivid provides cameras, vhci-hcd is the controller for an emulated USB camera, and uvcvideo is its driver.
readonly drivers="vivid vhci-hcd uvcvideo"
[[ -e "$folder/version" && "$(sed -n 2p "$folder/version")" == "$drivers" ]] && exit 0
[[ "${2:-}" == --ready ]] && exit 1

say() { printf 'prepare_kernel: %s\n' "$*"; }
readonly image=$(apt-cache depends linux-image-amd64 | awk '/Depends: linux-image-[0-9].*-amd64$/ {print $2; exit}')
[[ -n "$image" ]] || { say "apt has no package linux-image-amd64; run apt-get update" >&2; exit 1; }
readonly release=${image#linux-image-}
readonly headers=/usr/src/linux-headers-$release
[[ -d "$headers" ]] || { say "the headers of $release are missing; install linux-headers-$release" >&2; exit 1; }

mkdir -p "$folder"
readonly work=$(mktemp -d "$folder/prepare.XXXXXX")
trap 'rm -rf "$work"' EXIT
say "fetching $image"
(cd "$work" && apt-get download -qq "$image" busybox-static v4l2loopback-dkms 2>&1 | { grep -v 'unsandboxed' || true; })
for package in "$work"/*.deb; do dpkg-deb --extract "$package" "$work/root"; done
source_folder=$(echo "$work"/root/usr/src/v4l2loopback-*)
make -s -C "$headers" M="$(realpath "$source_folder")" modules >"$work/make.log" 2>&1 ||
  { cat "$work/make.log" >&2; say "the v4l2loopback module does not build" >&2; exit 1; }

# The drivers and their dependencies, numbered in the order in which they are loaded.
depmod -b "$work/root" "$release"
rm -rf "$folder/modules"
mkdir -p "$folder/modules"
number=10
# shellcheck disable=SC2086  # $drivers must be split into words
modprobe --dirname "$work/root" --set-version "$release" --show-depends --all $drivers |
  awk '$1 == "insmod" && !seen[$2]++ {print $2}' |
  while read -r module; do
    cp "$module" "$folder/modules/$number-$(basename "$module")"
    number=$((number + 1))
  done
cp "$source_folder/v4l2loopback.ko" "$folder/modules/90-v4l2loopback.ko"
cp "$work/root/boot/vmlinuz-$release" "$folder/vmlinuz"
busybox=$work/root/bin/busybox
[[ -e "$busybox" ]] || busybox=$work/root/usr/bin/busybox
cp "$busybox" "$folder/busybox"
printf '%s\n%s\n' "$release" "$drivers" >"$folder/version"
say "ready: $release in $folder"
