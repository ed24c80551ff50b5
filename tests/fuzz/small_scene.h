// The files of tests/unit/small_world.h's task: two arms of one joint, a counter and a pot. They are composed
// and compiled within a millisecond and contain every shape that collision checking supports.
#pragma once

#include <string>

#include "collision/checker.h"
#include "metrics/episode/episode_scorer.h"
#include "models/scene.h"
#include "sim/world.h"
#include "tests/fuzz/scratch_file.h"
#include "tests/unit/small_world.h"

namespace evalbus {

inline constexpr char kSmallRobot[] = R"(name: small
arms:
  - {name: left, model: arm.xml, joints: [joint], actuators: [motor], wrist_site: wrist, home_rad: [0],
     base: {position_m: [0, 0.2, 1.2]},
     gripper: {joints: [finger], actuator: grip, joint_open_m: 0.04, joint_closed_m: 0, command_open: 0.04,
               command_closed: 0, pad_bodies: [finger]}}
  - {name: right, model: arm.xml, joints: [joint], actuators: [motor], wrist_site: wrist, home_rad: [0],
     base: {position_m: [0, -0.2, 1.2]},
     gripper: {joints: [finger], actuator: grip, joint_open_m: 0.04, joint_closed_m: 0, command_open: 0.04,
               command_closed: 0, pad_bodies: [finger]}}
)";
inline constexpr char kSmallArm[] = R"(<mujoco>
  <compiler angle="radian"/>
  <worldbody><body name="base">
    <geom type="capsule" fromto="0 0 -0.1 0 0 0" size="0.03"/>
    <body name="hand">
      <joint name="joint" axis="0 1 0" range="-3 3" limited="true" damping="2"/>
      <geom type="capsule" fromto="0 0 0 0.5 0 0" size="0.03"/>
      <site name="wrist" pos="0.5 0 0"/>
      <body name="finger" pos="0.6 0 0">
        <joint name="finger" type="slide" axis="0 0 1" range="0 0.04" limited="true" damping="2"/>
        <geom type="box" size="0.05 0.02 0.01"/>
      </body>
    </body>
  </body></worldbody>
  <actuator>
    <position name="motor" joint="joint" kp="50" ctrlrange="-3 3" ctrllimited="true"/>
    <position name="grip" joint="finger" kp="50"/>
  </actuator>
</mujoco>
)";
inline constexpr char kSmallBase[] = R"(<mujoco>
  <option timestep="0.002"/>
  <worldbody>
    <light name="key" pos="0 0 3"/>
    <geom name="floor" type="plane" size="3 3 1"/>
    <camera name="overview" pos="0 -3 1.5" xyaxes="1 0 0 0 0.3 1"/>
  </worldbody>
</mujoco>
)";
inline constexpr char kSmallCounter[] = R"(<mujoco>
  <worldbody><body name="counter">
    <geom name="top" type="box" size="0.3 0.5 0.02" pos="0 0 0.88"/>
    <geom name="knob" type="sphere" size="0.03" pos="-0.2 0.3 0.92"/>
  </body></worldbody>
</mujoco>
)";
inline constexpr char kSmallPot[] = R"(<mujoco>
  <asset><mesh name="wedge" vertex="0 0 0  0.05 0 0  0 0.05 0  0 0 0.05"/></asset>
  <worldbody><body name="pot">
    <geom name="wall" type="cylinder" size="0.08 0.1" mass="0.5"/>
    <geom name="handle" type="mesh" mesh="wedge" pos="0.08 0 0" mass="0.1"/>
    <geom name="foot" type="ellipsoid" size="0.02 0.03 0.01" pos="0 0 -0.1" mass="0.1"/>
  </body></worldbody>
</mujoco>
)";

// A folder with all files except the task description.
class SmallScene : public ScratchFolder {
 public:
  SmallScene() {
    Write("robot.yaml", kSmallRobot);
    Write("arm.xml", kSmallArm);
    Write("scene.xml", kSmallBase);
    Write("counter.xml", kSmallCounter);
    Write("pot.xml", kSmallPot);
  }
};

// small_world::kTask, changed to end after five ticks of 20 ms.
inline std::string SmallTask() {
  std::string text = small_world::kTask;
  const std::string limit = "time_limit_s: 5";
  return text.replace(text.find(limit), limit.size(), "time_limit_s: 0.1");
}

// Processes a task, its variation and a robot as the programs do: composes, compiles, places, draws, steps,
// checks and evaluates.
inline void PlayTask(const TaskDescription& task, const std::string& variation,
                     const RobotDescription& robot) {
  Scene scene = BuildScene(task, robot);
  scene.info.substeps = 2;
  sim::World world(scene.physics.get(), scene.info, robot, task, scene.info.substeps);
  world.Reset(1, task.variation(variation));
  world.Overlap();
  RandomizeAppearance(task.variation(variation), 1, scene.visual.get());
  collision::CollisionChecker checker(scene.physics.get(), scene.info);
  metrics::EpisodeScorer scorer(scene.info, task);
  state_t state{};
  for (bool stable = true; stable && state.header.tick < 3; ++state.header.tick) {
    world.Fill(&state);
    for (int body = 0; body < state.num_bodies; ++body) {
      checker.SetBodyPose(body, state.body[static_cast<size_t>(body)].position_m,
                          state.body[static_cast<size_t>(body)].quat_wxyz);
    }
    contacts_t contacts{};
    contacts.header = state.header;
    contacts.contact = checker.FindContacts();
    checker.FindClearance();
    scorer.Tick(state, contacts);
    stable = world.Step();
  }
  scorer.Summary({}, {});
}

}  // namespace evalbus
