// New collisions. Source: RoboEval's metrics page (env_collision_count, self_collision_count).
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "evalbus/metric_values_t.hpp"
#include "metrics/sample/derived_sample.h"

namespace evalbus::metrics {

// Evaluates samples 0, W, 2W, ...; in RoboEval's definition, W is 1. Counts the collisions in an evaluated
// sample that did not exist in the previous evaluated sample. In the first sample, all collisions count.
class NewCollisions {
 public:
  static constexpr auto kTracked = &metric_values_t::tracks_collisions;
  explicit NewCollisions(const MetricsConfig& config) : window_(config.collision_sample_window) {
    now_.reserve(64);
    before_.reserve(64);
    counts_.reserve(64);
  }
  void Start(const ResetState&) {
    samples_ = count_ = 0;
    now_.clear();
    before_.clear();
    counts_.clear();
  }
  // Returns how often each collision was new, in order of first appearance.
  const std::vector<std::pair<int64_t, int64_t>>& counts() const { return counts_; }

 protected:
  int64_t count() const { return count_; }
  // Must be called once per sample; returns true if the sample is evaluated.
  bool IsEvaluated() { return samples_++ % window_ == 0; }
  // Adds a collision of the evaluated sample.
  void Insert(int64_t key) { now_.push_back(key); }
  // Ends the evaluated sample: counts its new collisions.
  void Commit() {
    std::sort(now_.begin(), now_.end());
    now_.erase(std::unique(now_.begin(), now_.end()), now_.end());
    for (int64_t key : now_) {
      if (!std::binary_search(before_.begin(), before_.end(), key)) Count(key);
    }
    std::swap(now_, before_);
    now_.clear();
  }

 private:
  void Count(int64_t key) {
    ++count_;
    const auto entry =
        std::find_if(counts_.begin(), counts_.end(), [key](const auto& c) { return c.first == key; });
    if (entry == counts_.end()) {
      counts_.emplace_back(key, 1);
    } else {
      ++entry->second;
    }
  }

  int64_t window_;
  int64_t samples_ = 0;
  int64_t count_ = 0;
  std::vector<int64_t> now_, before_;
  std::vector<std::pair<int64_t, int64_t>> counts_;
};

// Scene geoms that any robot geom touches, by geom id. Manipulated objects do not belong to the scene.
class EnvCollisions : public NewCollisions {
 public:
  using NewCollisions::NewCollisions;
  void Add(const DerivedSample& derived) {
    if (!IsEvaluated()) return;
    for (const SceneContact& contact : derived.contacts.scene()) Insert(contact.scene_geom);
    Commit();
  }
  void Values(metric_values_t* values) const { values->env_collision_count = count(); }
};

// Unordered pairs of robot geoms that touch; the key holds the lower geom id in its upper half.
class SelfCollisions : public NewCollisions {
 public:
  using NewCollisions::NewCollisions;
  void Add(const DerivedSample& derived) {
    if (!IsEvaluated()) return;
    for (const SelfContact& contact : derived.contacts.self()) Insert(int64_t{contact.a} << 32 | contact.b);
    Commit();
  }
  void Values(metric_values_t* values) const { values->self_collision_count = count(); }
};

}  // namespace evalbus::metrics
