# SPDX-License-Identifier: Apache-2.0
# cmake --install and the package for find_package(Docent); docs/using-the-engine.md says how to use it.
include(CMakePackageConfigHelpers)

configure_file("${PROJECT_SOURCE_DIR}/cmake/version.h.in" "${PROJECT_BINARY_DIR}/include/docent/version.h" @ONLY)
# What a program includes. Whatever these headers include is installed with them.
file(GLOB DOCENT_PUBLIC_HEADERS CONFIGURE_DEPENDS RELATIVE "${PROJECT_SOURCE_DIR}" "${PROJECT_SOURCE_DIR}/*/public/docent/*.h")
if(DOCENT_SANITIZE)  # such libraries fit only programs with the same sanitizer
  return()
endif()

# What programs that use the libraries need; what follows from `program` on belongs to a package of the program.
set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME development)

# Component and target of the package; the library in the build is called docent_COMPONENT.
set(DOCENT_COMPONENTS geometry engine maps content ui cameras)

set(package_dir "${CMAKE_INSTALL_LIBDIR}/cmake/Docent")
foreach(component IN LISTS DOCENT_COMPONENTS)
  set(target docent_${component})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${component})
  target_compile_features(${target} INTERFACE $<INSTALL_INTERFACE:cxx_std_20>)
  install(TARGETS ${target} EXPORT Docent_${component} ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}"
    INCLUDES DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}")
  install(EXPORT Docent_${component} NAMESPACE Docent:: FILE Docent-${component}.cmake DESTINATION "${package_dir}")
endforeach()
target_compile_definitions(docent_geometry INTERFACE "$<INSTALL_INTERFACE:${DOCENT_EIGEN_LAYOUT}>")

# A program that is compiled with these options too has results that equal those of `docent` to the byte.
set(DOCENT_MACHINE_OPTIONS "-ffp-contract=off")
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  list(APPEND DOCENT_MACHINE_OPTIONS -fno-tree-slp-vectorize)
endif()
if(DOCENT_MARCH AND CMAKE_SYSTEM_PROCESSOR STREQUAL "x86_64")
  list(APPEND DOCENT_MACHINE_OPTIONS -march=${DOCENT_MARCH})
endif()

configure_package_config_file("${PROJECT_SOURCE_DIR}/cmake/DocentConfig.cmake.in" "${PROJECT_BINARY_DIR}/DocentConfig.cmake"
  INSTALL_DESTINATION "${package_dir}")
write_basic_package_version_file("${PROJECT_BINARY_DIR}/DocentConfigVersion.cmake" COMPATIBILITY SameMinorVersion)
install(FILES "${PROJECT_BINARY_DIR}/DocentConfig.cmake" "${PROJECT_BINARY_DIR}/DocentConfigVersion.cmake"
  DESTINATION "${package_dir}")

install(CODE "
  set(DOCENT_SOURCE_DIR \"${PROJECT_SOURCE_DIR}\")
  set(DOCENT_STAGE \"${PROJECT_BINARY_DIR}/install\")
  set(DOCENT_PUBLIC_HEADERS \"${DOCENT_PUBLIC_HEADERS}\")
  set(DOCENT_INCLUDE_DIR \"\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_INCLUDEDIR}\")")
install(SCRIPT "${PROJECT_SOURCE_DIR}/cmake/InstallHeaders.cmake")
install(FILES "${PROJECT_BINARY_DIR}/include/docent/version.h" DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/docent")

install(FILES LICENSE DESTINATION "${CMAKE_INSTALL_DOCDIR}")  # the package's `copyright` names the copy of Debian
set(DOCENT_GENERIC_PROGRAM "" CACHE FILEPATH "A build of docent for all x86-64 processors, to be installed beside this one")
if(DOCENT_GENERIC_PROGRAM)
  set(programs "${CMAKE_INSTALL_LIBEXECDIR}/docent")
  install(TARGETS docent_launcher RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}" COMPONENT program)
  install(TARGETS docent RUNTIME DESTINATION "${programs}/${DOCENT_MARCH}" COMPONENT program)
  install(PROGRAMS "${DOCENT_GENERIC_PROGRAM}" DESTINATION "${programs}/x86-64" COMPONENT program)
else()
  install(TARGETS docent RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}" COMPONENT program)
endif()
install(FILES README.md CHANGELOG.md SECURITY.md NOTICE DESTINATION "${CMAKE_INSTALL_DOCDIR}" COMPONENT program)
install(DIRECTORY docs/ DESTINATION "${CMAKE_INSTALL_DOCDIR}/docs" COMPONENT program PATTERN "Doxyfile.in" EXCLUDE
  PATTERN "doxygen_filter.py" EXCLUDE)
include(DocentPackage)
