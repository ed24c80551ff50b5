# Real processes over a real bus, in a network namespace of the test's own.
add_executable(pipeline_test
  bad_input_test.cc
  by_hand_test.cc
  determinism_test.cc
  faults_test.cc
  formats_test.cc
  no_multicast_test.cc
  run_folder_test.cc
  stock_tools_test.cc
  harness.cc)
target_link_libraries(pipeline_test PRIVATE bus cli_core GTest::gtest nlohmann_json::nlohmann_json)
evalbus_target(pipeline_test)
add_dependencies(pipeline_test programs)
gtest_discover_tests(pipeline_test PROPERTIES TIMEOUT ${TEST_TIMEOUT_S})
