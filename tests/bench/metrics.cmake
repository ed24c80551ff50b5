add_executable(metrics_bench metrics_bench.cc)
target_link_libraries(metrics_bench PRIVATE metrics_core benchmark::benchmark)
evalbus_target(metrics_bench)
