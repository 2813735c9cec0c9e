# liealign_cool(target): a release is compiled with -O2, for most of it reads, checks and writes.
# liealign_hot(target): where the time of a run goes, -O3. An expression of Eigen's is many small functions, and the filter is
# many expressions. GCC stops inlining them long before the end, and then numbers go through memory from call to call: up to
# twice as slow. The bits depend on none of this.
# SPDX-License-Identifier: Apache-2.0
include_guard(GLOBAL)

set(LIEALIGN_HOT_OPTIONS "")
if(CMAKE_CXX_COMPILER_ID MATCHES "GNU|Clang")
  list(APPEND LIEALIGN_HOT_OPTIONS "$<$<CONFIG:Release>:-O3>")
endif()
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  foreach(limit IN ITEMS large-function-growth=1000 large-stack-frame-growth=10000 inline-unit-growth=500
          max-inline-insns-auto=300 max-inline-insns-single=1000)
    list(APPEND LIEALIGN_HOT_OPTIONS --param=${limit})
  endforeach()
endif()

function(liealign_cool target)
  if(CMAKE_CXX_COMPILER_ID MATCHES "GNU|Clang")
    target_compile_options(${target} PRIVATE "$<$<CONFIG:Release>:-O2>")
  endif()
endfunction()

function(liealign_hot target)
  target_compile_options(${target} PRIVATE ${LIEALIGN_HOT_OPTIONS})
endfunction()
