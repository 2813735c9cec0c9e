# liealign_inlining(target): an expression of Eigen's is many small functions, and the filter is many expressions. GCC stops
# inlining them long before the end, and then numbers go through memory from call to call: up to twice as slow.
# The bits do not depend on it.
# SPDX-License-Identifier: Apache-2.0
include_guard(GLOBAL)

function(liealign_inlining target)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    target_compile_options(${target} PRIVATE "SHELL:--param large-function-growth=1000"
      "SHELL:--param large-stack-frame-growth=10000" "SHELL:--param inline-unit-growth=500"
      "SHELL:--param max-inline-insns-auto=300" "SHELL:--param max-inline-insns-single=1000")
  endif()
endfunction()
