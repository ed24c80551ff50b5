# How this project's targets are made. Sources are found by folder, so a new file needs no line here.

# evalbus_target(NAME): our own code compiles without warnings, against headers named from the repository root.
# -Wno-restrict: GCC 12 alone knows it, and warns of "text" + std::string where nothing overlaps.
# In a unity build, which compiles the files of a folder together, two warnings are of another file's names.
function(evalbus_target name)
  target_compile_options(${name} PRIVATE -Wall -Wextra -Wshadow -Wnon-virtual-dtor -Werror
    $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>
    $<$<BOOL:${CMAKE_UNITY_BUILD}>:-Wno-shadow -Wno-subobject-linkage>)
  target_include_directories(${name} PUBLIC ${PROJECT_SOURCE_DIR})
endfunction()

# quick_to_compile(NAME): for what does no work in a tick: command lines, network. Half of what the compiler would take.
function(quick_to_compile name)
  target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O1>)
endfunction()

# evalbus_sources(VARIABLE FOLDER...): the .cc files of these folders that belong into its library: not main.cc, and
# not X_component.cc, which knows the bus where the rest does not.
function(evalbus_sources variable)
  set(found)
  foreach(folder ${ARGN})
    file(GLOB here CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${folder}/*.cc)
    list(APPEND found ${here})
  endforeach()
  list(FILTER found EXCLUDE REGEX "/(main|[a-z_]+_component)\\.cc$")
  set(${variable} ${found} PARENT_SCOPE)
endfunction()

# evalbus_library(NAME [FOLDERS folder...] [SOURCES file...] [PUBLIC target...] [PRIVATE target...]): a static library
# of the sources of these folders and these files; neither: of the folder it is called in.
function(evalbus_library name)
  cmake_parse_arguments(PARSE_ARGV 1 ARG "" "" "FOLDERS;SOURCES;PUBLIC;PRIVATE")
  if(NOT ARG_FOLDERS AND NOT ARG_SOURCES)
    set(ARG_FOLDERS .)
  endif()
  evalbus_sources(found ${ARG_FOLDERS})
  add_library(${name} STATIC ${found} ${ARG_SOURCES})
  evalbus_target(${name})
  target_link_libraries(${name} PUBLIC ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE})
endfunction()

# evalbus_program(NAME LIBRARY...): evalbus-NAME from the folder's main.cc. ./run builds all programs.
function(evalbus_program name)
  add_executable(evalbus-${name} main.cc)
  evalbus_target(evalbus-${name})
  quick_to_compile(evalbus-${name})
  set_target_properties(evalbus-${name} PROPERTIES ENABLE_EXPORTS ON)  # for plugins
  target_link_libraries(evalbus-${name} PRIVATE ${ARGN})
  set_property(GLOBAL APPEND PROPERTY EVALBUS_PROGRAMS evalbus-${name})
endfunction()

# evalbus_component(NAME [LIBRARY...]): a process that takes part in runs: NAME_component from NAME_component.cc (or, where
# the whole folder knows the bus, from all of it), and the program evalbus-NAME. `evalbus run` links them all.
function(evalbus_component name)
  set(own ${name}_component.cc)
  if(NOT EXISTS ${CMAKE_CURRENT_SOURCE_DIR}/${own})
    evalbus_sources(own .)
  endif()
  evalbus_library(${name}_component SOURCES ${own} PUBLIC bus ${ARGN})
  evalbus_program(${name} ${name}_component CLI11::CLI11)
  set_property(GLOBAL APPEND PROPERTY EVALBUS_COMPONENTS ${name}_component)
endfunction()
