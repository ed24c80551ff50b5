add_executable(policy_bench policy_bench.cc)
evalbus_target(policy_bench)
target_link_libraries(policy_bench PRIVATE policy_core sim_core benchmark::benchmark)
