#include "policy_bridge/experts/single_book.h"

#include <algorithm>
#include <cmath>

#include "base/angles.h"
#include "base/errors.h"

namespace evalbus::policy {
namespace {

using Eigen::Isometry3d;
using Eigen::Translation3d;
using Eigen::Vector3d;

// A pad's end is this far beyond its middle.
constexpr double kPadEnd = 0.0085;
// How far below the book's surface a pressing pad is sent: with the arm's stiffness some 25 N.
constexpr double kPress = 0.003;
// A dragged book trails behind the pad if that presses ahead of its middle.
constexpr double kPressAhead = 0.01;
// A hand comes to the book from so far above; after it, it needs room to turn.
constexpr double kBeforePress = 0.05;
constexpr double kAfterPress = 0.15;
// From the middle of a pad to the counter's edge: the pad, and the finger behind it, need 14 mm.
constexpr double kEdgeGap = 0.02;
// From the book's edge to the middle of a pad, which is 17 mm square; deeper, the palm of a hand that comes
// from the side would meet the book.
constexpr double kInset = 0.016;
// More or less overhang than wanted that is still good.
constexpr double kOverhangTolerance = 0.006;
// The task asks for 0.77 - 0.7135 m.
constexpr double kBookLift = 0.085;
// A book comes onto the board from above, and from farther above than Place begins.
constexpr double kAboveBoard = 0.05;
// How much deeper than on the counter the book is put on the shelf.
constexpr double kDeeper = 0.006;
// A book that is higher above the counter does not lie on it.
constexpr double kLies = 0.001;
// Directions of a hand about the vertical, from world x: that takes the book, that presses on it (where its
// pads close).
constexpr double kBookHeadings[] = {60, -60, 40, -40, 20, -20, 0};
constexpr double kPressHeadings[] = {90, 45, 135, 0};
// Sideways ways of a dragged book that are tried.
constexpr double kSideways[] = {0, 0.06, -0.06, 0.12, -0.12, 0.2, -0.2, 0.3, -0.3};

Vector3d Heading(double degrees) { return {std::cos(degrees * kDegree), std::sin(degrees * kDegree), 0}; }

Isometry3d Moved(const Isometry3d& pose, const Vector3d& way) { return Translation3d(way) * pose; }

Vector3d SiteInWorld(const mjModel& model, const model_info_t& info, const std::string& part,
                     const std::string& site) {
  const auto found = std::find(info.body_name.begin(), info.body_name.end(), part);
  if (found == info.body_name.end()) throw InputError("the task has no part \"" + part + "\"");
  const int body = static_cast<int>(found - info.body_name.begin());
  return ToPose(model.body_pos + 3 * body, model.body_quat + 4 * body) *
         SiteInBody(model, part + "/" + site, body).translation();
}

}  // namespace

SingleBookExpert::SingleBookExpert(bool to_shelf, const mjModel& model, const model_info_t& info)
    : Expert(model, info, /*max_attempts=*/6),
      to_shelf_(to_shelf),
      book_(ObjectBody(info, "book")),
      counter_edge_(SiteInWorld(model, info, "shelf", "counter_edge")),
      board_edge_(SiteInWorld(model, info, "shelf", "lower_board_edge")) {
  const int geom = mj_name2id(&model, mjOBJ_GEOM, "book/book");
  if (geom < 0) throw InputError("the model has no geom \"book/book\"");
  half_size_ = Vector3d(model.geom_size + 3 * geom);
}

double SingleBookExpert::OverhangingX(const Isometry3d& book) const {
  const double half_extent = std::min(half_size_.x() / std::max(std::abs(book.linear()(0, 0)), 1e-9),
                                      half_size_.y() / std::max(std::abs(book.linear()(0, 1)), 1e-9));
  return counter_edge_.x() - kEdgeGap + half_extent - kInset;
}

std::optional<Plan> SingleBookExpert::Drag(const Plan& plan, int arm) {
  const Isometry3d book = plan.PoseOf(book_);
  const Vector3d pad = book.translation() + Vector3d(-kPressAhead, 0, half_size_.z() + kPadEnd - kPress);
  for (double heading : kPressHeadings) {
    const Isometry3d press = GripFrame(pad, -Vector3d::UnitZ(), Heading(heading));
    Plan pressing = plan;
    pressing.Close({arm})
        .Reach({{arm, Moved(press, {0, 0, kBeforePress})}})
        .Press(book_, {{arm, press}})
        .CheckContacts(arms_);
    if (!pressing.feasible()) continue;
    for (double sideways : kSideways) {
      Isometry3d there = book;
      there.translation().x() = OverhangingX(book);
      there.translation().y() += sideways;
      const Vector3d way = there.translation() - book.translation() + Vector3d(0, 0, kAfterPress);
      Plan attempt = pressing;
      // Opening while it leaves, the hand is not taken for one that has lost the book.
      attempt.Drag(book_, there)
          .Approach({{arm, Moved(press, way)}})
          .OpenMeanwhile({arm})
          .CheckContacts(arms_);
      if (attempt.feasible() && Take(attempt, arm)) return attempt;
    }
  }
  return std::nullopt;
}

std::optional<Plan> SingleBookExpert::Take(const Plan& plan, int arm) {
  const Isometry3d book = plan.PoseOf(book_);
  const Vector3d pinch(counter_edge_.x() - kEdgeGap, book.translation().y(), book.translation().z());
  for (double heading : kBookHeadings) {
    const Vector3d approach = Heading(heading);
    for (double side : {1.0, -1.0}) {
      const Isometry3d at = GripFrame(pinch, approach, side * Vector3d::UnitZ());
      const Isometry3d before = Moved(at, -kGraspApproach * approach);
      Plan attempt = plan;
      attempt.Swing({{arm, before}})
          .CheckContacts(arms_)
          .Take({{arm, book_, {book.inverse() * before, book.inverse() * at}}})
          .CheckContacts(arms_);
      if (to_shelf_) {
        const Isometry3d on_board = Moved(book, board_edge_ - counter_edge_ + Vector3d(kDeeper, 0, 0));
        attempt.Lift(book_, on_board.translation().z() + kAboveBoard - book.translation().z())
            .Place(book_, on_board)
            .Release({arm});
      } else {
        attempt.Lift(book_, kBookLift);
      }
      attempt.CheckContacts(arms_);
      if (attempt.feasible()) return attempt;
    }
  }
  return std::nullopt;
}

std::vector<Motion> SingleBookExpert::Next(const Configuration& now, const state_t& state) {
  const Isometry3d book = BodyPose(state, book_);
  // It falls, or is held.
  if (book.translation().z() - half_size_.z() - counter_edge_.z() > kLies) return {};
  if (gives_up()) return {};
  ++attempts_;
  const Plan start = MakePlan(now, state);
  const bool overhangs = std::abs(book.translation().x() - OverhangingX(book)) < kOverhangTolerance;
  // The nearer arm first.
  std::vector<int> arms = arms_;
  const auto away = [&](int arm) {
    return std::abs(context().arms[arm].GripPose(context().home.joints[arm]).translation().y() -
                    book.translation().y());
  };
  std::sort(arms.begin(), arms.end(), [&](int a, int b) { return away(a) < away(b); });
  for (int arm : arms) {
    if (overhangs) {
      if (auto plan = Take(start, arm)) return plan->motions();
    }
    if (auto plan = Drag(start, arm)) return plan->motions();
  }
  return {};
}

}  // namespace evalbus::policy
