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

// Distance from a pad's middle to its end, m.
constexpr double kPadEnd = 0.0085;
// Depth below the book's surface to which a pressing pad is commanded, m: about 25 N at the arm's stiffness.
constexpr double kPress = 0.003;
// A book trails straight behind the pad if the pad presses this far (m) ahead of the book's middle.
constexpr double kPressAhead = 0.01;
// Height above the book from which a hand comes down, and to which it rises to have room to turn, m.
constexpr double kBeforePress = 0.05;
constexpr double kAfterPress = 0.15;
// Distance of a pad's middle from the counter's edge, m; the pad and the finger behind it need 14 mm.
constexpr double kEdgeGap = 0.02;
// Distance of a pad's middle from the book's edge, m; a pad is 17 mm square. Any deeper, the palm of a hand
// that comes from the side would touch the book.
constexpr double kInset = 0.016;
// Accepted deviation from the intended overhang, m.
constexpr double kOverhangTolerance = 0.006;
// The task requires 0.77 - 0.7135 m.
constexpr double kBookLift = 0.085;
// Height above the board at which a book arrives, m; higher than where Place starts.
constexpr double kAboveBoard = 0.05;
// How much deeper than on the counter the book is put on the shelf, m.
constexpr double kDeeper = 0.006;
// A book that is higher than this above the counter (m) does not lie on it.
constexpr double kLies = 0.001;
// Headings of a hand, in degrees from the world x axis: when it takes the book, and (closing direction of its
// pads) when it presses on it.
constexpr double kBookHeadings[] = {60, -60, 40, -40, 20, -20, 0};
constexpr double kPressHeadings[] = {90, 45, 135, 0};
// Sideways displacements of a dragged book to try, m.
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
      // The hand opens while it moves away. If it opened later, it would look as if it had lost the book.
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
  // The book is falling, or a hand holds it.
  if (book.translation().z() - half_size_.z() - counter_edge_.z() > kLies) return {};
  if (gives_up()) return {};
  ++attempts_;
  const Plan start = MakePlan(now, state);
  const bool overhangs = std::abs(book.translation().x() - OverhangingX(book)) < kOverhangTolerance;
  // Try the nearer arm first.
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
