add_executable(bus_test bus_test.cc event_log_test.cc fingerprint_test.cc recorder_test.cc)
target_link_libraries(bus_test PRIVATE bus lcm GTest::gtest_main)
evalbus_target(bus_test)
gtest_discover_tests(bus_test)
