// Scripted expert for the tasks with one book. The book is wider than a hand opens, so it must overhang the
// counter's front edge. If it does not overhang enough, the fingers go down behind it and pull it. Then a
// hand grasps it there by its thickness, and lifts it or puts it on the lower shelf. One arm does everything;
// with two arms, the one that can.
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
  // How far the book overhangs the counter's front edge, on the line through its middle, m; negative behind
  // the edge.
  double Overhang(const Eigen::Isometry3d& book) const;
  // Extends `plan`: the arm pulls the book to where Take is possible.
  std::optional<Plan> Pull(const Plan& plan, int arm);
  // How the fingers go behind the book, world frame.
  struct Hook {
    Eigen::Vector3d face;  // middle of the face behind which they go, m
    Eigen::Vector3d out;   // out of that face, away from the robot; unit vector
    double way;            // by which they pull the book, m
    double lean;           // of the hand from the vertical, its wrist toward the robot, rad
    double turned;         // 1 or -1: which finger is on which side
  };
  // Extends `plan`: the arm pulls the book in this way, then takes it.
  std::optional<Plan> PullAndTake(const Plan& plan, int arm, const Hook& hook);
  // Extends `plan`: the arm takes the overhanging book, and lifts it or puts it on the shelf.
  std::optional<Plan> Take(const Plan& plan, int arm);

  bool to_shelf_;
  int book_;
  // Half extents of the book, its middle and its center of mass in its frame, m.
  Eigen::Vector3d half_size_, middle_, center_of_mass_;
  // Middle of the front edge of the counter and of the lower board, in the world frame; m.
  Eigen::Vector3d counter_edge_, board_edge_;
};

}  // namespace evalbus::policy
