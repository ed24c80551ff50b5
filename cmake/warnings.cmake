# evalbus_target(NAME): our own code compiles without warnings, against headers named from the repository root.
function(evalbus_target name)
  target_compile_options(${name} PRIVATE -Wall -Wextra -Wshadow -Wnon-virtual-dtor -Werror)
  target_include_directories(${name} PUBLIC ${PROJECT_SOURCE_DIR})
endfunction()
