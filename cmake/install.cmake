# Installs liealign::core, its headers, the executable when it is built, and what find_package(liealign) needs.
# SPDX-License-Identifier: Apache-2.0
include_guard(GLOBAL)
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)

set(LIEALIGN_CMAKE_DIR "${CMAKE_INSTALL_LIBDIR}/cmake/liealign")

install(TARGETS liealign_core EXPORT liealignTargets ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}"
        INCLUDES DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}")
install(DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}/cpp/include/liealign" DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}"
        FILES_MATCHING PATTERN "*.hpp")
if(TARGET liealign-post)
  install(TARGETS liealign-post RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}")
endif()

install(EXPORT liealignTargets NAMESPACE liealign:: DESTINATION "${LIEALIGN_CMAKE_DIR}")
configure_package_config_file("${CMAKE_CURRENT_LIST_DIR}/liealignConfig.cmake.in" liealignConfig.cmake
                              INSTALL_DESTINATION "${LIEALIGN_CMAKE_DIR}")
write_basic_package_version_file(liealignConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES "${CMAKE_CURRENT_BINARY_DIR}/liealignConfig.cmake"
              "${CMAKE_CURRENT_BINARY_DIR}/liealignConfigVersion.cmake"
        DESTINATION "${LIEALIGN_CMAKE_DIR}")
