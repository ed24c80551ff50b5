# evalbus_target(NAME): our own code compiles without warnings, against headers named from the repository root.
# -Wno-restrict: GCC 12 alone knows it, and warns of "text" + std::string where nothing overlaps.
function(evalbus_target name)
  target_compile_options(${name} PRIVATE -Wall -Wextra -Wshadow -Wnon-virtual-dtor -Werror
    $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>)
  target_include_directories(${name} PUBLIC ${PROJECT_SOURCE_DIR})
endfunction()
