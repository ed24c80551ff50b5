add_executable(filming_bench filming_bench.cc)
target_link_libraries(filming_bench PRIVATE cli_core fmt::fmt)
evalbus_target(filming_bench)
add_dependencies(filming_bench programs)
