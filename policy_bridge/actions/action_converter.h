// Makes joint targets of what a policy says in its action space.
#pragma once

#include <mujoco/mujoco.h>

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "evalbus/action_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "evalbus/state_t.hpp"
#include "policy_bridge/actions/action_space.h"
#include "policy_bridge/actions/gripper.h"
#include "policy_bridge/planning/kinematics.h"
#include "policy_bridge/planning/robot.h"

namespace evalbus::policy {

// A pose counts as unreachable where the joint targets made of it leave the wrist farther away than this.
inline constexpr double kReachedPosition = 1e-3;  // m
inline constexpr double kReachedRotation = 1e-2;  // rad

// An arm counts as singular where the condition number of its Jacobian (largest by smallest singular value, m
// and rad as they are) is larger. That is where MoveIt Servo's default (hard_stop_singularity_threshold)
// stops an arm.
inline constexpr double kSingularCondition = 30;
double ConditionNumber(const Jacobian& jacobian);

// Pose in the world of the body that the arm's first link turns on: the frame ActionFrame::kBase. Does not
// change.
Eigen::Isometry3d BasePose(const mjModel& model, const arm_info_t& arm);

// Deterministic; no allocation but in the constructor and in the first Convert().
class ActionConverter {
 public:
  // Throws InputError, one line, where the space does not fit itself or the robot of `info`: an unknown arm
  // (with what it may have meant), a wrong number of indices, an index out of range or taken twice, a pose in
  // the wrist's own frame, scales of another length, a gripper block that means nothing.
  ActionConverter(const ActionSpace& space, const mjModel& model, const model_info_t& info);

  const ActionSpace& space() const { return space_; }

  // An episode begins: forgets targets and grippers of the last one.
  void Begin();

  // Makes the command of `state`'s tick of one row (num_values values) of the policy; step_s is how long the
  // policy holds it. Fills all of `action` but header and errors. Arms that the space does not have are at
  // home, their grippers open.
  //
  // Joint kinds: the target as the policy says it, beyond the limits too, where the sim clips and counts it;
  // what the next step adds to is within the limits. Eef kinds: inverse kinematics from the last joint
  // target, which the arm stays near to in its redundancy, within the joints' limits. A pose out of reach
  // becomes the nearest one that the search finds (least sum of squares of meters and radians), a position
  // beyond the arm's length having been pulled to that. Where an eef_pose is missed by more than 5 cm or 0.2
  // rad, home is tried as a start, too. unreachable_poses and singular_poses are those of this row.
  //
  // Throws std::runtime_error, one line that says which value and what it is, where the policy's numbers mean
  // nothing (NaN, infinity, a rotation that is none, a row of another length), and where `state` is not of
  // this robot; the episode is over then, Begin() comes next.
  void Convert(std::span<const double> row, const state_t& state, double step_s, action_t* action);

  // The other way: the row that brings the robot in one step from joint positions `from` (the last target, or
  // the measurement, as the space has it) to `to`; `from` does not matter to absolute kinds. Values that no
  // arm takes are 0. Neither rounded to thresholds nor clipped, and a value of scale 0 stays 0.
  std::vector<double> RowOf(const Configuration& from, const Configuration& to, double step_s) const;

 private:
  struct ArmPart {
    ArmForm form;
    int index;        // in MODEL
    int first_joint;  // in action_t.joint_position_rad
    int num_joints;
    int gripper = -1;  // in MODEL
    GripperCommand gripper_command;
    JointVector lower, upper;       // rad
    std::optional<ArmChain> chain;  // eef kinds only, as all that follows
    Eigen::Isometry3d base, point;  // in the world; in the wrist frame
    double reach = 0;               // m from the base's origin, at least as far as the wrist comes
    // Of the episode: what the next step adds to, and the orientation that it began with.
    JointVector target;
    Eigen::Matrix3d first_rotation;
  };

  bool is_joint_kind() const;
  bool is_absolute() const;
  void CheckSpace() const;
  ArmPart MakeArm(const ArmForm& form, const mjModel& model, const model_info_t& info) const;
  void ReadRow(std::span<const double> row);
  JointVector Measured(const ArmPart& arm, const state_t& state) const;
  Eigen::Isometry3d TargetPose(const ArmPart& arm, const JointVector& from) const;

  ActionSpace space_;
  std::vector<ArmPart> arms_;
  std::vector<double> home_;  // rad, all arms
  size_t num_arms_ = 0, num_grippers_ = 0;
  bool has_begun_ = false;
  // The row after scale, offset and clip.
  std::vector<double> values_;
};

}  // namespace evalbus::policy
