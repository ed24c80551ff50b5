add_executable(metrics_test
  allocation_count.cc
  episode_scorer_test.cc
  explanation_test.cc
  extended_metrics_test.cc
  predicates_test.cc
  rollout_metrics_test.cc
  score_file_test.cc
  score_vectors_test.cc
  task_evaluator_test.cc
  tick_merger_test.cc)
target_link_libraries(metrics_test PRIVATE metrics_core Eigen3::Eigen GTest::gtest_main)
evalbus_target(metrics_test)
gtest_discover_tests(metrics_test)

add_executable(metrics_component_test metrics_component_test.cc)
target_link_libraries(metrics_component_test PRIVATE metrics_component GTest::gtest_main)
evalbus_target(metrics_component_test)
gtest_discover_tests(metrics_component_test)

add_executable(statistics_test run_statistics_test.cc statistics_test.cc)
target_link_libraries(statistics_test PRIVATE metrics_statistics GTest::gtest_main)
evalbus_target(statistics_test)
gtest_discover_tests(statistics_test)
