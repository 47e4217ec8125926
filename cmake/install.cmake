# SPDX-License-Identifier: Apache-2.0
# What `cmake --install` puts into a prefix: the library with its headers, CMake package and
# pkg-config file; the readers that it starts; the program.
include(CMakePackageConfigHelpers)

install(
  TARGETS raywave_shared
  EXPORT raywaveTargets
  LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(
  TARGETS raywave
  RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
# Beside the library; the program looks in ../libexec/raywave, too (host/scene/reader_process.hpp).
install(
  TARGETS ${RAYWAVE_READERS}
  RUNTIME DESTINATION ${CMAKE_INSTALL_LIBEXECDIR}/raywave)
install(
  DIRECTORY host/include/raywave ${PROJECT_BINARY_DIR}/include/raywave
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
  FILES_MATCHING
  PATTERN "*.h"
  PATTERN "*.hpp")
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})

set(RAYWAVE_PACKAGE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/raywave)
install(
  EXPORT raywaveTargets
  NAMESPACE raywave::
  FILE raywaveTargets.cmake
  DESTINATION ${RAYWAVE_PACKAGE_DIR})
configure_package_config_file(cmake/raywaveConfig.cmake.in raywaveConfig.cmake
                              INSTALL_DESTINATION ${RAYWAVE_PACKAGE_DIR})
write_basic_package_version_file(raywaveConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/raywaveConfig.cmake
              ${PROJECT_BINARY_DIR}/raywaveConfigVersion.cmake
        DESTINATION ${RAYWAVE_PACKAGE_DIR})

file(RELATIVE_PATH RAYWAVE_INCLUDE_FROM_PC ${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig
     ${CMAKE_INSTALL_FULL_INCLUDEDIR})
configure_file(cmake/raywave.pc.in raywave.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/raywave.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
