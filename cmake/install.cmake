# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
#
# The installed copy: headers, library, the CMake package `sheaf` and the pkg-config file.
include(CMakePackageConfigHelpers)

install(TARGETS sheaf EXPORT sheafTargets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
  LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}
  RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(FILES ${SHEAF_PUBLIC_HEADERS} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/sheaf)
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})

set(SHEAF_PACKAGE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/sheaf)
install(EXPORT sheafTargets NAMESPACE sheaf:: DESTINATION ${SHEAF_PACKAGE_DIR})
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/sheafConfig.cmake.in
  ${PROJECT_BINARY_DIR}/sheafConfig.cmake INSTALL_DESTINATION ${SHEAF_PACKAGE_DIR})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/sheafConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/sheafConfig.cmake
              ${PROJECT_BINARY_DIR}/sheafConfigVersion.cmake DESTINATION ${SHEAF_PACKAGE_DIR})

list(TRANSFORM GEOGRAPHICLIB_LIBRARIES PREPEND -l OUTPUT_VARIABLE SHEAF_GEOGRAPHICLIB)
list(JOIN SHEAF_GEOGRAPHICLIB " " SHEAF_GEOGRAPHICLIB)
# A static library hands its own dependencies on to whoever links it; a shared one keeps them.
set(SHEAF_PC_DEPENDENCIES "-lhwy -ltbb ${SHEAF_GEOGRAPHICLIB} -lexif -lutf8proc -lmetis -lsqlite3 -lpng -ljpeg -lz -lbz2 -pthread")
if(BUILD_SHARED_LIBS)
  set(SHEAF_PC_LIBS "")
else()
  set(SHEAF_PC_LIBS " ${SHEAF_PC_DEPENDENCIES}")
endif()
file(RELATIVE_PATH SHEAF_PC_PREFIX
  ${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig ${CMAKE_INSTALL_PREFIX})
configure_file(${CMAKE_CURRENT_LIST_DIR}/sheaf.pc.in ${PROJECT_BINARY_DIR}/sheaf.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/sheaf.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
