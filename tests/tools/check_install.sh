#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs a build into a temporary folder, as a user would, builds docs/examples against it outside this tree, and
# checks what they print and draw on a simulated recording: check_install.sh BUILD_FOLDER [KEEP_FOLDER]
# With KEEP_FOLDER (new or empty), everything is written there and kept.
set -euo pipefail

(($# == 1 || $# == 2)) || { echo "Usage: check_install.sh BUILD_FOLDER [KEEP_FOLDER]" >&2; exit 2; }
readonly build=$(realpath "$1")
readonly tools=$(dirname "$(realpath "${BASH_SOURCE[0]}")")
readonly source=$(realpath "$tools/../..")
if (($# == 2)); then
  work=$(realpath -m "$2")
  mkdir -p "$work"
  [[ -z $(ls -A "$work") ]] || { echo "check_install: $work is not empty" >&2; exit 2; }
else
  work=$(mktemp -d)
  trap 'rm -rf "$work"' EXIT
fi
readonly work prefix=$work/prefix
readonly package=$prefix/lib/cmake/Docent
readonly strict="-Wall -Wextra -Werror"

say() { printf 'check_install: %s\n' "$*"; }
fail() { printf 'check_install: %s\n' "$*" >&2; exit 1; }
check_output() { python3 "$tools/check_install/check_output.py" "$@"; }

# configure FOLDER BUILD [cmake arguments]: with the installed package only.
configure() {
  cmake -G Ninja -S "$1" -B "$2" -DCMAKE_PREFIX_PATH="$prefix" -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_FLAGS="$strict" \
    -DCMAKE_EXPORT_COMPILE_COMMANDS=ON "${@:3}" >"$2.log" 2>&1
}

say "installing"
cmake --install "$build" --prefix "$prefix" >"$work/install.log"
version=$(sed -n 's/.*kVersion = "\(.*\)";/\1/p' "$prefix/include/docent/version.h")
[[ "$("$prefix/bin/docent" --version)" == "docent $version" ]] || fail "the program and version.h differ in their version"
[[ -f $prefix/share/doc/docent/docs/guide.md ]] || fail "the documents are not installed"
if grep -nE -- '-W[a-z]|-march|-ffp|-fpch|-fno-tree' "$package"/Docent-*.cmake; then
  fail "the package exports compiler options (see above)"
fi
if grep -rnF -e "$source" -e "$build" "$prefix/include" "$prefix/lib/cmake"; then
  fail "the package refers to the source or build folder (see above)"
fi

say "each public header alone"
readonly definitions=(-DEIGEN_MAX_ALIGN_BYTES=32 -DEIGEN_MAX_STATIC_ALIGN_BYTES=32 -DEIGEN_MALLOC_ALREADY_ALIGNED=0)
readonly includes=(-I"$prefix/include" $(pkg-config --cflags eigen3 opencv4 | sed 's/-I/-isystem /g'))
# shellcheck disable=SC2086
parse() { c++ -std=c++20 -fsyntax-only -x c++ $strict "${includes[@]}" "$@"; }
for header in "$prefix"/include/docent/*.h; do
  echo "#include <docent/$(basename "$header")>" | parse "${definitions[@]}" - || fail "$header does not compile alone"
done
if echo '#include <docent/geometry.h>' | parse -DEIGEN_MAX_STATIC_ALIGN_BYTES=16 - 2>/dev/null; then
  fail "a program with another layout of Eigen's types is not refused"
fi

say "the package"
find_docent() {  # find_docent NAME 'arguments of find_package' [commands]
  mkdir -p "$work/$1"
  printf '%s\n' 'cmake_minimum_required(VERSION 3.25)' 'project(finds LANGUAGES CXX)' "find_package(Docent $2 REQUIRED)" \
    "${@:3}" >"$work/$1/CMakeLists.txt"
  configure "$work/$1" "$work/$1/build"
}
find_docent finds_content "0.1 COMPONENTS content" \
  'if(NOT TARGET Docent::content OR TARGET Docent::engine OR OpenCV_FOUND OR SQLite3_FOUND)' \
  '  message(FATAL_ERROR "more or less than the component was found")' 'endif()' || fail "COMPONENTS content is not found alone"
if find_docent finds_newer "0.2"; then fail "the package claims to be version 0.2"; fi
if find_docent finds_unknown "0.1 COMPONENTS sound"; then fail "an unknown component is found"; fi

say "the layout of types with other machine flags"
layout() {  # layout NAME FLAGS
  configure "$tools/check_install" "$work/layout_$1" -DFLAGS="$2" || fail "layout cannot be configured: $work/layout_$1.log"
  cmake --build "$work/layout_$1" >>"$work/layout_$1.log" 2>&1 || { tail -30 "$work/layout_$1.log" >&2; fail "layout does not compile with '$2'"; }
  "$work/layout_$1/layout" >"$work/layout_$1.txt" || fail "layout fails with '$2'"
}
layout plain ""
if [[ $(uname -m) == x86_64 ]]; then
  layout v3 -march=x86-64-v3
  layout native -march=native
  for other in v3 native; do
    diff "$work/layout_plain.txt" "$work/layout_$other.txt" || fail "the layout depends on the machine flags (see above)"
  done
fi

say "building the examples"
cp -r "$source/docs/examples" "$work/examples"
for flags in plain same_rounding; do
  configure "$work/examples" "$work/examples_$flags" -DDOCENT_SAME_ROUNDING=$([[ $flags == plain ]] && echo OFF || echo ON) ||
    { tail -30 "$work/examples_$flags.log" >&2; fail "the examples cannot be configured"; }
done
cmake --build "$work/examples_plain" || fail "the examples do not compile"
cmake --build "$work/examples_same_rounding" --target track_video || fail "the examples do not compile with Docent's options"
if grep -E '"command".*( -march|-ffp-contract| -Wshadow| -Wpedantic)' "$work/examples_plain/compile_commands.json"; then
  fail "the examples are compiled with options of Docent's own (see above)"
fi

say "running the examples"
recording=$work/museum
"$prefix/bin/docent" --quiet simulate museum --output "$recording" --duration 6
cd "$work"
examples_plain/track_video "$recording" >track.txt
check_output poses track.txt "$recording" 120 0.005 0.3
examples_plain/build_and_relocalize "$recording" museum.docent >relocalized.txt
check_output poses relocalized.txt "$recording" 14 0.005 0.3
grep '^# relocalized' relocalized.txt
"$prefix/bin/docent" maps verify --library museum.docent >verify.log 2>&1 ||
  fail "the library of the example is damaged: $(cat verify.log)"
LIBGL_ALWAYS_SOFTWARE=1 examples_plain/draw_gltf "$recording" "$work/examples/box.gltf" drawn
check_output drawn drawn "$recording"

# With the options of Docent, the engine gives the program what it gives `docent`.
examples_same_rounding/track_video "$recording" >track_same.txt
"$prefix/bin/docent" --quiet evaluate "$recording" --output report --pace lockstep --seed 1
diff <(grep -v '^#' track_same.txt | sed 's/ -0\>/ 0/g') <(grep -v '^#' report/museum/trajectory.txt | sed 's/ -0\>/ 0/g') >differences.txt ||
  fail "the poses differ from those of docent evaluate: $(head -4 differences.txt)"
if examples_plain/track_video "$recording/no such folder" 2>error.txt; then fail "a missing recording is not reported"; fi
[[ $(wc -l <error.txt) == 1 ]] || fail "an error is more than one line: $(cat error.txt)"
say "all good"
