# Finds Eigen: the system's, or, when Python builds the wheel and there is none, that of the PyPI package cmeel-eigen.
# SPDX-License-Identifier: Apache-2.0
include_guard(GLOBAL)

# Who asks for no system paths (to test the second way) means those that CMake derives from PATH too: /usr/bin gives /usr.
set(LIEALIGN_EIGEN_SEARCH "")
if(DEFINED CMAKE_FIND_USE_CMAKE_SYSTEM_PATH AND NOT CMAKE_FIND_USE_CMAKE_SYSTEM_PATH)
  set(LIEALIGN_EIGEN_SEARCH NO_SYSTEM_ENVIRONMENT_PATH)
endif()
find_package(Eigen3 CONFIG QUIET ${LIEALIGN_EIGEN_SEARCH})

# cmeel-eigen keeps its CMake files in a prefix of its own, which an isolated build does not search.
if(NOT Eigen3_FOUND AND Python_EXECUTABLE)
  execute_process(
    COMMAND "${Python_EXECUTABLE}" -m cmeel cmake
    OUTPUT_VARIABLE LIEALIGN_CMEEL_PREFIX
    OUTPUT_STRIP_TRAILING_WHITESPACE
    ERROR_QUIET
    RESULT_VARIABLE LIEALIGN_CMEEL_RESULT)
  if(LIEALIGN_CMEEL_RESULT EQUAL 0)
    list(APPEND CMAKE_PREFIX_PATH "${LIEALIGN_CMEEL_PREFIX}")
    find_package(Eigen3 CONFIG QUIET ${LIEALIGN_EIGEN_SEARCH})
  endif()
endif()

if(NOT Eigen3_FOUND)
  message(FATAL_ERROR "liealign needs Eigen 3.4 or newer: install libeigen3-dev, or set Eigen3_DIR or CMAKE_PREFIX_PATH")
endif()
# Not asked of find_package: Eigen 5 calls itself incompatible with a request for 3.4.
if(Eigen3_VERSION VERSION_LESS 3.4)
  message(FATAL_ERROR "liealign needs Eigen 3.4 or newer; found ${Eigen3_VERSION} in ${Eigen3_DIR}")
endif()
message(STATUS "liealign: Eigen ${Eigen3_VERSION} from ${Eigen3_DIR}")
