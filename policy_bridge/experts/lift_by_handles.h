// Scripted expert for LiftPot and LiftTray: each hand grasps a handle of the object, then both lift it and
// keep it level. If the object is out of reach for two arms at once, one hand first drags it nearer.
#pragma once

#include <optional>
#include <string>

#include "policy_bridge/experts/expert.h"

namespace evalbus::policy {

struct HandledObject {
  // Object of the task. Its file has the sites left_handle and right_handle in the middle of two bars along
  // the object's x axis, on +y and -y.
  std::string name;
  // Position that both arms reach best. A dragged object is moved by one of these fractions of the distance
  // to it: the first one that allows a lift.
  Eigen::Vector2d sweet_spot;  // m
  std::vector<double> drags;
  // If the object's origin is farther to the left (+y) than this (m), it is dragged first.
  double max_y;
};

class LiftByHandlesExpert : public Expert {
 public:
  // Throws InputError if the model lacks the object or one of its handle sites, or does not have two arms.
  LiftByHandlesExpert(const HandledObject& object, const mjModel& model, const model_info_t& info);

  void Begin(const episode_begin_t& begin) override;

 protected:
  std::vector<Motion> Next(const Configuration& now, const state_t& state) override;

 private:
  // Grasps of a handle, the most upright first.
  std::vector<Grasp> Grasps(int handle) const;
  // Whether the arm can grasp and raise the object this way after `plan`.
  bool CanTake(const Plan& plan, int arm, const Eigen::Isometry3d& object, const Grasp& grasp) const;
  // Extends `plan`: both hands lift the object from its current position. Nothing if that is impossible.
  std::optional<Plan> Lift(const Plan& plan, const Eigen::Isometry3d& object) const;
  // Extends `plan`: one hand drags the object to where Lift is possible.
  std::optional<Plan> Drag(const Plan& plan, const Eigen::Isometry3d& object) const;
  // Whether the object has not moved for a while; some tasks drop it onto its support.
  bool IsAtRest(const state_t& state);

  HandledObject object_;
  int body_;
  // Index of the object's free joint in qvel.
  int velocity_;
  // Middle of the left and right handle bar, in the object's frame; m.
  Eigen::Vector3d handles_[2];
  // Time at which it last moved, us.
  int64_t moved_us_ = 0;
  // Height of its origin when first at rest, m.
  double start_height_ = 0;
};

}  // namespace evalbus::policy
