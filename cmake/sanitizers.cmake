# Builds everything with the sanitizers of LIEALIGN_SANITIZE and the checks that standard library and Eigen have at hand.
# SPDX-License-Identifier: Apache-2.0
include_guard(GLOBAL)

if(LIEALIGN_SANITIZE)
  add_compile_options("-fsanitize=${LIEALIGN_SANITIZE}" -fno-sanitize-recover=all -fno-omit-frame-pointer)
  add_link_options("-fsanitize=${LIEALIGN_SANITIZE}")
  if(CMAKE_CXX_COMPILER_ID MATCHES "Clang")
    add_compile_options("-fsanitize-ignorelist=${CMAKE_CURRENT_LIST_DIR}/sanitizers.txt")
  endif()
  # Indices into containers; matrices that are read before they are written, which begin as NaN.
  add_compile_definitions(_GLIBCXX_ASSERTIONS EIGEN_INITIALIZE_MATRICES_BY_NAN)
endif()
