# liealign_precompile(target more...): the headers that nearly every source reads, parsed once. None is ours, so that none changes.
# SPDX-License-Identifier: Apache-2.0
include_guard(GLOBAL)

function(liealign_precompile target)
  target_precompile_headers(${target} PRIVATE <Eigen/Cholesky> <Eigen/Core> <Eigen/Geometry> <algorithm> <array> <cmath>
    <cstddef> <cstdint> <functional> <limits> <map> <memory> <optional> <stdexcept> <string> <utility> <vector> ${ARGN})
  # A stamp in the file would make it another one after each build, and every source that reads it with it.
  if(CMAKE_CXX_COMPILER_ID MATCHES "Clang")
    target_compile_options(${target} PRIVATE "SHELL:-Xclang -fno-pch-timestamp")
  endif()
endfunction()
