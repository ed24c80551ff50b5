# Every task failed on purpose, with the programs themselves.
add_executable(failures_test failures_test.cc harness.cc)
target_link_libraries(failures_test PRIVATE bus cli_core GTest::gtest nlohmann_json::nlohmann_json)
evalbus_target(failures_test)
add_dependencies(failures_test programs)
gtest_discover_tests(failures_test PROPERTIES TIMEOUT ${TEST_TIMEOUT_S})
