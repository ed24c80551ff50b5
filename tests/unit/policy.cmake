add_executable(policy_test
  block_experts_test.cc
  expert_test.cc
  flawed_policy_test.cc
  grasp_test.cc
  hinge_experts_test.cc
  kinematics_test.cc
  lift_tray_test.cc
  motion_test.cc
  policy_component_test.cc
  simple_policies_test.cc
  single_book_test.cc)
target_link_libraries(policy_test PRIVATE policy_component sim_core metrics_core GTest::gtest_main)
evalbus_target(policy_test)
gtest_discover_tests(policy_test)
