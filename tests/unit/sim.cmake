add_executable(sim_test sim_component_test.cc variation_test.cc world_test.cc)
target_link_libraries(sim_test PRIVATE sim_component GTest::gtest_main)
evalbus_target(sim_test)
gtest_discover_tests(sim_test)

add_executable(all_tasks_test all_tasks_test.cc)
target_link_libraries(all_tasks_test PRIVATE sim_core metrics_core GTest::gtest_main)
evalbus_target(all_tasks_test)
gtest_discover_tests(all_tasks_test)
