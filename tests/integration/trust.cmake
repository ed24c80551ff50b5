# The same results whatever the run is made of, whatever policies and the machine do.
add_library(clock_back MODULE clock_back.cc)
evalbus_target(clock_back)
target_compile_options(clock_back PRIVATE -fno-sanitize=all)
target_link_options(clock_back PRIVATE -fno-sanitize=all)

add_executable(trust_test
  machine_test.cc
  misbehaving_policy_test.cc
  realtime_test.cc
  reproducible_test.cc
  harness.cc)
target_link_libraries(trust_test PRIVATE bus cli_core GTest::gtest nlohmann_json::nlohmann_json)
target_compile_definitions(trust_test PRIVATE CLOCK_BACK="$<TARGET_FILE:clock_back>")
evalbus_target(trust_test)
add_dependencies(trust_test programs clock_back)
gtest_discover_tests(trust_test PROPERTIES TIMEOUT ${TEST_TIMEOUT_S})

add_test(NAME KillTrials
  COMMAND ${PROJECT_SOURCE_DIR}/scripts/kill_trials --trials 8 --seed 1 --bin ${PROJECT_BINARY_DIR}/bin)
set_tests_properties(KillTrials PROPERTIES TIMEOUT 600 SKIP_RETURN_CODE 77)
