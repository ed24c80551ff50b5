add_executable(monitor_test live_runs_test.cc monitor_model_test.cc)
target_link_libraries(monitor_test PRIVATE monitor_core GTest::gtest_main)
evalbus_target(monitor_test)
gtest_discover_tests(monitor_test)
