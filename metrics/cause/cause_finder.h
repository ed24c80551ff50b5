// Finds the decisive moment of an episode, by the rules in docs/failures.md, and describes it in one
// sentence. Pure.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "evalbus/cause_t.hpp"
#include "evalbus/condition_t.hpp"
#include "metrics/cause/cause_sample.h"
#include "metrics/cause/closings.h"
#include "metrics/cause/collisions.h"
#include "metrics/cause/holds.h"
#include "metrics/cause/progress.h"

namespace evalbus::metrics {

// Values of cause_t.kind. An episode whose end is CauseEnd::By::kOther has the failure reason as its kind
// ("policy_error").
namespace cause_kind {
inline constexpr char kSuccess[] = "success";
inline constexpr char kLostObject[] = "lost_object";
inline constexpr char kEmptyGrasp[] = "empty_grasp";
inline constexpr char kCollision[] = "collision";
inline constexpr char kStall[] = "stall";
inline constexpr char kOutOfTime[] = "out_of_time";
inline constexpr char kMissedCondition[] = "missed_condition";
// The task's failure condition became true, without any of the events above.
inline constexpr char kFailedCondition[] = "failed_condition";
}  // namespace cause_kind

// How the episode ended.
struct CauseEnd {
  enum class By { kSuccess, kFailure, kTime, kOther };
  By by = By::kTime;
  // The failure reason that applies if no event decided the episode; with By::kOther it always applies.
  // `detail` describes it as text. Both may be empty.
  std::string reason;
  std::string detail;
  int64_t last_tick = 0;
  // The conditions that made success or failure true.
  std::vector<condition_t> conditions;
  // False if a stage cannot be determined, because poses of objects are missing.
  bool knows_stages = true;
};

// The decisive moment as data. Members that do not apply keep their default values.
struct CauseMoment {
  std::string kind;
  int64_t tick = 0;
  int gripper = -1, object = -1;
  int arm = -1, entity = -1;
  bool opened = false, closing = false, flickered = false;
  // The gripper put the object down without a fall, in a task that requires its release.
  bool put_down = false;
  bool touches = false;      // a gripper that closed completely touches the object from outside
  bool stayed_open = false;  // a gripper came to the object and did not close
  double lifted = 0;         // m, by how much the object was lifted when it was lost
  // True if the gripper closed again later (tried_again) or held the object again later (held_again).
  bool tried_again = false, held_again = false;
  int lost_again = 0;       // number of later losses of the object by this gripper
  double displacement = 0;  // m
  bool is_shut = false;     // an arm hit an object that its gripper should hold with the gripper closed
  bool fell = false;        // a closed gripper pushed the object, which fell
  bool made_progress = true;
  bool is_undone = false;  // the missed condition was met until this tick
  // After the robot had stopped, the gripper lost the object at this tick; -1: it did not.
  int64_t lost_tick = -1;
};

struct FoundCause {
  cause_t cause;
  // The category of the cause, from the list in docs/metrics.md; empty for a success.
  std::string failure_reason;
};

class CauseFinder {
 public:
  explicit CauseFinder(CauseConfig config);
  CauseFinder(const CauseFinder&) = delete;
  CauseFinder& operator=(const CauseFinder&) = delete;

  void Start();

  // Adds a tick, in tick order; tick 0 is the reset state. stage_reached: whether each stage has been
  // reached. conditions: one list per stage in the task's order, then the conditions of success, as written
  // by TaskEvaluator::ConditionsByStage(). They are not read at tick 0. They must stay valid until Find(),
  // which reads them again.
  void Add(const CauseSample& sample, std::span<const uint8_t> stage_reached,
           std::span<const std::vector<condition_t>> conditions);

  FoundCause Find(const CauseEnd& end) const;

 private:
  // An unmet condition of a stage that was not reached, or of success; `best` may be its best state.
  struct Unmet {
    const condition_t* condition;
    const BestOfCondition* best;
  };

