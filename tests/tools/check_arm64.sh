#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Builds the tests of engine and maps for 64-bit ARM with Debian's cross compiler and runs them in QEMU's emulation:
#   check_arm64.sh FOLDER [GTEST_FILTER]
# FOLDER keeps Debian's arm64 libraries (2 GB), the build, and in results/ what each suite printed. Needs
# g++-12-aarch64-linux-gnu, qemu-user-static, and the network the first time. Emulated tests take many times as long: the
# filter chooses some. Each suite is a process of its own, as many at once as CMAKE_BUILD_PARALLEL_LEVEL says or as there
# are cores. One that takes more than DOCENT_SUITE_SECONDS (3600) is ended, and has failed.
set -euo pipefail
(($# == 1 || $# == 2)) || { echo "Usage: check_arm64.sh FOLDER [GTEST_FILTER]" >&2; exit 2; }
source=$(realpath "$(dirname "${BASH_SOURCE[0]}")/../..")
mkdir -p "$1"
folder=$(realpath "$1")
readonly source folder chosen=${2:-*}
readonly root=$folder/root build=$folder/build results=$folder/results
readonly libraries=usr/lib/aarch64-linux-gnu
readonly jobs=${CMAKE_BUILD_PARALLEL_LEVEL:-$(nproc)} suite_seconds=${DOCENT_SUITE_SECONDS:-3600}

# Tests that start their own program again as a second process. QEMU leaves that call to the kernel, which cannot run a
# program for another processor unless the machine has been told to use QEMU for it.
readonly left_out=(
  'Crash.*'
  TwoProcesses.AVisitorSeesOnlyCompleteSavesWhileAnAuthorWrites
  TwoProcesses.TwoToursSeeOnlyCompleteSavesWhileAnAuthorWrites
  TwoProcesses.AFileLeftInLogModeIsReadWithoutCreatingFiles
  SmallDisk.ThatFillsUpIsReportedAndLosesNothing
)

say() { printf 'check_arm64: %4d s: %s\n' "$SECONDS" "$*"; }
fail() { printf 'check_arm64: %s\n' "$*" >&2; exit 1; }

for tool in aarch64-linux-gnu-g++-12 qemu-aarch64-static; do
  command -v "$tool" >/dev/null || fail "$tool is missing: apt install g++-12-aarch64-linux-gnu qemu-user-static"
done

# The packages of the list in bootstrap that libraries come from, with all they depend on, unpacked without their
# scripts, by an apt that knows nothing of this machine's own packages.
fetch_libraries() {
  local apt=$folder/apt names mirror=${DOCENT_MIRROR:-http://deb.debian.org/debian}
  mkdir -p "$apt"/etc/apt/{apt.conf.d,preferences.d,trusted.gpg.d} "$apt"/var/lib/{dpkg,apt/lists/partial} \
    "$apt/var/cache/apt/archives/partial"
  : >"$apt/var/lib/dpkg/status"
  echo "deb [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] $mirror bookworm main" >"$apt/etc/apt/sources.list"
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
      ln -snf "$library/lib$library.so.3" "$root/$libraries/lib$library.$name"
    done
  done
}

# Prints the tests that the filter chooses and emulation can run, one a line: PROGRAM SUITE. SUITE.TEST
choose_tests() {
  local program suite name pattern
  for program in engine/docent_engine_tests maps/docent_maps_tests; do
    suite=""
    qemu-aarch64-static -L "$root" "$build/tests/$program" --gtest_filter="$chosen" --gtest_list_tests >"$results/list" ||
      fail "$program cannot be run"
    while read -r name _; do  # a comment follows
      if [[ $name == *. ]]; then suite=$name; continue; fi
      for pattern in "${left_out[@]}"; do
        # shellcheck disable=SC2053  # a pattern
        [[ $suite$name != $pattern ]] || continue 2
      done
      echo "$program $suite $suite$name"
    done < <(sed 1d "$results/list")
  done
}

# run_suite PROGRAM SUITE TEST... appends the counts of passed, failed and skipped tests to the table.
run_suite() {
  local program=$1 suite=${2%.} log begin=$SECONDS passed skipped failed filter pid
  shift 2
  log=$results/${suite//\//_}.log
  filter=$(IFS=:; echo "$*")
  timeout "$suite_seconds" qemu-aarch64-static -L "$root" "$build/tests/$program" --gtest_filter="$filter" >"$log" 2>&1 &
  pid=$!
  trap 'kill "$pid"' TERM
  wait "$pid" || echo "The program ended with $?." >>"$log"
  passed=$(grep -c '^\[       OK \] .* ms)$' "$log") || true
  skipped=$(grep -c '^\[  SKIPPED \] .* ms)$' "$log") || true
  failed=$(($# - passed - skipped))  # and what a crash or the time limit left undone
  ((failed == 0)) || say "$failed of $# tests of $suite failed: $log"
  echo "$passed $failed $skipped $((SECONDS - begin)) $suite" >>"$results/table"
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
string(JOIN ":" folders "$root/$libraries" "$root/lib/aarch64-linux-gnu" "$root/$libraries/blas" "$root/$libraries/lapack")
set(CMAKE_EXE_LINKER_FLAGS_INIT "-Wl,-rpath-link,\${folders}")
TOOLCHAIN

say "configuring"
# A build belongs to one checkout.
grep -qsxF "CMAKE_HOME_DIRECTORY:INTERNAL=$source" "$build/CMakeCache.txt" || rm -rf "$build"
export PKG_CONFIG_SYSROOT_DIR=$root PKG_CONFIG_LIBDIR=$root/$libraries/pkgconfig:$root/usr/share/pkgconfig
cmake -G Ninja -S "$source" -B "$build" -DCMAKE_TOOLCHAIN_FILE="$folder/toolchain.cmake" -DCMAKE_BUILD_TYPE=Release \
  -DCMAKE_CXX_FLAGS_RELEASE=-O3 -DDOCENT_UNITY=ON -DDOCENT_BENCH=OFF >"$folder/configure.log" 2>&1 ||
  { tail -30 "$folder/configure.log" >&2; fail "the build cannot be configured"; }
say "building"
cmake --build "$build" --target docent_engine_tests docent_maps_tests >"$folder/build.log" 2>&1 ||
  { tail -30 "$folder/build.log" >&2; fail "it does not compile"; }

rm -rf "$results"
mkdir "$results"
choose_tests >"$results/tests"
[[ -s $results/tests ]] || fail "no test that emulation can run matches $chosen"
say "running $(wc -l <"$results/tests") tests"
trap 'jobs -p | xargs -r kill' EXIT  # of a check that is ended early
while read -r program suite; do
  mapfile -t tests < <(awk -v of="$program $suite" '$1 " " $2 == of { print $3 }' "$results/tests")
  (($(jobs -rp | wc -l) < jobs)) || wait -n
  run_suite "$program" "$suite" "${tests[@]}" </dev/null &
done < <(cut -d ' ' -f 1,2 "$results/tests" | uniq)
wait
read -r passed failed skipped < <(awk '{ for (i = 1; i <= 3; ++i) n[i] += $i } END { print n[1], n[2], n[3] }' "$results/table")
say "$passed tests passed, $failed failed, $skipped skipped themselves; left out in emulation: ${left_out[*]}"
((failed == 0)) || fail "tests failed; what they printed is in $results"
say "all good"
