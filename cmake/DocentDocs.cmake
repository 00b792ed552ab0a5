# SPDX-License-Identifier: Apache-2.0
# The target `docs`: pages about the public headers and from docs/*.md, in docs/html of the build folder. It fails when
# a part of the public interface is not described.
find_package(Doxygen QUIET)
if(NOT DOXYGEN_FOUND)
  return()
endif()

# The headers that a program includes, and those that they consist of.
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${DOCENT_PUBLIC_HEADERS})
set(DOCENT_DOCS_INPUT "")
foreach(header IN LISTS DOCENT_PUBLIC_HEADERS)
  list(APPEND DOCENT_DOCS_INPUT "${PROJECT_SOURCE_DIR}/${header}")
  file(STRINGS "${PROJECT_SOURCE_DIR}/${header}" includes REGEX "#include \"(engine|maps|content|ui|app)/")
  foreach(include IN LISTS includes)
    string(REGEX REPLACE ".*\"(.+)\".*" "${PROJECT_SOURCE_DIR}/\\1" included "${include}")
    list(APPEND DOCENT_DOCS_INPUT "${included}")
  endforeach()
endforeach()
file(GLOB pages CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/docs/*.md" "${PROJECT_SOURCE_DIR}/docs/decisions/*.md")
list(APPEND DOCENT_DOCS_INPUT "${PROJECT_BINARY_DIR}/include/docent/version.h" ${pages} "${PROJECT_SOURCE_DIR}/maps/README.md")
list(REMOVE_DUPLICATES DOCENT_DOCS_INPUT)
set(inputs ${DOCENT_DOCS_INPUT})
list(TRANSFORM DOCENT_DOCS_INPUT REPLACE "(.+)" "\"\\1\"")
list(JOIN DOCENT_DOCS_INPUT " " DOCENT_DOCS_INPUT)
find_package(Python3 REQUIRED COMPONENTS Interpreter)
configure_file("${PROJECT_SOURCE_DIR}/docs/Doxyfile.in" "${PROJECT_BINARY_DIR}/docs/Doxyfile" @ONLY)
add_custom_target(docs COMMAND Doxygen::doxygen "${PROJECT_BINARY_DIR}/docs/Doxyfile"
  DEPENDS ${inputs} "${PROJECT_SOURCE_DIR}/docs/doxygen_filter.py"
  COMMENT "Pages about the public headers: ${PROJECT_BINARY_DIR}/docs/html/index.html" VERBATIM)
