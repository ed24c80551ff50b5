add_executable(metrics_test
  allocation_count.cc
  rollout_metrics_test.cc
  run_statistics_test.cc
  score_file_test.cc
  score_vectors_test.cc)
target_link_libraries(metrics_test PRIVATE metrics_core GTest::gtest_main)
evalbus_target(metrics_test)
gtest_discover_tests(metrics_test)
