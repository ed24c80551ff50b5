// Measures the cost of a policy: planning at tick 0, each later tick, and the parts of planning.
#include <benchmark/benchmark.h>

#include "models/scene.h"
#include "policy_bridge/factory.h"
#include "policy_bridge/planning/ik.h"
#include "sim/world.h"

namespace evalbus {
namespace {

struct Setting {
  TaskDescription task = FindTask("lift_pot").task;
  RobotDescription robot = LoadRobot(task.robot_file);
  Scene scene = BuildScene(task, robot);
  state_t state{};

  Setting() {
    sim::World world(scene.physics.get(), scene.info, robot, task, 10);
    world.Reset(1, task.variation("position_and_orientation"));
    world.Fill(&state);
    // The hands are closed after a reset, which blocks every plan, so they are opened here.
    for (auto& gripper : state.gripper) gripper.opening = 1;
    for (const std::string hand : {"left/hand/", "right/hand/"}) {
      for (const std::string finger : {"finger_joint1", "finger_joint2"}) {
        const int joint = mj_name2id(scene.physics.get(), mjOBJ_JOINT, (hand + finger).c_str());
        state.qpos_mixed[static_cast<size_t>(scene.physics->jnt_qposadr[joint])] = 0.04;
      }
    }
  }
  policy::ArmChain Chain() const { return policy::ArmChain(*scene.physics, scene.info.arm[0]); }
};

Setting& GetSetting() {
  static Setting setting;
  return setting;
}

void ForwardKinematicsAndJacobian(benchmark::State& bench) {
  const policy::ArmChain chain = GetSetting().Chain();
  policy::JointVector q = chain.home();
  policy::Jacobian jacobian;
  for (auto _ : bench) {
    q[0] = -q[0] + 1e-3;
    benchmark::DoNotOptimize(chain.Forward(q, &jacobian));
    benchmark::DoNotOptimize(jacobian);
  }
  if (!jacobian.allFinite() || jacobian.cols() != 7) bench.SkipWithError("wrong Jacobian");
}
BENCHMARK(ForwardKinematicsAndJacobian);

// Measures one knot of a plan, in which one arm follows a line of 4 cm.
void InverseKinematics(benchmark::State& bench) {
  const policy::ArmChain chain = GetSetting().Chain();
  const Eigen::Isometry3d target = Eigen::Translation3d(0.02, 0.02, 0.025) * chain.Forward(chain.home());
  policy::IkResult result;
  for (auto _ : bench) {
    result = policy::SolveIk(chain, target, chain.home());
    benchmark::DoNotOptimize(result);
  }
  if (!result.converged) bench.SkipWithError("did not converge");
  bench.counters["iterations"] = result.iterations;
}
BENCHMARK(InverseKinematics);

// Begins an episode and calls the expert until it has planned. It plans when the object is at rest, after
// less than a second.
void PlanAt1s(policy::Policy* expert, action_t* action) {
  state_t& state = GetSetting().state;
  expert->Begin({});
  for (const int64_t time_us : {0, 1'000'000}) {
    state.header.sim_time_us = time_us;
    expert->Act(state, action);
  }
}

// Measures planning all motions. The expert plans whenever it has no motions left.
void ExpertPlans(benchmark::State& bench) {
  Setting& setting = GetSetting();
  const auto expert = policy::MakePolicy("expert", *setting.scene.physics, setting.scene.info);
  action_t action{};
  for (auto _ : bench) PlanAt1s(expert.get(), &action);
  const std::vector<double> before = action.joint_position_rad;
  setting.state.header.sim_time_us = 2'000'000;
  expert->Act(setting.state, &action);
  if (action.joint_position_rad == before) bench.SkipWithError("no plan");
}
BENCHMARK(ExpertPlans)->Unit(benchmark::kMicrosecond);

// Measures a tick without planning.
void ExpertActs(benchmark::State& bench) {
  Setting& setting = GetSetting();
  const auto expert = policy::MakePolicy("expert", *setting.scene.physics, setting.scene.info);
  action_t action{};
  PlanAt1s(expert.get(), &action);
  const std::vector<double> before = action.joint_position_rad;
  // These ticks are within the first motion.
  int64_t tick = 0;
  for (auto _ : bench) {
    setting.state.header.sim_time_us = 1'500'000 + tick++ % 1000;
    expert->Act(setting.state, &action);
  }
  if (action.joint_position_rad == before) bench.SkipWithError("does not move");
}
BENCHMARK(ExpertActs);

}  // namespace
}  // namespace evalbus

BENCHMARK_MAIN();
