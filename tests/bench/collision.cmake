add_executable(collision_bench collision_bench.cc)
evalbus_target(collision_bench)
target_link_libraries(collision_bench PRIVATE collision_core models fcl Eigen3::Eigen benchmark::benchmark)
