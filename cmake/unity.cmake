# liealign_unity(target): one compilation for each of a few groups of sources, with LIEALIGN_UNITY. Headers are then compiled, and
# read by clang-tidy, a dozen times instead of sixty; what instantiates a whole filter stands alone, for it takes the memory of the
# others together. Names that a file keeps to itself must differ within a group; files that share theirs get a group of their
# own here.
# SPDX-License-Identifier: Apache-2.0
include_guard(GLOBAL)

function(liealign_unity target)
  if(NOT LIEALIGN_UNITY)
    return()
  endif()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
  get_target_property(sources ${target} SOURCES)
  foreach(source IN LISTS sources)
    if(source MATCHES "/io/rtklib_[^/]*$")
      set(group rtklib)
    elseif(source MATCHES "/(inside_interval|interval_smoother_[a-z]+|sample_smoother|filter_steps_?[a-z]*)[.]cpp$")
      set(group ${CMAKE_MATCH_1})
    elseif(source MATCHES "/(align|estimate|io|pipeline|simulate|study)/[^/]*$")
      set(group ${CMAKE_MATCH_1})
    else()
      set(group motion)
    endif()
    set_source_files_properties("${source}" PROPERTIES UNITY_GROUP ${group})
  endforeach()
endfunction()
