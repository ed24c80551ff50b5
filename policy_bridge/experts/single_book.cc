// Scripted expert for the tasks with one book. The book is wider than a hand can open, so a hand can grasp it
// only by its thickness, where it overhangs the counter's front edge. If the book does not overhang enough,
// the fingers go down behind it and pull it. Then the hand grasps the overhanging part, and lifts the book or
// puts it on the lower shelf. One arm does everything. If the robot has two arms, the expert uses an arm that
// has a feasible plan.
#include <algorithm>
#include <cmath>
#include <optional>

#include "base/angles.h"
#include "base/errors.h"
#include "policy_bridge/experts/experts.h"

namespace evalbus::policy {
namespace {

using Eigen::Isometry3d;
using Eigen::Translation3d;
using Eigen::Vector3d;

// kPadEnd: distance from a pad's middle to its end, m. kFinger: half the thickness of a finger, m.
constexpr double kPadEnd = 0.0085;
constexpr double kFinger = 0.0105;
// The fingers can pull at a face of the book if its outward normal is within this angle of the direction away
// from the robot.
constexpr double kMaxOblique = 50 * kDegree;
// Angles between a pulling hand and the vertical, with the wrist toward the robot. A larger angle reduces the
// torque at the wrist.
constexpr double kPullLeans[] = {30 * kDegree, 40 * kDegree, 20 * kDegree};
// kAboveCounter: height of the finger tips above the counter, m. kBehind: distance of the fingers from the
// book before they pull, m.
constexpr double kAboveCounter = 0.005;
constexpr double kBehind = 0.015;
// Distance by which the fingers are commanded into the book, m. It compensates for the deflection of the arm
// under the book's friction of 59 N.
constexpr double kYield = 0.004;
// Distance by which the fingers are commanded into a book that is pulled as far as its balance allows, m. It
// is larger, because the pull must not stop short of that position.
constexpr double kFullYield = 0.017;
// Height from which a hand comes down behind the book, and to which it rises, m.
constexpr double kOver = 0.05;
// Distance of a pad's middle from the counter's edge, m. The finger needs 10.5 mm, or 13.4 mm if it is
// oblique.
constexpr double kEdgeGap = 0.0165;
// Limits of the distance of a pad's middle from the book's edge, m. kMinInset: a pad of 17 x 17 mm still
// holds the book. kMaxInset: the palm still has room. A book must be pulled so far that kPulledInset is
// possible, so that the hand stays clear of the counter.
constexpr double kMinInset = 0.0165;
constexpr double kMaxInset = 0.0255;
constexpr double kPulledInset = 0.028;
// Distance of a pad's middle from the book's middle along the edge, m.
constexpr double kBeside = 0.025;
// Minimum distance between the counter's edge and the center of mass of a pulled book, m. The book would tip
// otherwise.
constexpr double kBalance = 0.008;
// Speed at which a book is carried, m/s. It is high, because the fingers bounce and the book slowly slips out
// of them.
constexpr double kCarrySpeed = 0.6;
// Commanded lift, m. The task requires a lift of 0.77 - 0.7157 m, and the arm sags by 0.02 m under the book.
constexpr double kBookLift = 0.12;
// Commanded heights above the board, m: kAboveBoard where a book arrives, kOnBoard where it is released. The
// real heights are lower, because the arm sags.
constexpr double kAboveBoard = 0.07;
constexpr double kOnBoard = 0.012;
// The hand moves in below the shelf's board from a point that is this far (m) in front of its place behind
// the book, and returns to that point.
constexpr double kAway = 0.12;
// Heights (m) by which the hand then rises, to have room to turn.
constexpr double kRises[] = {0.12, 0.06, 0};
// A book that is higher than this above the counter (m) does not lie on the counter.
constexpr double kLies = 0.001;
// Headings of a hand that takes the book, in degrees from the world x axis.
constexpr double kBookHeadings[] = {60, -60, 75, -75, 45, -45, 30, -30, 15, -15, 0};

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

class SingleBookExpert : public Expert {
 public:
  // to_shelf: true for the task stack_single_book_shelf, false for pick_single_book_from_table. The robot may
  // have any number of arms. Throws InputError if the model lacks the book's geom or the shelf's sites.
  SingleBookExpert(bool to_shelf, const mjModel& model, const model_info_t& info);

 protected:
  std::vector<Motion> Next(const Configuration& now, const state_t& state) override;

