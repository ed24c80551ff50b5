add_executable(models_test
  descriptions_test.cc
  model_consistency_test.cc
  scene_composer_test.cc
  scene_test.cc
  yaml_reader_test.cc)
target_link_libraries(models_test PRIVATE models GTest::gtest_main)
evalbus_target(models_test)
gtest_discover_tests(models_test)
