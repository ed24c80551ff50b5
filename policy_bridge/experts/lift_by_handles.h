// Scripted expert for LiftPot and LiftTray: each hand grasps a handle of the object, then both lift it and
// hold it level. Where the object is out of reach of both arms at once, one hand first drags it nearer.
#pragma once

#include <optional>
#include <string>

#include "policy_bridge/experts/expert.h"

namespace evalbus::policy {

struct HandledObject {
  // Object of the task; its file has the sites left_handle and right_handle in the middle of two bars along
  // the object's x, on +y and -y.
  std::string name;
  // Where both arms reach best; a dragged object goes this fraction of the way there, the first that allows a
  // lift.
  Eigen::Vector2d sweet_spot;  // m
  std::vector<double> drags;
  // Where the object's origin is further to the left than this (m), it is dragged first.
  double max_y;
};

class LiftByHandlesExpert : public Expert {
 public:
  // Throws InputError if the model lacks the object or one of its handles' sites, or has not two arms.
  LiftByHandlesExpert(const HandledObject& object, const mjModel& model, const model_info_t& info);

  void Begin(const episode_begin_t& begin) override;

 protected:
  std::vector<Motion> Next(const Configuration& now, const state_t& state) override;

 private:
  // Ways to take a handle, the most upright first.
  std::vector<Grasp> Grasps(int handle) const;
  // True if the arm can take and raise the object so, following `plan`.
  bool CanTake(const Plan& plan, int arm, const Eigen::Isometry3d& object, const Grasp& grasp) const;
  // `plan` and then: both hands lift the object from where it stands. Nothing if that is impossible.
  std::optional<Plan> Lift(const Plan& plan, const Eigen::Isometry3d& object) const;
  // `plan` and then: one hand drags the object to where Lift is possible.
  std::optional<Plan> Drag(const Plan& plan, const Eigen::Isometry3d& object) const;
  // True once the object has not moved for a while; some tasks drop it onto its support.
  bool IsAtRest(const state_t& state);

  HandledObject object_;
  int body_;
  // Of the object's free joint in qvel.
  int velocity_;
  // Middle of the handles' bars in the object's frame, left and right; m.
  Eigen::Vector3d handles_[2];
  // When it was last seen moving, us.
  int64_t moved_us_ = 0;
  // Height of its origin when at rest at first, m.
  double start_height_ = 0;
};

}  // namespace evalbus::policy