 private:
  // Returns the length by which the book overhangs the counter's front edge, on the line through its middle,
  // m. Negative if the book is behind the edge.
  double Overhang(const Eigen::Isometry3d& book) const;
  // Returns the outward normal, in the world frame, of the book's face that points most toward the robot.
  static Eigen::Vector3d Facing(const Eigen::Isometry3d& book);
  // Returns `plan` extended by the motions in which the arm pulls the book to a position from which Take is
  // possible; nullopt if there is none.
  std::optional<Plan> Pull(const Plan& plan, int arm);
  // Candidate for a pull: how the fingers hook behind the book, in the world frame.
  struct Hook {
    Eigen::Vector3d face;  // middle of the face that the fingers pull, m
    Eigen::Vector3d out;   // outward normal of that face, away from the robot; unit vector
    double way;            // length of the pull, m
    double lean;           // angle of the hand from the vertical, with the wrist toward the robot, rad
    double turned;         // 1 or -1: which finger is on which side
    bool to_balance;       // whether the book's balance limits `way`
  };
  // Returns `plan` extended by the motions in which the arm pulls the book with `hook`, then takes it. If the
  // book's balance limits the distance, the book's final position must be known to the millimeter. In this
  // case, Take is only checked; it is planned after the pull, from the real position of the book.
  std::optional<Plan> PullAndTake(const Plan& plan, int arm, const Hook& hook);
  // Returns `plan` extended by the motions in which the arm takes the overhanging book, and lifts it or puts
  // it on the shelf.
  std::optional<Plan> Take(const Plan& plan, int arm);

