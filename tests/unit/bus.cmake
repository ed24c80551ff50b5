add_executable(bus_test
  allocation_count.cc
  bus_test.cc
  conflict_detector_test.cc
  event_log_test.cc
  fingerprint_test.cc
  message_limits_test.cc
  recorder_test.cc)
target_link_libraries(bus_test PRIVATE bus lcm GTest::gtest_main)
evalbus_target(bus_test)
gtest_discover_tests(bus_test)
