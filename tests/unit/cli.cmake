add_executable(cli_test live_view_test.cc)
target_link_libraries(cli_test PRIVATE cli_core GTest::gtest_main)
evalbus_target(cli_test)
gtest_discover_tests(cli_test)
