# SPDX-License-Identifier: Apache-2.0
# Read by cpack before it packs: two packages of one build are the same bytes. As in every Debian package, all files get
# the time of the newest entry of the changelog, unless SOURCE_DATE_EPOCH gives another one.
if(NOT DEFINED ENV{SOURCE_DATE_EPOCH})
  file(STRINGS "${CMAKE_CURRENT_LIST_DIR}/changelog" signatures REGEX "^ -- ")
  list(GET signatures 0 signature)
  string(REGEX REPLACE "^.*>  " "" date "${signature}")
  execute_process(COMMAND date --date=${date} +%s OUTPUT_VARIABLE seconds OUTPUT_STRIP_TRAILING_WHITESPACE
    COMMAND_ERROR_IS_FATAL ANY)
  set(ENV{SOURCE_DATE_EPOCH} "${seconds}")
endif()
