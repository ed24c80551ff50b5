// Scripted expert for the tasks with one book. The book is wider than a hand opens, so a hand presses on it,
// drags it until it overhangs the counter's front edge, grasps it there by its thickness, and lifts it or
// puts it on the lower shelf. One arm does everything; with two arms, the one that can.
#pragma once

#include <optional>

#include "policy_bridge/experts/expert.h"

namespace evalbus::policy {

class SingleBookExpert : public Expert {
 public:
  // For the tasks stack_single_book_shelf and pick_single_book_from_table, with any number of arms. Throws
  // InputError if the model lacks the book's geom or the shelf's sites.
  SingleBookExpert(bool to_shelf, const mjModel& model, const model_info_t& info);

 protected:
  std::vector<Motion> Next(const Configuration& now, const state_t& state) override;

 private:
  // x coordinate (world frame) of the book's middle at which it overhangs just as far as a hand needs, m.
  double OverhangingX(const Eigen::Isometry3d& book) const;
  // Extends `plan`: the arm drags the book to where Take is possible.
  std::optional<Plan> Drag(const Plan& plan, int arm);
  // Extends `plan`: the arm takes the overhanging book, and lifts it or puts it on the shelf.
  std::optional<Plan> Take(const Plan& plan, int arm);

  bool to_shelf_;
  int book_;
  // Half extents of the book, m.
  Eigen::Vector3d half_size_;
  // Middle of the front edge of the counter and of the lower board, in the world frame; m.
  Eigen::Vector3d counter_edge_, board_edge_;
};

}  // namespace evalbus::policy
