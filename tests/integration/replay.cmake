# Recorded episodes played and scored again, over a real bus in a network namespace of the test's own.
add_executable(replay_test replay_test.cc harness.cc)
target_link_libraries(replay_test PRIVATE bus cli_core GTest::gtest nlohmann_json::nlohmann_json)
evalbus_target(replay_test)
add_dependencies(replay_test programs)
gtest_discover_tests(replay_test PROPERTIES TIMEOUT ${TEST_TIMEOUT_S})
