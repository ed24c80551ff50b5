// What a predicate of a task description is: true or false about a tick, and able to say why.
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

// One tick of the world.
struct WorldView {
  const state_t& state;
  std::span<const contact_t> contacts;
  // By stage of the task, in its order: reached at this tick or before.
  std::span<const uint8_t> stage_reached = {};
};

// Conditions as they stand, one after the other. The first time they are appended; from then on only what
// changes from tick to tick is written, so that nothing is allocated.
class Standing {
 public:
  explicit Standing(std::vector<condition_t>* conditions) : conditions_(*conditions) {}

  // The next one; `fixed` has what never changes, and words() what it asks for, once.
  template <class Words>
  condition_t& Next(const condition_t& fixed, const Words& words) {
    if (next_ == conditions_.size()) {
      conditions_.push_back(fixed);
      conditions_.back().text = words();
    }
    return conditions_[next_++];
  }

 private:
  std::vector<condition_t>& conditions_;
  size_t next_ = 0;
};

class Predicate {
 public:
  virtual ~Predicate() = default;
  // Forgets the episode before.
  virtual void Start() {}
  virtual bool Evaluate(const WorldView& world) = 0;
  // Appends the conditions that made the last Evaluate() come out as it did, in the order of the description:
  // all that a true `all` needs, the first unmet one of a false `all`, the first that makes an `any` true,
  // all of a false `any`.
  virtual void Explain(std::vector<condition_t>* conditions) const = 0;
  // Every condition in it after the last Evaluate(), also those that decided nothing, in the order of the
  // description. wanted: false below a `not`. text says what is asked for, holds whether that is so,
  // comparison and threshold what it takes.
  virtual void Stand(bool wanted, Standing* standing) const = 0;
  // What it means to be `value`, in words, before any tick: lines, those of operands indented.
  virtual std::vector<std::string> Describe(bool value) const = 0;
};

// A condition that holds or does not, without a number. A class fills in the members and Holds().
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
  // predicate, kind, subject, other; the rest comes from the tick.
  condition_t condition_{};
  std::string text_if_true_;
  std::string text_if_false_;

 private:
  header_t header_{};
  bool holds_ = false;
};

// A condition that a number is within limits, both included. A class fills in the members and Value().
class Within : public Predicate {
 public:
  void Start() override { value_ = 0; }
  bool Evaluate(const WorldView& world) final;
  void Explain(std::vector<condition_t>* conditions) const final;
  void Stand(bool wanted, Standing* standing) const final;
  std::vector<std::string> Describe(bool value) const override;

 protected:
  // In the condition's unit.
  virtual double Value(const WorldView& world) = 0;
  // Words for what was measured at a tick, which hold or do not: "tilt of pot 27.4 degrees > 20".
  virtual std::string Words(bool holds, double value) const;
  // predicate, kind, subject and unit; the rest comes from the tick.
  condition_t condition_{};
  // What the number is, in words: "tilt of pot".
  std::string quantity_;
  // In the condition's unit, infinite where there is none.
  double lower_ = -std::numeric_limits<double>::infinity();
  double upper_ = std::numeric_limits<double>::infinity();

 private:
  bool Holds() const { return lower_ <= value_ && value_ <= upper_; }
  // Of two limits the nearer one, which is the violated one where one is.
  bool IsUpperNearer() const { return upper_ - value_ < value_ - lower_; }

  header_t header_{};
  double value_ = 0;
};

}  // namespace evalbus::metrics
