// Base classes of the predicates of a task description. A predicate is true or false at each tick and can
// explain why.
#pragma once

#include <limits>
#include <span>
#include <string>
#include <vector>

#include "evalbus/condition_t.hpp"
#include "evalbus/contact_t.hpp"
#include "evalbus/header_t.hpp"
#include "evalbus/state_t.hpp"

namespace evalbus::metrics {

// State of the world at one tick.
struct WorldView {
  const state_t& state;
  std::span<const contact_t> contacts;
  // 1 for each stage that was reached at this tick or earlier, otherwise 0; in the task's order.
  std::span<const uint8_t> stage_reached = {};
};

// Writes the current state of conditions into a list, one condition at a time. The first pass appends them;
// later passes write only the members that change from tick to tick, and do not allocate.
class Standing {
 public:
  // completes_groups: if a group requires only one of its conditions and one is met, all conditions of the
  // group are written as met. So are the conditions below `latched` and `lasts` if their current state does
  // not matter.
  explicit Standing(std::vector<condition_t>* conditions, bool completes_groups = false)
      : conditions_(*conditions), completes_groups_(completes_groups) {}

  // Returns the next condition. `fixed` contains the members that never change. words() returns the text of
  // the condition and is called only in the first pass.
  template <class Words>
  condition_t& Next(const condition_t& fixed, const Words& words) {
    if (next_ == conditions_.size()) {
      conditions_.push_back(fixed);
      conditions_.back().text = words();
    }
    return conditions_[next_++];
  }

  // Returns the number of conditions that were written in this pass.
  size_t written() const { return next_; }
  bool completes_groups() const { return completes_groups_; }
  // Must be called for conditions that do not count as missing: those of a group that requires only one of
  // them, if one is met, and those whose current state does not matter. They begin at index `first`.
  void CompleteGroup(size_t first) {
    for (size_t k = first; completes_groups_ && k < next_; ++k) conditions_[k].holds = true;
  }

 private:
  std::vector<condition_t>& conditions_;
  const bool completes_groups_;
  size_t next_ = 0;
};

class Predicate {
 public:
  virtual ~Predicate() = default;
  // Discards the state of the previous episode.
  virtual void Start() {}
  virtual bool Evaluate(const WorldView& world) = 0;
  // Appends the conditions that determined the result of the last Evaluate(), in the order of the
  // description. For a true `all` or a false `any`, these are all conditions. For a false `all`, it is the
  // first unmet condition; for a true `any`, the first condition that makes it true.
  virtual void Explain(std::vector<condition_t>* conditions) const = 0;
  // Writes every condition of the predicate after the last Evaluate(), including those that did not affect
  // the result, in the order of the description. wanted: the value that the condition should have; false
  // below a `not`. In each condition, text is the requirement, holds is whether it is met, and comparison and
  // threshold are its limit.
  virtual void Stand(bool wanted, Standing* standing) const = 0;
  // Returns a text, independent of any tick, that states what it means if the predicate is `value`: a list of
  // lines, in which the lines of operands are indented.
  virtual std::vector<std::string> Describe(bool value) const = 0;
};

// A condition without a number. Derived classes fill in the members and implement Holds().
class Relation : public Predicate {
 public:
  bool Evaluate(const WorldView& world) final;
  void Explain(std::vector<condition_t>* conditions) const final;
  void Stand(bool wanted, Standing* standing) const final;
  std::vector<std::string> Describe(bool value) const final {
    return {value ? text_if_true_ : text_if_false_};
  }

 protected:
  virtual bool Holds(const WorldView& world) = 0;
  // Derived classes set the members predicate, kind, subject and other. The others are set at each tick.
  condition_t condition_{};
  std::string text_if_true_;
  std::string text_if_false_;

 private:
  header_t header_{};
  bool holds_ = false;
};

// A value with its unit, and the limit that it is compared with: "27.4 degrees" and "20".
struct ComparisonText {
  std::string value, limit;
};
// Formats both with more digits than usual if the comparison (relation: "<", "<=", ">" or ">=") would be
// false otherwise.
ComparisonText Compared(double value, const std::string& relation, double threshold, const std::string& unit);

// A condition that a number is within limits; the limits themselves are allowed. Derived classes fill in the
// members and implement Value().
class Within : public Predicate {
 public:
  void Start() override { value_ = 0; }
  bool Evaluate(const WorldView& world) final;
  void Explain(std::vector<condition_t>* conditions) const final;
  void Stand(bool wanted, Standing* standing) const final;
  std::vector<std::string> Describe(bool value) const override;

 protected:
  // Returns the current value, in the condition's unit.
  virtual double Value(const WorldView& world) = 0;
  // Returns the text for the value measured at a tick: "tilt of pot 27.4 degrees > 20". holds: whether the
  // condition is met.
  virtual std::string Words(bool holds, double value) const;
  // Derived classes set the members predicate, kind, subject and unit. The others are set at each tick.
  condition_t condition_{};
  // Description of the number: "tilt of pot".
  std::string quantity_;
  // Limits in the condition's unit; infinite if there is no limit.
  double lower_ = -std::numeric_limits<double>::infinity();
  double upper_ = std::numeric_limits<double>::infinity();

 private:
  bool Holds() const { return lower_ <= value_ && value_ <= upper_; }
  // Returns whether the upper limit is nearer than the lower one. A violated limit counts as the nearer one.
  bool IsUpperNearer() const { return upper_ - value_ < value_ - lower_; }

  header_t header_{};
  double value_ = 0;
};

}  // namespace evalbus::metrics