  bool to_shelf_;
  int book_;
  // Half extents, middle and center of mass of the book, in its own frame, m.
  Eigen::Vector3d half_size_, middle_, center_of_mass_;
  // Middle of the front edge of the counter and of the lower board, in the world frame; m.
  Eigen::Vector3d counter_edge_, board_edge_;
};

}  // namespace

SingleBookExpert::SingleBookExpert(bool to_shelf, const mjModel& model, const model_info_t& info)
    : Expert(model, info, /*max_attempts=*/6),
      to_shelf_(to_shelf),
      book_(ObjectBody(info, "book")),
      counter_edge_(SiteInWorld(model, info, "shelf", "counter_edge")),
      board_edge_(SiteInWorld(model, info, "shelf", "lower_board_edge")) {
  context().limits.carry_speed = kCarrySpeed;
  const int geom = mj_name2id(&model, mjOBJ_GEOM, "book/book");
  if (geom < 0) throw InputError("the model has no geom \"book/book\"");
  half_size_ = Vector3d(model.geom_size + 3 * geom);
  middle_ = Vector3d(model.geom_pos + 3 * geom);
  center_of_mass_ = Vector3d(model.body_ipos + 3 * model.geom_bodyid[geom]);
}

double SingleBookExpert::Overhang(const Isometry3d& book) const {
  const double half_extent = std::min(half_size_.x() / std::max(std::abs(book.linear()(0, 0)), 1e-9),
                                      half_size_.y() / std::max(std::abs(book.linear()(0, 1)), 1e-9));
  return counter_edge_.x() - (book * middle_).x() + half_extent;
}

Vector3d SingleBookExpert::Facing(const Isometry3d& book) {
  Vector3d best = Vector3d::UnitX();
  for (const int axis : {0, 1}) {
    for (const double side : {1.0, -1.0}) {
      const Vector3d out = side * book.linear().col(axis);
      if (out.x() < best.x()) best = out;
    }
  }
  return best;
}

std::optional<Plan> SingleBookExpert::Pull(const Plan& plan, int arm) {
  const Isometry3d book = plan.PoseOf(book_);
  for (const int axis : {0, 1}) {
    for (const double side : {1.0, -1.0}) {
      const Vector3d out = side * book.linear().col(axis);
      if (out.x() < std::cos(kMaxOblique)) continue;
      const double balance = (book * center_of_mass_).x() - counter_edge_.x() - kBalance;
      const double wanted = kEdgeGap + kPulledInset - Overhang(book);
      const double way = std::min(wanted, balance) / out.x();
      if (way <= 0) continue;
      const Vector3d face = book * middle_ + half_size_[axis] * out;
      for (const double lean : kPullLeans) {
        for (const double turned : {1.0, -1.0}) {
          if (auto taken = PullAndTake(plan, arm, {face, out, way, lean, turned, balance < wanted}))
            return taken;
        }
      }
    }
  }
  return std::nullopt;
}

std::optional<Plan> SingleBookExpert::PullAndTake(const Plan& plan, int arm, const Hook& hook) {
  const Isometry3d book = plan.PoseOf(book_);
  const Vector3d &out = hook.out, up = Vector3d::UnitZ(), along = up.cross(out);
  const Vector3d line = hook.face + along.dot(book * center_of_mass_ - hook.face) * along;
  const Vector3d approach = -std::cos(hook.lean) * up + std::sin(hook.lean) * out;
  const double tip = counter_edge_.z() + kAboveCounter + kFinger * std::sin(hook.lean);
  // A leaning finger touches the book at its upper edge.
  const double top = hook.face.z() + half_size_.z();
  const double behind = (top - tip) * std::tan(hook.lean) + kFinger / std::cos(hook.lean);
  const auto grip = [&](double gap) {
    Vector3d end = line + (behind + gap) * out;
    end.z() = tip;
    return GripFrame(end - kPadEnd * approach, approach, hook.turned * along);
  };
  const Isometry3d there = Moved(book, -hook.way * out), before = grip(kBehind),
                   pulling = grip(hook.to_balance ? -kFullYield : -kYield);
  const Isometry3d after = Moved(before, there.translation() - book.translation());
  const Vector3d over = kOver * up, away = over - kAway * out;
  Plan pulled = plan;
  // The hand opens while it moves away. If it opened later, it would look like a hand that has lost the book.
  pulled.Close({arm})
      .Reach({{arm, Moved(before, away)}})
      .Reach({{arm, Moved(before, over)}})
      .Approach({{arm, before}})
      .Press(book_, {{arm, pulling}})
      .Drag(book_, there)
      .Approach({{arm, after}})
      .Approach({{arm, Moved(after, over)}})
      .OpenMeanwhile({arm})
      .Reach({{arm, Moved(after, away)}})
      .CheckContacts(arms_);
  for (const double rise : kRises) {
    if (!pulled.feasible()) break;
    Plan risen = pulled;
    risen.Reach({{arm, Moved(after, away + rise * up)}}).CheckContacts(arms_);
    if (auto taken = Take(risen, arm)) return hook.to_balance ? risen : taken;
  }
  return std::nullopt;
}

std::optional<Plan> SingleBookExpert::Take(const Plan& plan, int arm) {
  if (!plan.feasible()) return std::nullopt;
  const Isometry3d book = plan.PoseOf(book_);
  const Vector3d out = Facing(book), along = Vector3d::UnitZ().cross(out);
  const Vector3d size = (book.linear().transpose() * out).cwiseAbs();
  const Vector3d face = book * middle_ + size.dot(half_size_) * out;
  const std::pair<double, double> places[] = {{-kBeside, 1}, {-kBeside, 0.5}, {-kBeside, 0},
                                              {kBeside, 1},  {kBeside, 0.5},  {kBeside, 0}};
  for (const auto& [beside, part] : places) {
    for (double heading : kBookHeadings) {
      const Vector3d approach = Heading(heading);
      // The grasp is beside the middle, because the palm has no room in front of the marker. If possible, it
      // is on the side from which the hand comes.
      const Vector3d edge = face + (approach.dot(along) > 0 ? beside : -beside) * along;
      const double most = std::min((edge.x() - counter_edge_.x() + kEdgeGap) / out.x(), kMaxInset);
      if (most < kMinInset) continue;
      const Vector3d pinch = edge - (kMinInset + part * (most - kMinInset)) * out;
      for (double side : {1.0, -1.0}) {
        const Isometry3d at = GripFrame(pinch, approach, side * Vector3d::UnitZ());
        const Isometry3d before = Moved(at, -kGraspApproach * approach);
        Plan attempt = plan;
        attempt.Swing({{arm, before}})
            .CheckContacts(arms_)
            .Take({{arm, book_, {book.inverse() * before, book.inverse() * at}}})
            .CheckContacts(arms_);
        if (to_shelf_) {
          const Isometry3d on_board = Moved(book, board_edge_ - counter_edge_ + Vector3d(0, 0, kOnBoard));
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
  }
  return std::nullopt;
}

std::vector<Motion> SingleBookExpert::Next(const Configuration& now, const state_t& state) {
  const Isometry3d book = BodyPose(state, book_);
  // The book does not lie on the counter: it is falling, or a hand holds it.
  if ((book * middle_).z() - half_size_.z() - counter_edge_.z() > kLies) return {};
  if (gives_up()) return {};
  ++attempts_;
  const Plan start = MakePlan(now, state);
  const bool overhangs = Overhang(book) >= kEdgeGap + kMinInset;
  // The nearer arm is tried first.
  std::vector<int> arms = arms_;
  const auto away = [&](int arm) {
    return std::abs(context().arms[arm].GripPose(context().home.joints[arm]).translation().y() -
                    (book * middle_).y());
  };
  std::sort(arms.begin(), arms.end(), [&](int a, int b) { return away(a) < away(b); });
  // The planning budget of one tick may not suffice for the whole search, so every second attempt begins with
  // the other arm.
  if (attempts_ % 2 == 0) std::reverse(arms.begin(), arms.end());
  for (int arm : arms) {
    if (overhangs) {
      if (auto plan = Take(start, arm)) return plan->motions();
    }
    if (auto plan = Pull(start, arm)) return plan->motions();
  }
  return {};
}

std::unique_ptr<Expert> MakeSingleBookExpert(bool to_shelf, const mjModel& model, const model_info_t& info) {
  return std::make_unique<SingleBookExpert>(to_shelf, model, info);
}

}  // namespace evalbus::policy
