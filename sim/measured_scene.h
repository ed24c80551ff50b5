// Converts the measurements of an external source to STATE. Poses of links and wrists are computed from joint
// positions by forward kinematics. Joint velocities that were not measured are differences of positions.
// Objects are placed at their tracked poses. The scene comes from a task; nothing in it moves by itself. This
// class uses no bus and no clock. Both live sources and files are converted here.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "evalbus/body_pose_t.hpp"
#include "evalbus/contact_t.hpp"
#include "evalbus/state_t.hpp"
#include "models/mujoco_ptr.h"
#include "sim/prepared_scene.h"

namespace evalbus::sim {

// The quantities that the source measures, by their names in MODEL.
struct Measured {
  // All joints of each arm; joints of fingers and of objects only if they are measured.
  std::vector<std::string> joints;
  bool has_velocity = false;
  // Objects whose poses are measured.
  std::vector<std::string> objects;
};

// The measured values at one time.
struct Sample {
  // Time since the first sample, s.
  double time_s = 0;
  // Positions (rad, or m for slide joints) and velocities (rad/s or m/s) in the order of Measured::joints.
  // velocity is empty if only positions were measured.
  std::vector<double> position, velocity;
  // Opening of each gripper of MODEL, from 0 (closed) to 1 (open). nullopt if the opening is computed from
  // the positions of the fingers.
  std::vector<std::optional<double>> opening;
  // Poses in the order of Measured::objects, world frame.
  std::vector<body_pose_t> object;
  // Contacts that the source measured; empty for a source without contacts.
  std::vector<contact_t> contacts{};
};

class MeasuredScene {
 public:
  // A name that does not fit the scene, and an explanation.
  struct Fault {
    std::string name;
    std::string text;
  };
  // Returns the first quantity in `measured` that does not fit the scene; nullopt if all fit.
  static std::optional<Fault> FindFault(const PreparedScene& prepared, const Measured& measured);

  // Marks in MODEL of `prepared` which quantities of this scene are known. prepared must outlive this object.
  // Throws InputError with the text of FindFault.
  MeasuredScene(PreparedScene* prepared, Measured measured, const std::string& source);

  // Returns true for a slide joint, whose position is in m instead of rad.
  bool slides(size_t joint) const { return model_->jnt_type[joints_[joint]] == mjJNT_SLIDE; }

  // Explains why a joint cannot have this position ("45 rad is beyond the range of left/joint2, -1.763 to
  // 1.763; are these degrees?"). Empty if it can. Limits of physics engines are soft, so every joint may be
  // beyond its range by 0.05 rad or m, and a joint of an object by up to 5 % of its range if that is more.
  std::string PositionFault(size_t joint, double position) const;
  // Returns a description of the first number of a sample's positions, velocities and object poses that is
  // not finite or implausible; empty if there is none. The counts of the sample must be correct.
  std::string SampleFault(const Sample& sample) const;
  // Returns a description of an object that is too far from the world's origin in the first sample of an
  // episode, which is probably in the wrong unit; empty if there is none. Later, objects may have fallen out
  // of the scene.
  std::string FirstSampleFault(const Sample& sample) const;
  // Returns a description of the joint of an object that is farthest beyond its range ("first_valve/wheel is
  // beyond its range by 0.051 rad"). Empty if none exceeds its range by more than 0.001 rad or m. Such
  // positions are used unchanged.
  std::string BeyondRange(const Sample& sample) const;

  // Measured fingers of a gripper, as indices into Measured::joints. Empty if there are none.
  const std::vector<size_t>& FingersOf(size_t gripper) const { return fingers_[gripper]; }

  // Returns the state between samples a and b, at the fraction `share` of the time from a to b. before: the
  // previous state, from which velocities are computed; null for the first one.
  state_t At(const Sample& a, const Sample& b, double share, const state_t* before, const header_t& header);

 private:
  const GripperDescription& gripper(size_t index) const { return prepared_->robot.grippers[index]; }
  void SetObjects(const Sample& a, const Sample& b, double share);

  PreparedScene* prepared_;
  const mjModel* model_;
  Measured measured_;
  std::vector<int> joints_;                   // ids of the joints, in the order of Measured
  std::vector<bool> is_of_object_;            // by joint
  std::vector<std::vector<size_t>> fingers_;  // by gripper
  // The scene in its initial state, without measurements.
  DataPtr home_;
  DataPtr data_;
};

// Returns the text for `end_detail` if joints of objects were beyond their ranges. samples: number of samples
// with such a joint; first: place and BeyondRange() of the first such sample.
std::string BeyondRangeText(int64_t samples, const std::string& first);

}  // namespace evalbus::sim
