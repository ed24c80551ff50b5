add_executable(collision_test collision_closed_form_test.cc collision_filter_test.cc collision_mujoco_test.cc)
    evalbus_target(collision_test)
        target_link_libraries(collision_test PRIVATE collision_core Eigen3::Eigen GTest::gtest_main)
            gtest_discover_tests(collision_test)

add_executable(collision_component_test collision_component_test.cc)
evalbus_target(collision_component_test)
target_link_libraries(collision_component_test PRIVATE collision_component models GTest::gtest_main)
gtest_discover_tests(collision_component_test)
