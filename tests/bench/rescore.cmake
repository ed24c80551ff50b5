add_executable(rescore_bench rescore_bench.cc)
target_link_libraries(rescore_bench PRIVATE cli_core fmt::fmt)
evalbus_target(rescore_bench)
