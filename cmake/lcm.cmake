# The library itself. Debian's lcm.pc names glib's, which liblcm-dev does not bring, so it is looked up by hand.
find_library(LCM_LIBRARY lcm REQUIRED)
find_path(LCM_INCLUDE_DIR lcm/lcm-cpp.hpp REQUIRED)
add_library(lcm INTERFACE)
target_link_libraries(lcm INTERFACE ${LCM_LIBRARY})
target_include_directories(lcm SYSTEM INTERFACE ${LCM_INCLUDE_DIR})

# lcm_types(TARGET FILE...): generates a C++ header per .lcm file with lcm-gen, limits what its decoder allocates, and
# makes an interface library of them.
# (liblcm-dev 1.3 has no CMake package, hence no lcm_wrap_types.)
function(lcm_types target)
  set(out ${CMAKE_BINARY_DIR}/generated)
  set(limits ${PROJECT_SOURCE_DIR}/cmake/bounded_counts.sed)
  set(headers)
  foreach(file ${ARGN})
    get_filename_component(name ${file} NAME_WE)
    set(header ${out}/evalbus/${name}.hpp)
    add_custom_command(
      OUTPUT ${header}
      COMMAND lcm-gen --cpp --cpp-std=c++11 --cpp-hpath ${out} ${CMAKE_CURRENT_SOURCE_DIR}/${file}
      COMMAND sed -z -E -i -f ${limits} ${header}
      DEPENDS ${file} ${limits}
      VERBATIM)
    list(APPEND headers ${header})
  endforeach()
  add_custom_target(${target}_headers DEPENDS ${headers})
  add_library(${target} INTERFACE)
  add_dependencies(${target} ${target}_headers)
  # SYSTEM: generated code does not obey our warning flags.
  target_include_directories(${target} SYSTEM INTERFACE ${out})
endfunction()
