# Live pictures by the programs themselves, and what they say on a machine without OSMesa.
add_library(hide_osmesa MODULE hide_osmesa.cc)
evalbus_target(hide_osmesa)
target_compile_options(hide_osmesa PRIVATE -fno-sanitize=all)
target_link_options(hide_osmesa PRIVATE -fno-sanitize=all)

add_executable(viz_run_test viz_run_test.cc harness.cc)
target_link_libraries(viz_run_test
  PRIVATE bus cli_core viz_component PkgConfig::TURBOJPEG GTest::gtest nlohmann_json::nlohmann_json)
target_compile_definitions(viz_run_test PRIVATE HIDE_OSMESA="$<TARGET_FILE:hide_osmesa>")
evalbus_target(viz_run_test)
add_dependencies(viz_run_test programs hide_osmesa)
gtest_discover_tests(viz_run_test PROPERTIES TIMEOUT ${TEST_TIMEOUT_S})
