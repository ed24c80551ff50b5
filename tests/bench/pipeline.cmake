add_executable(pipeline_bench pipeline_bench.cc)
target_link_libraries(pipeline_bench PRIVATE cli_core lcm fmt::fmt CLI11::CLI11)
evalbus_target(pipeline_bench)
add_dependencies(pipeline_bench programs)
