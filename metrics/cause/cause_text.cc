#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "base/text.h"
#include "lcmtypes/end_reason.h"
#include "metrics/cause/cause_finder.h"
#include "metrics/task/predicate.h"

namespace evalbus::metrics {
namespace {

// Adds the kind of the part to its name: "left" -> "left gripper".
std::string PartOf(const std::string& name, const char* part) {
  const std::string words = Words(name);
  return words == part || words.ends_with(std::string(" ") + part) ? words : words + " " + part;
}

// Removes the limit: "height of pot 1.099 m >= 1.096" -> "height of pot 1.099 m".
std::string WithoutLimit(const condition_t& condition) {
  for (const std::string_view relation : {" >= ", " <= "}) {
    const size_t at = condition.text.rfind(relation);
    if (condition.has_value && at != std::string::npos) return Words(condition.text.substr(0, at));
  }
  return Words(condition.text);
}

// Returns whether the condition requires the condition before it to be met for some time.
bool IsDuration(const condition_t& condition) { return condition.predicate == "lasts"; }

// Lists the conditions that compare numbers; all conditions if none does, or if a duration would be listed
// without the condition that precedes it.
std::string Listed(const std::vector<condition_t>& conditions) {
  const bool has_numbers = std::ranges::any_of(conditions, [](const auto& c) { return c.has_value != 0; });
  const bool lists_all = !has_numbers || std::ranges::any_of(conditions, IsDuration);
  std::vector<std::string> texts;
  for (const condition_t& condition : conditions) {
    if (!lists_all && !condition.has_value) continue;
    const std::string text = WithoutLimit(condition);
    if (std::ranges::find(texts, text) == texts.end()) texts.push_back(text);
  }
  std::string list;
  for (const std::string& text : texts) list += (list.empty() ? "" : ", ") + text;
  return list;
}

// Returns, for example, "height of pot reached 0.997 m, at least 1.096 m is needed", "height of pot reached
// 1.097 m and was 0.951 m at the end, at least 1.096 m is needed", "height of pot stayed at 0.996 m, at least
// 1.096 m is needed", or "condition not met: left holds pot". The value at the end is stated if the condition
// was met before, and, for a missed condition, if at least half of the approach to it was lost again.
std::string Reached(const condition_t& condition, const BestOfCondition& best, bool is_missed) {
  const std::string text = Words(condition.text);
  // The value of `lasts` is a duration. Its text may contain the limit of its operand, for example "at least
  // 0.1 m", which must not be compared with that duration.
  if (IsDuration(condition)) return "condition not met: " + text;
  for (const std::string_view limit : {" at least ", " at most ", " between "}) {
    const size_t at = text.find(limit);
    const std::string quantity = text.substr(0, at);
    if (at == std::string::npos || std::isnan(best.value) || quantity.ends_with(" not")) continue;
    const auto shown = [&](double value) {
      const double threshold = condition.threshold_mixed;
      // A number that is tiny beside the limit is noise of the simulation.
      if (std::abs(value) < 1e-3 * std::abs(threshold)) value = 0;
      const std::string relation = condition.comparison == ">=" ? (value >= threshold ? ">=" : "<")
                                                                : (value <= threshold ? "<=" : ">");
      return Compared(value, relation, threshold, condition.unit).value;
    };
    const double lost = GapOfNumber(condition) - best.gap;
    const bool is_undone = best.gap == 0 || (is_missed && lost >= 0.1 * best.first_gap &&
                                             lost >= 0.5 * (best.first_gap - best.gap));
    const std::string at_end = is_undone ? " and was " + shown(condition.value_mixed) + " at the end" : "";
    const bool stayed = best.progress_tick == 0 && shown(best.value) == shown(condition.value_mixed);
    return fmt::format("{} {} {}{}, {} is needed", quantity, stayed ? "stayed at" : "reached",
                       shown(best.value), at_end, text.substr(at + 1));
  }
  return "condition not met: " + text;
}

}  // namespace

// Returns a description of the event, without its time.
std::string CauseFinder::What(const CauseMoment& moment, const CauseEnd& end) const {
  const std::string gripper =
      moment.gripper < 0 ? "" : Capitalized(PartOf(config_.grippers[moment.gripper], "gripper"));
  const std::string object = moment.object < 0 ? "" : "the " + Words(config_.objects[moment.object]);
  const std::string at = fmt::format(" at {:.2f} s", Time(moment.tick));
  if (moment.kind == cause_kind::kSuccess) {
    const std::string list = Listed(end.conditions);
    return "Success" + at + (list.empty() ? "" : ": " + list);
  }
  if (moment.kind == cause_kind::kLostObject) {
    std::string text = gripper;
    text += moment.put_down    ? " put down "
            : moment.opened    ? " let go of "
            : moment.flickered ? " opened briefly and lost "
                               : " lost ";
    text += object + at;
    if (moment.lifted >= 0.01) {
      text += fmt::format(" after lifting it by {:.2f} m", moment.lifted);
    } else if (moment.closing) {
      text += " while closing";
    }
    return text;
  }
  if (moment.kind == cause_kind::kEmptyGrasp) {
    if (moment.stayed_open) return gripper + " came to " + object + at + " and did not close";
    return gripper + (moment.touches ? " closed beside " + object : " closed on nothing") + at;
  }
  if (moment.kind == cause_kind::kCollision && moment.arm >= 0) {
    const std::string arm = Capitalized(PartOf(config_.arms[moment.arm], "arm"));
    const auto other = std::ranges::find(config_.arm_entity, moment.entity) - config_.arm_entity.begin();
    const std::string what =
        "the " + (other < std::ssize(config_.arm_entity) ? PartOf(config_.arms[other], "arm")
                                                         : Words(config_.entities[moment.entity]));
    if (moment.fell) return arm + " pushed " + what + at + " and it fell";
    std::string text = arm + " hit " + what + (moment.is_shut ? " with its gripper closed" : "") + at;
    if (moment.displacement >= 0.01) text += fmt::format(" and pushed it by {:.2f} m", moment.displacement);
    return text;
  }
  if (moment.kind == cause_kind::kStall) {
    const std::string what = moment.arm < 0 ? "Robot" : Capitalized(PartOf(config_.arms[moment.arm], "arm"));
    return what + (moment.tick == 0 ? " never moved" : " stopped moving" + at);
  }
  if (moment.kind == cause_kind::kOutOfTime) {
    const std::string end_of = end.reason == end_reason::kEndOfData ? "the data ended" : "time ran out";
    return (moment.made_progress ? Capitalized(end_of) : "No progress until " + end_of) + at;
  }
  if (moment.kind == cause_kind::kMissedCondition) {
    if (moment.is_undone) return "Progress was undone" + at;
    return (moment.tick == 0 ? "No progress" : "Last progress" + at) +
           (end.last_tick - rest_.since() < Ticks(1) ? ", although the robot kept moving" : "");
  }
  if (moment.kind == cause_kind::kFailedCondition || moment.kind == cause_kind::kCollision) {
    return "Failure" + at + ": " + Listed(end.conditions);
  }
  return Capitalized(Words(moment.kind)) + at + (end.detail.empty() ? "" : ": " + Printable(end.detail));
}

// Returns, for example, "; right gripper still held the book" for an object that the task requires to be
// released.
std::string CauseFinder::StillHeld() const {
  for (const CauseHold& hold : holds_.holds()) {
    const auto object = static_cast<size_t>(hold.object);
    if (!hold.is_over && IsGrasp(hold) && AsksForRelease(object))
      return "; " + PartOf(config_.grippers[hold.gripper], "gripper") + " still held the " +
             Words(config_.objects[object]);
  }
  return {};
}

// Returns the unmet success condition that best explains the moment; empty if all are met. Conditions about
// the moment's object take precedence, then conditions with a number, then conditions on the moment's
// gripper, then conditions that were never met.
std::string CauseFinder::Lack(const CauseMoment& moment) const {
  if (conditions_.empty()) return {};
  size_t index = 0;
  for (size_t k = 0; k + 1 < conditions_.size(); ++k) index += conditions_[k].size();
  const condition_t* chosen = nullptr;
  const BestOfCondition* best = nullptr;
  int highest = -1;
  for (const condition_t& condition : conditions_.back()) {
    const BestOfCondition& candidate = progress_.best(index++);
    if (condition.holds) continue;
    const bool is_about = moment.object >= 0 && IsAbout(condition, static_cast<size_t>(moment.object));
    const bool is_of_gripper =
        moment.gripper >= 0 && moment.lost_tick < 0 && condition.other == config_.grippers[moment.gripper];
    // How long a condition has been true is less informative than the condition.
    const bool has_number = !std::isnan(candidate.value) && !IsDuration(condition);
    const int score = 8 * is_about + 4 * has_number + 2 * is_of_gripper + !candidate.was_met;
    if (score <= highest) continue;
    highest = score;
    chosen = &condition;
    best = &candidate;
  }
  return chosen ? Reached(*chosen, *best, moment.kind == cause_kind::kMissedCondition) : "";
}

std::string CauseFinder::Text(const CauseMoment& moment, const CauseEnd& end) const {
  std::string text = What(moment, end);
  if (end.by == CauseEnd::By::kSuccess) return text + ".";
  if (!stage_tick_.empty() && end.knows_stages) {
    // A gripper that closes last reaches a stage after the robot's last command.
    const int64_t end_tick = moment.tick + (moment.kind == cause_kind::kStall ? Ticks(Rest::kCommandLag) : 0);
    const auto reached =
        std::ranges::count_if(stage_tick_, [&](int64_t tick) { return tick >= 0 && tick <= end_tick; });
    // More stages may be reached later.
    text +=
        fmt::format(" ({} of {} stages{})", reached, stage_tick_.size(), moment.tick > 0 ? " by then" : "");
  }
  if (moment.lost_tick >= 0) {
    text += fmt::format("; {} lost the {} at {:.2f} s", PartOf(config_.grippers[moment.gripper], "gripper"),
                        Words(config_.objects[moment.object]), Time(moment.lost_tick));
  } else if (moment.lost_again > 0) {
    text += moment.lost_again == 1 ? " and once more later"
                                   : fmt::format(" and {} more times later", moment.lost_again);
  } else if (moment.gripper >= 0 && !moment.put_down && !moment.held_again && !moment.tried_again) {
    text += " and never tried again";
  }
  if (end.by == CauseEnd::By::kTime) {
    const std::optional<CauseMoment> idle = IdleArm(FindUnmet(), end.last_tick);
    if (idle && idle->tick == 0 && moment.tick > 0)
      text += "; " + PartOf(config_.arms[idle->arm], "arm") + " never moved";
  }
  if (moment.kind == cause_kind::kMissedCondition || moment.kind == cause_kind::kStall) text += StillHeld();
  const std::string lack = end.by == CauseEnd::By::kTime ? Lack(moment) : "";
  return text + (lack.empty() ? "" : "; " + lack) + ".";
}

}  // namespace evalbus::metrics
