// Scripted expert for the tasks with one book: a hand presses on the book, which is wider than a hand opens,
// drags it until it overhangs the counter's front edge, takes it there by its thickness and lifts it, or puts
// it on the lower shelf. One arm does it all; of two, the one that can.
#pragma once

#include <optional>

#include "policy_bridge/experts/expert.h"

namespace evalbus::policy {

class SingleBookExpert : public Expert {
 public:
  // For stack_single_book_shelf or pick_single_book_from_table, with any number of arms. Throws InputError if
  // the model lacks the book's geom or the shelf's sites.
  SingleBookExpert(bool to_shelf, const mjModel& model, const model_info_t& info);

 protected:
  std::vector<Motion> Next(const Configuration& now, const state_t& state) override;

 private:
  // Where the book's middle is when it overhangs just as far as a hand needs, x in the world.
  double OverhangingX(const Eigen::Isometry3d& book) const;
  // `plan` and then: the arm drags the book to where Take is possible.
  std::optional<Plan> Drag(const Plan& plan, int arm);
  // `plan` and then: the arm takes the overhanging book and lifts it, or puts it on the shelf.
  std::optional<Plan> Take(const Plan& plan, int arm);

  bool to_shelf_;
  int book_;
  // Half the book's size, m.
  Eigen::Vector3d half_size_;
  // Middles of the front edges of counter and lower board, in the world; m.
  Eigen::Vector3d counter_edge_, board_edge_;
};

}  // namespace evalbus::policy
