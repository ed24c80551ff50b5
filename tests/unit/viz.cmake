add_executable(viz_test film_test.cc renderer_test.cc viz_component_test.cc)
target_link_libraries(viz_test
  PRIVATE viz_film viz_component PkgConfig::CAIRO PkgConfig::TURBOJPEG GTest::gtest_main)
evalbus_target(viz_test)
gtest_discover_tests(viz_test)
