#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Boots Debian's kernel in QEMU with its virtual video devices and runs a program in it:
#   run_in_qemu.sh PROGRAM FOLDER [ARGUMENT...]
# FOLDER is the output folder of prepare_kernel.sh. The arguments are the program's (without any, those of a test), and what
# it writes to /tmp/report.json is shown at the end. The program finds vivid's camera as /dev/video0 and v4l2loopback's
# as /dev/video9. The exit status is that of the program, or 77 (skipped) where QEMU or the kernel is missing. With
# CI=true that is a failure, so that the check is never skipped silently.
set -euo pipefail
readonly program=$(realpath "$1") folder=$2
shift 2
(($#)) || set -- --gtest_color=no
readonly arguments=$(printf '%q ' "$@")

skip() {
  printf 'run_in_qemu: %s\n' "$*" >&2
  [[ "${CI:-}" == true ]] && exit 1
  exit 77
}
command -v qemu-system-x86_64 >/dev/null || skip "skipped: qemu-system-x86 is not installed (./bootstrap installs it)"
command -v cpio >/dev/null || skip "skipped: cpio is not installed (./bootstrap installs it)"
[[ -e "$folder/version" ]] || skip "skipped: there is no kernel in $folder (./bootstrap test prepares it)"

readonly work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
readonly root=$work/root
mkdir -p "$root"/{bin,dev,proc,sys,tmp,app,modules}
cp "$folder/busybox" "$root/bin/busybox"
cp "$folder"/modules/*.ko "$root/modules/"
cp "$program" "$root/app/program"
ldd "$program" | grep -oE '/[^ ]+\.so[^ ]*' | while read -r library; do
  install -D --mode=755 "$(readlink -f "$library")" "$root$library"
done
printf '%s\n' "$arguments" >"$root/arguments"
cat >"$root/init" <<'INIT'
#!/bin/busybox sh
/bin/busybox --install -s /bin
export PATH=/bin
mount -t proc proc /proc; mount -t sysfs sysfs /sys; mount -t devtmpfs devtmpfs /dev
for module in /modules/*; do
  case $module in
    *vivid.ko) insmod $module n_devs=1 node_types=0x1 num_inputs=1 input_types=0x0 ;;
    # With two buffers, its default, it writes over the image that is being read as soon as the next but one is
    # written.
    *v4l2loopback.ko) insmod $module video_nr=9 exclusive_caps=1 card_label=loopback max_buffers=8 ;;
    *) insmod $module ;;
  esac
done
tries=0
while [ ! -e /dev/video9 ] || [ ! -e /dev/video0 ]; do
  sleep 0.1; tries=$((tries + 1)); [ $tries -gt 100 ] && break
done
cd /tmp
eval "/app/program $(cat /arguments)"
echo "EXIT-STATUS $?"
[ -e /tmp/report.json ] && cat /tmp/report.json
poweroff -f
INIT
chmod +x "$root/init"
(cd "$root" && find . | cpio --create --format=newc --quiet) >"$work/disk.cpio"

# Full emulation behaves the same with and without hardware support.
timeout 540 qemu-system-x86_64 -accel tcg -cpu max -smp 2 -m 3072 -nographic -no-reboot -nodefaults -serial stdio \
  -kernel "$folder/vmlinuz" -initrd "$work/disk.cpio" \
  -append "console=ttyS0 quiet panic=-1 mitigations=off nokaslr random.trust_cpu=on tsc=unstable" \
  </dev/null >"$work/console.log" 2>&1 || true
tr -d '\r\033' <"$work/console.log"
status=$(tr -d '\r' <"$work/console.log" | sed -n 's/^EXIT-STATUS //p' | tail -1)
exit "${status:-1}"
