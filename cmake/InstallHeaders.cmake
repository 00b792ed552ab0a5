# SPDX-License-Identifier: Apache-2.0
# Run by cmake --install: installs the public headers as docent/NAME.h, and the headers that they include, directly or
# not, as docent/FOLDER/..., with the includes changed to these names. So an installed Docent has one folder of its own
# and can meet no other header called engine/... or content/...
#
# DOCENT_SOURCE_DIR; DOCENT_PUBLIC_HEADERS: paths below it, FOLDER/public/docent/NAME.h; DOCENT_STAGE: a folder for the
# changed files; DOCENT_INCLUDE_DIR: where to install to.
cmake_policy(VERSION 3.25)
set(ours "(engine|maps|content|ui|app)/")
set(waiting ${DOCENT_PUBLIC_HEADERS})
set(known ${DOCENT_PUBLIC_HEADERS})
while(waiting)
  list(POP_FRONT waiting header)
  file(READ "${DOCENT_SOURCE_DIR}/${header}" text)
  string(REGEX MATCHALL "#include \"${ours}[^\"\n]+\"" includes "${text}")
  foreach(include IN LISTS includes)
    string(REGEX REPLACE "#include \"(.+)\"" "\\1" included "${include}")
    if(NOT included IN_LIST known)
      list(APPEND known "${included}")
      list(APPEND waiting "${included}")
    endif()
  endforeach()
  string(REGEX REPLACE "#include \"${ours}" "#include \"docent/\\1/" text "${text}")
  string(REGEX REPLACE "^[^/]+/public/docent/" "" name "${header}")
  set(staged "${DOCENT_STAGE}/docent/${name}")
  # An unchanged file keeps its time, so that programs are not compiled again.
  set(before "")
  if(EXISTS "${staged}")
    file(READ "${staged}" before)
  endif()
  if(NOT before STREQUAL text)
    file(WRITE "${staged}" "${text}")
  endif()
  get_filename_component(folder "${DOCENT_INCLUDE_DIR}/docent/${name}" DIRECTORY)
  file(INSTALL "${staged}" DESTINATION "${folder}")
endwhile()
