# Films made by the programs themselves.
add_executable(filming_test filming_test.cc harness.cc)
target_link_libraries(filming_test PRIVATE bus cli_core GTest::gtest nlohmann_json::nlohmann_json)
evalbus_target(filming_test)
add_dependencies(filming_test programs)
gtest_discover_tests(filming_test PROPERTIES TIMEOUT ${TEST_TIMEOUT_S})
