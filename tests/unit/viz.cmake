add_executable(viz_test film_test.cc renderer_test.cc)
target_link_libraries(viz_test PRIVATE viz_film PkgConfig::CAIRO GTest::gtest_main)
evalbus_target(viz_test)
gtest_discover_tests(viz_test)
