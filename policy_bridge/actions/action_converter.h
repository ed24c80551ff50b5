// Converts a policy's actions from its action space to joint targets.
#pragma once

#include <mujoco/mujoco.h>

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

// A pose counts as unreachable if the joint targets found for it place the wrist farther than this from it.
inline constexpr double kReachedPosition = 1e-3;  // m
inline constexpr double kReachedRotation = 1e-2;  // rad

// An arm counts as singular if the condition number of its Jacobian (largest / smallest singular value, with
// m and rad unscaled) exceeds this. MoveIt Servo stops an arm at the same value by default
// (hard_stop_singularity_threshold).
inline constexpr double kSingularCondition = 30;
double ConditionNumber(const Jacobian& jacobian);

// Returns the pose, in the world frame, of the body to which the arm's first link is attached
// (ActionFrame::kBase). It is constant.
Eigen::Isometry3d BasePose(const mjModel& model, const arm_info_t& arm);

// Converts the rows of action chunks. Deterministic. Allocates memory only in the constructor and in the
// first Convert().
class ActionConverter {
 public:
  // Throws InputError (one line) if the space is inconsistent or does not fit the robot of `info`. Examples
  // are an unknown arm, a wrong number of indices, an index that is out of range or used twice, an absolute
  // pose in the wrist's own frame, or an invalid gripper block.
  ActionConverter(const ActionSpace& space, const mjModel& model, const model_info_t& info);

  const ActionSpace& space() const { return space_; }

  // Begins an episode: discards the targets and gripper states of the previous episode.
  void Begin();

  // Converts one row (num_values values) of the policy into the command for the tick of `state`. step_s:
  // duration of one step of the policy. Fills all members of `action` but header and errors. Arms that are
  // not in the space stay at home with open grippers.
  //
  // Joint kinds: a target beyond the joint limits is passed on unchanged, because the sim clips it and counts
  // the clip. The target that the next delta is added to is kept within the limits.
  //
  // Eef kinds: inverse kinematics within the joint limits, starting from the last joint target; a redundant
  // arm stays near that target. If a position is beyond the arm's length, it is first moved to within it. A
  // pose out of reach is then replaced by the nearest pose that the search finds (least sum of squares of
  // meters and radians). If the search misses an eef_pose by more than 5 cm or 0.2 rad, it is repeated from
  // home, and the second result is used if it is much nearer. unreachable_poses and singular_poses count the
  // poses of this row.
  //
  // Throws std::runtime_error (one line with the index and value) if the policy's numbers are invalid (NaN,
  // infinity, not a rotation, a row of the wrong length), or if `state` belongs to another robot. After an
  // exception, only Begin() may be called.
  void Convert(std::span<const double> row, const state_t& state, double step_s, action_t* action);

  // Returns the inverse of Convert(): the row that moves the robot in one step from joint positions `from`
  // (the last target or the measurement, depending on the space) to `to`. Absolute kinds ignore `from`.
  // Values that no arm uses count as 0 before scale and offset are inverted. Values are neither thresholded
  // nor clipped. A value with scale 0 is 0.
  std::vector<double> RowOf(const Configuration& from, const Configuration& to, double step_s) const;

 private:
  struct ArmPart {
    ArmForm form;
    int index;            // index in MODEL
    int first_joint = 0;  // index in action_t.joint_position_rad
    int num_joints;
    int gripper = -1;  // index in MODEL
    GripperCommand gripper_command;
    JointVector lower, upper;            // rad
    std::optional<ArmChain> chain = {};  // set for eef kinds only, like the members below
    Eigen::Isometry3d base, point;       // base: world frame; point: wrist frame
    double reach = 0;                    // m, upper bound of the wrist's distance from the base's origin
    // State of the episode: the target that the next delta is added to, and the initial orientation.
    JointVector target = {};
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
  // The row after scaling, offset and clipping.
  std::vector<double> values_;
};

}  // namespace evalbus::policy
