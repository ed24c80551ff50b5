# Pages that the program makes of a run of its own.
add_executable(report_run_test report_run_test.cc harness.cc)
target_link_libraries(report_run_test
  PRIVATE bus cli_core GTest::gtest nlohmann_json::nlohmann_json tinyxml2::tinyxml2)
evalbus_target(report_run_test)
add_dependencies(report_run_test programs)
gtest_discover_tests(report_run_test PROPERTIES TIMEOUT ${TEST_TIMEOUT_S})
