# SPDX-License-Identifier: Apache-2.0
# One helper for every folder: sources are found by glob, headers sit beside them, and a target may link
# only what its row of the layer table allows (tests/tools/check_layers.py checks the includes).

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
# Shared libraries (Ceres, OpenCV) have copies of Eigen's templates for other alignments. Hidden, ours do not replace
# theirs at run time (tests/tools/check_symbols.py).
set(CMAKE_CXX_VISIBILITY_PRESET hidden)
set(CMAKE_VISIBILITY_INLINES_HIDDEN ON)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release)
endif()
find_program(CCACHE_PROGRAM ccache)
if(CCACHE_PROGRAM AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  # The hash leaves the working directory out, so that one build folder reuses what another compiled.
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_NOHASHDIR=1 ${CCACHE_PROGRAM})
  if(DOCENT_PRECOMPILE)
    # Precompiled headers are cached too, and paths are hashed relative to the source, so that one checkout reuses
    # what another compiled.
    set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_NOHASHDIR=1 CCACHE_BASEDIR=${PROJECT_SOURCE_DIR}
      CCACHE_SLOPPINESS=pch_defines,time_macros ${CCACHE_PROGRAM})
  endif()
endif()

add_library(docent_compile_options INTERFACE)
target_compile_options(docent_compile_options INTERFACE -Wall -Wextra -Wpedantic -Wshadow
  # GCC 12 at -O3 takes Eigen's guarded four-wide loads of three-vectors for reads past the end, and inserts at
  # the end of a std::vector for writes past it.
  -Wno-array-bounds $<$<CXX_COMPILER_ID:GNU>:-Wno-stringop-overflow>
  # The same GCC at -O3 fears overlapping copies in `"text" + string` (its bug 105651).
  $<$<AND:$<CXX_COMPILER_ID:GNU>,$<STREQUAL:${CMAKE_CXX_FLAGS_RELEASE},-O3>>:-Wno-restrict>
  $<$<AND:$<CXX_COMPILER_ID:GNU>,$<BOOL:${DOCENT_PRECOMPILE}>>:-fpch-preprocess>
  $<$<BOOL:${DOCENT_WERROR}>:-Werror>
  # Else it is the optimizer's choice which products are rounded before they are added, and a change of one line
  # changes the figures of another. It costs nothing that can be measured.
  -ffp-contract=off
  # GCC 12 does not keep to it where it gathers single statements into vectors: a difference beside a sum becomes
  # vfmaddsub. tests/tools/check_rounding.py looks for what else might.
  $<$<CXX_COMPILER_ID:GNU>:-fno-tree-slp-vectorize>
  # A vector of the machine's width changes Eigen's layout: every target must agree on it.
  $<$<AND:$<BOOL:${DOCENT_MARCH}>,$<STREQUAL:${CMAKE_SYSTEM_PROCESSOR},x86_64>>:-march=${DOCENT_MARCH}>)
if(DOCENT_SANITIZE)  # a plain if: the comma of "address,undefined" would end a generator expression
  target_compile_options(docent_compile_options INTERFACE -fsanitize=${DOCENT_SANITIZE} -fno-omit-frame-pointer)
  target_link_options(docent_compile_options INTERFACE -fsanitize=${DOCENT_SANITIZE})
  # Half of the time that clang needs for Eigen's templates. A null pointer that is used ends the program under ASan in
  # any case, ASan also knows the bounds of objects, and nothing here casts down without dynamic_cast.
  if(DOCENT_SANITIZE MATCHES "undefined")
    target_compile_options(docent_compile_options INTERFACE -fno-sanitize=null,object-size,vptr -fno-sanitize-recover=all)
  endif()
endif()
target_include_directories(docent_compile_options INTERFACE "${PROJECT_SOURCE_DIR}")
# Eigen aligns and allocates as the machine flags of the including file suggest, and headers of an installed Docent are
# included by programs with other flags than its own. These are the values that x86-64-v3 suggests; every other target
# machine, and every program that uses the package, is given them as definitions, so that all agree.
set(DOCENT_EIGEN_LAYOUT EIGEN_MAX_ALIGN_BYTES=32 EIGEN_MAX_STATIC_ALIGN_BYTES=32 EIGEN_MALLOC_ALREADY_ALIGNED=0)
if(NOT DOCENT_MARCH STREQUAL "x86-64-v3" OR NOT CMAKE_SYSTEM_PROCESSOR STREQUAL "x86_64")
  target_compile_definitions(docent_compile_options INTERFACE ${DOCENT_EIGEN_LAYOUT})
