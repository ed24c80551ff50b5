add_executable(sim_test sim_component_test.cc world_test.cc)
target_link_libraries(sim_test PRIVATE sim_component GTest::gtest_main)
evalbus_target(sim_test)
gtest_discover_tests(sim_test)