  bool IsOf(const std::string& operand, size_t object) const;
  bool IsAbout(const condition_t& condition, size_t object) const;
  bool IsAboutAny(const std::vector<Unmet>& unmet, size_t object) const;
  bool IsAboutOnly(const condition_t& condition, size_t object) const;
  // The progress of a condition without a number is measured by the distance between two points. `points`
  // lists the pairs. Indices below the number of bodies are bodies; the following ones are the wrists.
  struct Measure {
    std::vector<std::pair<int, int>> points;
    bool farthest = false;  // true: use the largest distance; false: the smallest
  };
  std::vector<int> PointsOf(const std::string& operand) const;
  Measure MeasureOf(const condition_t& condition) const;
  double Distance(const Measure& measure, const CauseSample& sample) const;
  bool StageAbout(size_t object, int64_t after) const;
  bool IsHeldAt(int64_t tick, int object) const;
  bool IsTouchedAtEnd(int object, int gripper) const;
  bool HasFallen(const CauseHold& hold) const;
  bool IsGrasp(const CauseHold& hold) const;
  bool IsPush(const CauseHold& hold) const;
  bool HeldAfter(int64_t tick, int object, int gripper) const;
  bool AsksForHold(size_t object, const std::string& gripper = {}) const;
  bool AsksForLift(size_t object) const;
  bool AsksForRelease(size_t object) const;
  bool IsReleaseAsRequired(const CauseHold& hold) const;
  bool IsPullBeforeLift(const CauseHold& pull) const;
  bool IsMadeGood(const CauseHold& lost) const;
  void AddLosses(const std::vector<Unmet>& unmet, std::vector<CauseMoment>* moments) const;
  bool IsMiss(int gripper, int64_t tick, double distance, const std::vector<Unmet>& unmet,
              size_t object) const;
  void AddEmptyGrasps(const std::vector<Unmet>& unmet, std::vector<CauseMoment>* moments) const;
  bool IsRecent(const CauseHold& hold, const ArmTouch& touch) const;
  bool WasJustHeld(const ArmTouch& touch) const;
  bool WasReleased(const ArmTouch& touch) const;
  bool IsTouchOfGrasp(const ArmTouch& touch) const;
  bool IsOfCommonGrasp(const ArmTouch& touch) const;
  std::optional<CauseMoment> OpenHandAtObject(const std::vector<Unmet>& unmet, int64_t last_tick) const;
  void AddFalls(const std::vector<Unmet>& unmet, std::vector<CauseMoment>* moments) const;
  void AddCollisions(const std::vector<Unmet>& unmet, int64_t last_tick,
                     std::vector<CauseMoment>* moments) const;
  bool LacksHold(const std::string& gripper) const;
  bool LacksOnlyTouch(const std::string& gripper, const std::vector<Unmet>& unmet) const;
  std::optional<CauseMoment> IdleArm(const std::vector<Unmet>& unmet, int64_t last_tick) const;
  std::vector<Unmet> FindUnmet() const;
  CauseMoment MomentWithoutEvent(const std::vector<Unmet>& unmet, const CauseEnd& end) const;
  CauseMoment FindMoment(const std::vector<Unmet>& unmet, const CauseEnd& end) const;
  std::string Reason(const CauseMoment& moment, const std::vector<Unmet>& unmet, const CauseEnd& end) const;
  std::string StillHeld() const;
  std::string Lack(const CauseMoment& moment) const;
  std::string Text(const CauseMoment& moment, const CauseEnd& end) const;
  std::string What(const CauseMoment& moment, const CauseEnd& end) const;
  int64_t Ticks(double seconds) const;
  bool IsSinceLong(int64_t tick, int64_t last_tick) const;
  double Time(int64_t tick) const;

  const CauseConfig config_;
  Holds holds_;
  Closings closings_;
  CauseCollisions collisions_;
  ConditionProgress progress_;
  Rest rest_;                        // of the whole robot
  std::vector<Rest> arm_rest_;       // by arm
  std::vector<int64_t> stage_tick_;  // by stage, -1: not reached
  std::span<const std::vector<condition_t>> conditions_;
  std::vector<Measure> measures_;  // by condition
  std::vector<uint8_t> held_;      // [object * arms + arm]
  std::vector<uint8_t> resting_;   // by arm
  std::vector<double> height_;     // m, height of each object after the last tick
};

}  // namespace evalbus::metrics
