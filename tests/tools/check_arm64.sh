#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Builds the tests of engine and maps for 64-bit ARM with Debian's cross compiler and runs them in QEMU's emulation:
#   check_arm64.sh FOLDER [GTEST_FILTER]
# FOLDER keeps Debian's arm64 libraries (2 GB) and the build. Needs g++-12-aarch64-linux-gnu, qemu-user-static, and the network
# the first time. Emulated tests take many times as long: the filter chooses some.
set -euo pipefail
(($# >= 1)) || { echo "Usage: check_arm64.sh FOLDER [GTEST_FILTER]" >&2; exit 2; }
readonly source=$(realpath "$(dirname "${BASH_SOURCE[0]}")/../..")
mkdir -p "$1"
readonly folder=$(realpath "$1") filter=${2:-*}
readonly root=$folder/root

say() { printf 'check_arm64: %4d s: %s\n' "$SECONDS" "$*"; }
fail() { printf 'check_arm64: %s\n' "$*" >&2; exit 1; }

for tool in aarch64-linux-gnu-g++-12 qemu-aarch64-static; do
  command -v "$tool" >/dev/null || fail "$tool is missing: apt install g++-12-aarch64-linux-gnu qemu-user-static"
done

# The packages of the list in bootstrap that libraries come from, with all they depend on, unpacked without their
# scripts, by an apt that knows nothing of this machine's own packages.
fetch_libraries() {
  local apt=$folder/apt names
  mkdir -p "$apt"/etc/apt/{apt.conf.d,preferences.d,trusted.gpg.d} "$apt"/var/lib/{dpkg,apt/lists/partial} \
    "$apt/var/cache/apt/archives/partial"
  : >"$apt/var/lib/dpkg/status"
  echo "deb [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] ${DOCENT_MIRROR:-http://deb.debian.org/debian} bookworm main" \
    >"$apt/etc/apt/sources.list"
  printf '%s\n' "Dir \"$apt\";" "Dir::State::status \"$apt/var/lib/dpkg/status\";" 'APT::Architecture "arm64";' \
    'APT::Architectures { "arm64"; };' 'APT::Sandbox::User "root";' >"$apt/apt.conf"
  names=$(sed -n '/^readonly packages=(/,/^)/p' "$source/bootstrap" | tr ' ' '\n' | grep -E -- '-dev$')
  # shellcheck disable=SC2086  # $names must be split into words
  APT_CONFIG=$apt/apt.conf apt-get update -qq
  # shellcheck disable=SC2086
  APT_CONFIG=$apt/apt.conf apt-get install -y -qq --no-install-recommends --download-only libc6-dev libstdc++-12-dev $names \
    >"$folder/apt.log"
  for package in "$apt"/var/cache/apt/archives/*.deb; do dpkg-deb --extract "$package" "$root"; done
}

# Links and CMake files with absolute paths lead out of the folder; and the packages' scripts would have chosen BLAS and
# LAPACK among several.
mend_paths() {
  local link target
  find "$root" -type l -lname '/*' | while read -r link; do
    target=$(readlink "$link")
    ln -snf "$(realpath -m --relative-to="$(dirname "$link")" "$root$target")" "$link"
  done
  find "$root/usr" -path '*/cmake/*' -name '*.cmake' -exec sed -i -E "s#([;\"])/usr/(lib|include)#\\1$root/usr/\\2#g" {} +
  for library in blas lapack; do
    for name in so so.3; do
      ln -snf "$library/lib$library.so.3" "$root/usr/lib/aarch64-linux-gnu/lib$library.$name"
    done
  done
}

if [[ ! -f "$folder/libraries-are-complete" ]]; then
  say "fetching Debian's libraries for arm64"
  fetch_libraries
  mend_paths
  touch "$folder/libraries-are-complete"
fi

cat >"$folder/toolchain.cmake" <<TOOLCHAIN
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_SYSROOT "$root")
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++-12)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc-12)
set(CMAKE_LIBRARY_ARCHITECTURE aarch64-linux-gnu)
set(CMAKE_CROSSCOMPILING_EMULATOR qemu-aarch64-static -L "$root")
set(CMAKE_FIND_ROOT_PATH "$root")
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
# Libraries of libraries are found as the loader would find them.
set(CMAKE_EXE_LINKER_FLAGS_INIT "-Wl,-rpath-link,$root/usr/lib/aarch64-linux-gnu:$root/lib/aarch64-linux-gnu:$root/usr/lib/aarch64-linux-gnu/blas:$root/usr/lib/aarch64-linux-gnu/lapack")
TOOLCHAIN

say "configuring"
export PKG_CONFIG_SYSROOT_DIR=$root PKG_CONFIG_LIBDIR=$root/usr/lib/aarch64-linux-gnu/pkgconfig:$root/usr/share/pkgconfig
cmake -G Ninja -S "$source" -B "$folder/build" -DCMAKE_TOOLCHAIN_FILE="$folder/toolchain.cmake" -DCMAKE_BUILD_TYPE=Release \
  -DCMAKE_CXX_FLAGS_RELEASE=-O3 -DDOCENT_UNITY=ON -DDOCENT_BENCH=OFF >"$folder/configure.log" 2>&1 ||
  { tail -30 "$folder/configure.log" >&2; fail "the build cannot be configured"; }
say "building"
cmake --build "$folder/build" --target docent_engine_tests docent_maps_tests >"$folder/build.log" 2>&1 ||
  { tail -30 "$folder/build.log" >&2; fail "it does not compile"; }
for program in engine/docent_engine_tests maps/docent_maps_tests; do
  say "running $program"
  qemu-aarch64-static -L "$root" "$folder/build/tests/$program" --gtest_filter="$filter" --gtest_brief=1
done
say "all good"
