# A bus that misbehaves: lost, repeated, reordered, damaged and foreign messages, second publishers, old logs.
add_library(bad_network MODULE bad_network.cc)
evalbus_target(bad_network)
target_compile_options(bad_network PRIVATE -fno-sanitize=all)
target_link_options(bad_network PRIVATE -fno-sanitize=all)
target_link_libraries(bad_network PRIVATE ${CMAKE_DL_LIBS})

add_executable(bus_faults_test
  closed_test.cc
  lossy_bus_test.cc
  second_publisher_test.cc
  udp_faults_test.cc
  harness.cc)
target_link_libraries(bus_faults_test
  PRIVATE bus cli_core collision_component metrics_component policy_component sim_component GTest::gtest
    nlohmann_json::nlohmann_json)
target_compile_definitions(bus_faults_test PRIVATE BAD_NETWORK_LIBRARY="$<TARGET_FILE:bad_network>")
evalbus_target(bus_faults_test)
add_dependencies(bus_faults_test programs bad_network)
gtest_discover_tests(bus_faults_test PROPERTIES TIMEOUT ${TEST_TIMEOUT_S})
