// Tests the keys of a robot description that define how its controller works and how the robot starts.
#include <cmath>

#include "models/scene.h"
#include "sim/world.h"
#include "tests/unit/models/models_test_util.h"

namespace evalbus::sim::robot_start_test {

// The world of StackTwoBlocks. Its robot differs from the shipped robot in some values.
class Started {
 public:
  explicit Started(const std::function<void(RobotDescription*)>& change)
      : task_(FindTask("stack_two_blocks").task), robot_(LoadRobot(task_.robot_file)) {
    change(&robot_);
    scene_ = BuildScene(task_, robot_);
    world_ = std::make_unique<World>(scene_.physics.get(), scene_.info, robot_, task_, 10);
    world_->Reset(0, task_.variation("base"));
  }
  state_t State() const {
    state_t state{};
    world_->Fill(&state);
    return state;
  }
  World& world() { return *world_; }
  action_t Hold(double closing) const {
    action_t action{};
    action.mode = action_t::JOINT_POSITION;
    for (const ArmDescription& arm : robot_.arms)
      action.joint_position_rad.insert(action.joint_position_rad.end(), arm.home.begin(), arm.home.end());
    action.gripper_closing = {closing, closing};
    return action;
  }
  const mjModel& model() const { return *scene_.physics; }

 private:
  TaskDescription task_;
  RobotDescription robot_;
  Scene scene_;
  std::unique_ptr<World> world_;
};

// Returns by how much the left wrist sinks while the arms hold the home position for a second.
double Sag(bool compensation) {
  Started started([&](RobotDescription* robot) { robot->gravity_compensation = compensation; });
  const double start = started.State().arm[0].wrist_position_m[2];
  for (int tick = 0; tick < 50; ++tick) {
    EXPECT_EQ(started.world().Apply(started.Hold(0)), "");
    started.world().Step();
  }
  return start - started.State().arm[0].wrist_position_m[2];
}

// Without compensation, the wrist sinks by 6.7 mm, as with RoboEval's arms, which have the same stiffness and
// masses.
TEST(GravityCompensation, KeepsTheArmsFromSagging) {
  EXPECT_LT(std::abs(Sag(true)), 1e-4);
  EXPECT_NEAR(Sag(false), 0.0067, 0.0005);
}

TEST(Gripper, StartsWithItsStartOpening) {
  const auto with = [](double opening) {
    return [=](RobotDescription* robot) {
      for (GripperDescription& gripper : robot->grippers) gripper.start_opening = opening;
    };
  };
  Started open(with(1)), closed(with(0.25));
  EXPECT_EQ(open.State().gripper[0].opening, 1);
  EXPECT_DOUBLE_EQ(closed.State().gripper[0].opening, 0.25);
  EXPECT_DOUBLE_EQ(closed.State().ctrl_mixed.back(), 0.25 * 0.04);
}

TEST(Gripper, BinaryCommandsAreFullyOpenOrClosed) {
  const auto command = [](bool binary, double closing) {
    Started started([&](RobotDescription* robot) {
      for (GripperDescription& gripper : robot->grippers) gripper.binary_command = binary;
    });
    EXPECT_EQ(started.world().Apply(started.Hold(closing)), "");
    return started.State().ctrl_mixed.back();
  };
  EXPECT_DOUBLE_EQ(command(false, 0.6), 0.4 * 0.04);
  EXPECT_EQ(command(true, 0.6), 0);
  EXPECT_EQ(command(true, 0.5), 0);
  EXPECT_EQ(command(true, 0.49), 0.04);
}

// In a step of 2 ms from rest, gravity moves the arms but not the cubes.
TEST(StartSteps, MoveTheRobotOnly) {
  Started rest([](RobotDescription* robot) { robot->gravity_compensation = false; });
  Started moved([](RobotDescription* robot) {
    robot->gravity_compensation = false;
    robot->start_steps = 1;
  });
  const state_t a = rest.State(), b = moved.State();
  EXPECT_EQ(a.arm[0].joint_velocity_radps[1], 0);
  EXPECT_GT(std::abs(b.arm[0].joint_velocity_radps[1]), 1e-3);
  EXPECT_NEAR(b.arm[0].joint_position_rad[1] - a.arm[0].joint_position_rad[1],
              0.002 * b.arm[0].joint_velocity_radps[1], 1e-15);
  const int cube = mj_name2id(&moved.model(), mjOBJ_JOINT, "red_cube");
  for (int i = 0; i < 7; ++i) {
    const auto at = static_cast<size_t>(moved.model().jnt_qposadr[cube] + i);
    EXPECT_EQ(b.qpos_mixed[at], a.qpos_mixed[at]);
  }
  for (int i = 0; i < 6; ++i)
    EXPECT_EQ(b.qvel_mixed[static_cast<size_t>(moved.model().jnt_dofadr[cube] + i)], 0);
}

}  // namespace evalbus::sim::robot_start_test
