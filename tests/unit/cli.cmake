add_executable(cli_test live_view_test.cc log_damage_test.cc run_folder_test.cc)
target_link_libraries(cli_test PRIVATE cli_core GTest::gtest_main)
evalbus_target(cli_test)
gtest_discover_tests(cli_test)

add_executable(run_results_test compare_test.cc run_reader_test.cc)
target_link_libraries(run_results_test PRIVATE run_results GTest::gtest_main)
evalbus_target(run_results_test)
gtest_discover_tests(run_results_test)
