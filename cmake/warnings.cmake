# liealign_warnings(target): the warnings of the house; errors with LIEALIGN_WERROR.
# Imported targets (Eigen, pybind11, GoogleTest) are SYSTEM includes, so their headers stay silent.
# SPDX-License-Identifier: Apache-2.0
include_guard(GLOBAL)

function(liealign_warnings target)
  if(CMAKE_CXX_COMPILER_ID MATCHES "GNU|Clang")
    target_compile_options(${target} PRIVATE -Wall -Wextra -Wconversion -Wshadow -Wpedantic)
    if(NOT OpenMP_CXX_FOUND)
      target_compile_options(${target} PRIVATE -Wno-unknown-pragmas)
    endif()
    if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
      # GCC 12 sees an overlapping memcpy in "text" + std::string at -O3 (its bug 105651); there is none.
      target_compile_options(${target} PRIVATE -Wno-restrict)
      if(LIEALIGN_NATIVE)
        # With AVX-512 it sees Eigen load eight numbers from a vector of three, in a branch that is never taken, and its own
        # _mm512_undefined_pd() undefined.
        target_compile_options(${target} PRIVATE -Wno-array-bounds -Wno-maybe-uninitialized -Wno-uninitialized)
      endif()
    endif()
    if(LIEALIGN_WERROR)
      target_compile_options(${target} PRIVATE -Werror)
    endif()
  endif()
endfunction()
