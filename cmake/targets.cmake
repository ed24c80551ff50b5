# Functions that define this project's targets. Sources are found by folder, so new files need not be listed.

# evalbus_target(NAME): sets the options of a target with evalbus' own code: warnings are errors, and #include paths
# start at the repository root. -Wrestrict is disabled, because GCC 12 reports it falsely for "text" + std::string. A
# unity build compiles the files of a folder together, so -Wshadow and -Wsubobject-linkage would report names of other
# files.
function(evalbus_target name)
  target_compile_options(${name} PRIVATE -Wall -Wextra -Wshadow -Wnon-virtual-dtor -Werror
    $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>
    $<$<BOOL:${CMAKE_UNITY_BUILD}>:-Wno-shadow>
    $<$<AND:$<BOOL:${CMAKE_UNITY_BUILD}>,$<CXX_COMPILER_ID:GNU>>:-Wno-subobject-linkage>)
  target_include_directories(${name} PUBLIC ${PROJECT_SOURCE_DIR})
  if(EVALBUS_PRECOMPILE)
    # GCC requires the macros with which the headers were precompiled, and falsely warns about std::string in them.
    target_compile_definitions(${name} PRIVATE FMT_SHARED GTEST_HAS_PTHREAD=1)
    target_compile_options(${name} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-array-bounds -Wno-stringop-overflow -Wno-stringop-overread>)
    if(NOT EVALBUS_PRECOMPILED_BY STREQUAL name)
      target_precompile_headers(${name} REUSE_FROM ${EVALBUS_PRECOMPILED_BY})
    endif()
  endif()
endfunction()

# evalbus_precompile(NAME HEADER...): precompiles these headers once for all targets of this folder and of the folders
# below it (preset develop). Either all or none of these targets must be optimized.
function(evalbus_precompile name)
  if(EVALBUS_PRECOMPILE)
    file(CONFIGURE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/${name}.cc CONTENT "")
    add_library(${name} OBJECT ${CMAKE_CURRENT_BINARY_DIR}/${name}.cc)
    set(EVALBUS_PRECOMPILED_BY ${name} PARENT_SCOPE)
    set(EVALBUS_PRECOMPILED_BY ${name})
    evalbus_target(${name})
    target_precompile_headers(${name} PRIVATE ${ARGN})
  endif()
endfunction()

# not_precompiled(NAME): for targets in folders of evalbus_precompile() whose optimization or code model differs. The
# compiler would reject the precompiled headers.
function(not_precompiled name)
  set_target_properties(${name} PROPERTIES DISABLE_PRECOMPILE_HEADERS ON)
endfunction()

# quick_to_compile(NAME): halves the compile time of targets that do no work per tick (command lines, network), by a
# lower optimization.
function(quick_to_compile name)
  target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O1>)
endfunction()

# evalbus_sources(VARIABLE FOLDER...): finds the .cc files of these folders, except main.cc and X_component.cc, which
# depends on the bus.
function(evalbus_sources variable)
  set(found)
  foreach(folder ${ARGN})
    file(GLOB here CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${folder}/*.cc)
    list(APPEND found ${here})
  endforeach()
  list(FILTER found EXCLUDE REGEX "/(main|[a-z_]+_component)\\.cc$")
  set(${variable} ${found} PARENT_SCOPE)
endfunction()

# evalbus_library(NAME [FOLDERS folder...] [SOURCES file...] [PUBLIC target...] [PRIVATE target...]): defines a static
# library of the sources of these folders and these files. Without FOLDERS and SOURCES, uses the current folder.
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

# evalbus_program(NAME LIBRARY...): defines the program evalbus-NAME from the folder's main.cc. ./run builds all
# programs.
function(evalbus_program name)
  add_executable(evalbus-${name} main.cc)
  evalbus_target(evalbus-${name})
  quick_to_compile(evalbus-${name})
  set_target_properties(evalbus-${name} PROPERTIES ENABLE_EXPORTS ON)  # for plugins
  target_link_libraries(evalbus-${name} PRIVATE ${ARGN})
  set_property(GLOBAL APPEND PROPERTY EVALBUS_PROGRAMS evalbus-${name})
endfunction()

# evalbus_component(NAME [LIBRARY...]): defines a component of a run: the library NAME_component from NAME_component.cc
# (or, if that does not exist, from all files of the folder) and the program evalbus-NAME. `evalbus run` links all
# components.
function(evalbus_component name)
  set(own ${name}_component.cc)
  if(NOT EXISTS ${CMAKE_CURRENT_SOURCE_DIR}/${own})
    evalbus_sources(own .)
  endif()
  evalbus_library(${name}_component SOURCES ${own} PUBLIC bus ${ARGN})
  evalbus_program(${name} ${name}_component CLI11::CLI11)
  set_property(GLOBAL APPEND PROPERTY EVALBUS_COMPONENTS ${name}_component)
endfunction()
