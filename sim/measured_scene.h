// What somebody else measured, as STATE: joint positions become poses of links and wrists by forward
// kinematics, velocities are differences of positions where none were measured, and objects are where they
// were tracked. The scene is a task's, nothing of it moves by itself. Knows neither bus nor clock; live
// sources and files become states by it alone.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "evalbus/body_pose_t.hpp"
#include "evalbus/state_t.hpp"
#include "models/mujoco_ptr.h"
#include "sim/prepared_scene.h"

namespace evalbus::sim {

// What is measured, by names of MODEL.
struct Measured {
  // All of each arm's; of fingers and of parts of objects those that there are.
  std::vector<std::string> joints;
  bool has_velocity = false;
  // Objects whose poses are known.
  std::vector<std::string> objects;
};

// One moment of it.
struct Sample {
  // Since the first one, s.
  double time_s = 0;
  // In the order of Measured::joints: rad, of joints that slide m; rad/s, m/s, empty where positions alone
  // were measured.
  std::vector<double> position, velocity;
  // Of each gripper of MODEL, 0 closed to 1 open; nothing where the positions of its fingers say it.
  std::vector<std::optional<double>> opening;
  // In the order of Measured::objects, world frame.
  std::vector<body_pose_t> object;
};

class MeasuredScene {
 public:
  // A name that does not fit the scene, and what is wrong with it.
  struct Fault {
    std::string name;
    std::string text;
  };
  // Of what is measured, the first that is wrong.
  static std::optional<Fault> FindFault(const PreparedScene& prepared, const Measured& measured);

  // Says in prepared's MODEL what is known of this scene and what is not. prepared outlives it. Throws
  // InputError with FindFault's text.
  MeasuredScene(PreparedScene* prepared, Measured measured, const std::string& source);

  // Nothing, or what a joint's position cannot be ("45 rad is beyond the range of left/joint2, -1.763
  // to 1.763; are these degrees?").
  std::string PositionFault(size_t joint, double position) const;
  // The same of a whole sample of finite numbers in right counts: positions and quaternions.
  std::string SampleFault(const Sample& sample) const;

  // The named fingers of a gripper, as indices into Measured::joints; empty where it has none.
  const std::vector<size_t>& FingersOf(size_t gripper) const { return fingers_[gripper]; }

  // Between two samples, at a share of the way from one to the other. before: the last state before, of which
  // velocities are differences; none at the first.
  state_t At(const Sample& a, const Sample& b, double share, const state_t* before, const header_t& header);

 private:
  const GripperDescription& gripper(size_t index) const { return prepared_->robot.grippers[index]; }
  void SetObjects(const Sample& a, const Sample& b, double share);

  PreparedScene* prepared_;
  const mjModel* model_;
  Measured measured_;
  std::vector<int> joints_;                   // ids, in the order of Measured
  std::vector<std::vector<size_t>> fingers_;  // by gripper
  // As nothing measured has moved it.
  DataPtr home_;
  DataPtr data_;
};

}  // namespace evalbus::sim
