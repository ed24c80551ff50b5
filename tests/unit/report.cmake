add_executable(report_test report_page_test.cc report_scale_test.cc)
target_link_libraries(report_test PRIVATE viz_report GTest::gtest_main)
evalbus_target(report_test)
gtest_discover_tests(report_test)
