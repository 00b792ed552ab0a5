# SPDX-License-Identifier: Apache-2.0
# What a user of the program gets besides the program: man pages, shell completion, desktop entry; and the Debian package
# (./bootstrap package). It brings two builds of the program on x86-64: the one of this build folder, and with
# DOCENT_GENERIC_PROGRAM one for processors without AVX2; app/launcher.cpp chooses. The package holds the component `program` only; a plain
# cmake --install installs `development`, the libraries and headers, too. tests/tools/check_package.sh checks the package.
find_package(Python3 REQUIRED COMPONENTS Interpreter)
set(packaging "${PROJECT_SOURCE_DIR}/packaging")

set(manual "${PROJECT_BINARY_DIR}/manual")
add_custom_command(OUTPUT "${manual}/done"
  COMMAND ${CMAKE_COMMAND} -E rm -rf "${manual}"
  COMMAND ${Python3_EXECUTABLE} "${packaging}/make_manual.py" $<TARGET_FILE:docent> "${manual}"
  COMMAND ${CMAKE_COMMAND} -E touch "${manual}/done"
  DEPENDS docent "${packaging}/make_manual.py" COMMENT "Man pages and completion from docent --help" VERBATIM)
add_custom_command(OUTPUT "${PROJECT_BINARY_DIR}/changelog.gz"
  COMMAND ${Python3_EXECUTABLE} "${packaging}/compress.py" "${packaging}/changelog" "${PROJECT_BINARY_DIR}/changelog.gz"
  DEPENDS "${packaging}/changelog" "${packaging}/compress.py" VERBATIM)
add_custom_target(manual ALL DEPENDS "${manual}/done" "${PROJECT_BINARY_DIR}/changelog.gz")

install(DIRECTORY "${manual}/man1" DESTINATION "${CMAKE_INSTALL_MANDIR}" COMPONENT program)
install(FILES "${manual}/bash/docent" DESTINATION "${CMAKE_INSTALL_DATADIR}/bash-completion/completions" COMPONENT program)
install(FILES "${manual}/zsh/_docent" DESTINATION "${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions" COMPONENT program)
install(FILES "${manual}/fish/docent.fish" DESTINATION "${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d" COMPONENT program)
install(FILES "${packaging}/io.github.docent_guide.docent.desktop" DESTINATION "${CMAKE_INSTALL_DATADIR}/applications"
  COMPONENT program)
install(FILES "${packaging}/io.github.docent_guide.docent.metainfo.xml" DESTINATION "${CMAKE_INSTALL_DATADIR}/metainfo"
  COMPONENT program)
install(FILES "${packaging}/docent.svg" DESTINATION "${CMAKE_INSTALL_DATADIR}/icons/hicolor/scalable/apps" COMPONENT program)
install(FILES "${packaging}/copyright" "${packaging}/README.Debian" "${PROJECT_BINARY_DIR}/changelog.gz"
  DESTINATION "${CMAKE_INSTALL_DOCDIR}" COMPONENT program)
install(FILES "${packaging}/camera.yaml" DESTINATION "${CMAKE_INSTALL_DOCDIR}/examples" COMPONENT program)

set(CPACK_GENERATOR DEB)
set(CPACK_PROJECT_CONFIG_FILE "${packaging}/cpack_options.cmake")  # the time of all files
# The project has no address of its own; whoever distributes the package is its maintainer.
set(DOCENT_PACKAGE_CONTACT "Docent maintainers <maintainers@docent.invalid>" CACHE STRING "Maintainer of the Debian package")
set(CPACK_PACKAGE_CONTACT "${DOCENT_PACKAGE_CONTACT}")
set(CPACK_PACKAGING_INSTALL_PREFIX "/usr")
set(CPACK_COMPONENTS_ALL program)
set(CPACK_COMPONENTS_GROUPING ALL_COMPONENTS_IN_ONE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE
  WORLD_READ WORLD_EXECUTE)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_NAME docent)
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
# Beside the linked libraries: OpenGL is loaded at run time, and texts are drawn with an installed font.
set(CPACK_DEBIAN_PACKAGE_DEPENDS "libegl1, libgl1, libgl1-mesa-dri, fonts-dejavu-core | fonts-freefont-ttf")
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "zenity, v4l-utils")
# The synopsis, and the paragraphs below it.
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "augmented-reality guide that builds and recognizes maps of a museum")
string(CONCAT CPACK_PACKAGE_DESCRIPTION
  "A curator walks through a museum with a camera, builds small maps of the\n"
  "exhibits live, and places models and signposts in them. A visitor later walks\n"
  "through the same rooms: Docent recognizes which map the camera is in and\n"
  "draws the content over the live video.")
if(DOCENT_MARCH AND NOT DOCENT_GENERIC_PROGRAM AND CMAKE_SYSTEM_PROCESSOR STREQUAL "x86_64")
  string(APPEND CPACK_PACKAGE_DESCRIPTION "\n\nIt needs a processor of the level ${DOCENT_MARCH}.")
endif()
include(CPack)
