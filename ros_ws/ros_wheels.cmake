# SPDX-License-Identifier: Apache-2.0
# Project include file (CMAKE_PROJECT_INCLUDE) for building against the ROS 2 wheels from PyPI.
#
# The wheels' exported targets name include folders of the machine that built them, and CMake
# refuses a target with an include folder that does not exist. They are dropped here, at the end
# of the configure step, when all targets are known. A native ROS 2 install does not need this.
function(towtank_drop_foreign_include_directories)
  get_property(targets DIRECTORY PROPERTY IMPORTED_TARGETS)
  foreach(target IN LISTS targets)
    get_target_property(directories ${target} INTERFACE_INCLUDE_DIRECTORIES)
    if(directories)
      list(FILTER directories EXCLUDE REGEX "^/opt/python/")
      set_target_properties(${target} PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${directories}")
    endif()
  endforeach()
endfunction()

cmake_language(DEFER CALL towtank_drop_foreign_include_directories)
