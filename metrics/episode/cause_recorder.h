// Passes an episode's ticks to CauseFinder: extracts the inputs of its rules from STATE, CONTACTS and the
// task's conditions.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "evalbus/contact_t.hpp"
#include "evalbus/state_t.hpp"
#include "metrics/cause/cause_finder.h"
#include "metrics/sample/sample.h"
#include "metrics/task/task_evaluator.h"
#include "models/model_names.h"

namespace evalbus::metrics {

class CauseRecorder {
 public:
  // object_body: body of each object. `names` must outlive this object.
  CauseRecorder(const ModelNames& names, std::vector<int> object_body);

  void Start() { finder_.Start(); }
  // Adds a tick after `evaluator` has evaluated it, in tick order. contacts: without contacts of objects
  // whose poses are unknown.
  void Add(const Sample& sample, const state_t& state, std::span<const contact_t> contacts,
           const TaskEvaluator& evaluator);
  FoundCause Find(const CauseEnd& end) const { return finder_.Find(end); }

 private:
  void SetContacts(std::span<const contact_t> contacts);

  const ModelNames& names_;
  const std::vector<int> object_body_;
  // Index of the arm to which each geom belongs; -1 if it is not part of an arm.
  std::vector<int> geom_arm_;
  CauseFinder finder_;
  // Storage of the current tick, reused.
  std::vector<std::array<double, 3>> object_, wrist_;
  std::vector<double> joints_, commands_, torque_, closing_;
  std::vector<ArmContact> contacts_;
  // Conditions of each stage, then of success.
  std::vector<std::vector<condition_t>> conditions_;
};

}  // namespace evalbus::metrics