endif()

# The headers that nearly every file reads, parsed once a target. Off by default, so that a build without it
# shows a missing include; the presets switch it on.
function(docent_precompile name)
  if(DOCENT_PRECOMPILE)
    target_precompile_headers(${name} PRIVATE <algorithm> <functional> <map> <memory> <optional> <string> <vector>
      <Eigen/Core> <Eigen/Geometry> ${ARGN})
  endif()
endfunction()

# Sources of a target are compiled several at once, because parsing the libraries' headers takes most of the time.
# Off by default, so that a build without it shows a missing include.
function(docent_unity name)
  if(DOCENT_UNITY)
    set_target_properties(${name} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 8)
  endif()
endfunction()

# docent_add_library(NAME [FOLDERS folder...] PUBLIC libs... PRIVATE libs...)
function(docent_add_library name)
  cmake_parse_arguments(ARG "" "" "FOLDERS;EXCLUDE;PUBLIC;PRIVATE" ${ARGN})
  if(NOT ARG_FOLDERS)
    set(ARG_FOLDERS ".")
  endif()
  set(sources "")
  foreach(folder IN LISTS ARG_FOLDERS)
    file(GLOB_RECURSE found CONFIGURE_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/${folder}/*.cpp"
      "${CMAKE_CURRENT_SOURCE_DIR}/${folder}/*.h")
    list(APPEND sources ${found})
  endforeach()
  foreach(pattern IN LISTS ARG_EXCLUDE)
    list(FILTER sources EXCLUDE REGEX "${pattern}")
  endforeach()
  add_library(${name} STATIC ${sources})
  set_target_properties(${name} PROPERTIES LINKER_LANGUAGE CXX)
  target_link_libraries(${name} PUBLIC $<BUILD_INTERFACE:docent_compile_options> ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE})
  docent_precompile(${name})
  docent_unity(${name})
endfunction()

# docent_add_tests(NAME LIBS libs... [DEPENDS targets...] [SUITES suites...] [TIMEOUT seconds] [UNITY] [FAST]): every
# *_test.cpp below the folder, discovered by ctest, each test a process of its own. A suite that is named here is one
# process, and one entry for ctest: its tests look at the same run, which takes longer to make than to look at. A
# process that takes longer than the timeout, ten minutes if none is given, has failed. With UNITY, the sources may be
# compiled several at once, so that names in their anonymous namespaces must differ. The libraries under test are
# compiled with -O3, but most tests run for less time than -O3 takes to compile them: g++ 12 takes 36 s instead of 51 s
# for a part of the application's tests without it. With FAST, the tests have it too, because they compute much.
function(docent_add_tests name)
  cmake_parse_arguments(ARG "UNITY;FAST" "TIMEOUT" "LIBS;DEPENDS;SUITES" ${ARGN})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/*.cpp")
  if(NOT sources)
    return()
  endif()
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 600)
  endif()
  add_executable(${name} ${sources})
  target_link_libraries(${name} PRIVATE ${ARG_LIBS} GTest::gtest GTest::gmock GTest::gtest_main)
  target_compile_definitions(${name} PRIVATE DOCENT_SOURCE_DIR="${PROJECT_SOURCE_DIR}"
    DOCENT_BINARY_DIR="${PROJECT_BINARY_DIR}")
  if(NOT ARG_FAST)
    target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O1>)
  endif()
  docent_precompile(${name} <gtest/gtest.h> <gmock/gmock.h>)
  if(ARG_UNITY)
    docent_unity(${name})
  endif()
  if(ARG_DEPENDS)
    add_dependencies(${name} ${ARG_DEPENDS})
  endif()
  foreach(suite IN LISTS ARG_SUITES)
    add_test(NAME ${suite} COMMAND ${name} --gtest_filter=${suite}.*)
    # A suite that was renamed would pass by running nothing.
    set_tests_properties(${suite} PROPERTIES TIMEOUT ${ARG_TIMEOUT} FAIL_REGULAR_EXPRESSION "Running 0 tests")
  endforeach()
  list(TRANSFORM ARG_SUITES APPEND ".*")
  list(JOIN ARG_SUITES ":" whole)
  gtest_discover_tests(${name} TEST_FILTER "-${whole}" PROPERTIES TIMEOUT ${ARG_TIMEOUT} DISCOVERY_TIMEOUT 60)
endfunction()
