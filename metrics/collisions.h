// New collisions. Source: RoboEval's metrics page (env_collision_count, self_collision_count).
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "metrics/sample.h"

namespace evalbus {

// Counts the members of a set that were not in the set of the look before.
class NewMembers {
 public:
  NewMembers() {
    now_.reserve(64);
    before_.reserve(64);
  }
  void Start() {
    now_.clear();
    before_.clear();
    count_ = 0;
  }
  void Insert(int64_t key) { now_.push_back(key); }
  // Ends the look.
  void Commit() {
    std::sort(now_.begin(), now_.end());
    now_.erase(std::unique(now_.begin(), now_.end()), now_.end());
    for (int64_t key : now_) count_ += !std::binary_search(before_.begin(), before_.end(), key);
    std::swap(now_, before_);
    now_.clear();
  }
  int64_t count() const { return count_; }

 private:
  std::vector<int64_t> now_;
  std::vector<int64_t> before_;
  int64_t count_ = 0;
};

// Looks at samples 0, W, 2W, ...; W = 1, every sample, is the definition. environment(): scene geoms touched
// by any robot geom now and not at the previous look; self(): unordered robot geom pairs likewise. What is
// touched at the first look is new. Manipulated objects are no scene.
class CollisionCounter {
 public:
  explicit CollisionCounter(int window) : window_(window) {}

  void Start() {
    samples_ = 0;
    environment_.Start();
    self_.Start();
  }

  void Add(std::span<const GeomContact> contacts, const GeomOwners& owners) {
    if (samples_++ % window_ != 0) return;
    for (const GeomContact& contact : contacts) {
      if (!(contact.distance <= kContactDistance)) continue;
      const int a = std::min(contact.geom_a, contact.geom_b), b = std::max(contact.geom_a, contact.geom_b);
      const bool robot_a = owners.IsRobot(a), robot_b = owners.IsRobot(b);
      if (robot_a && robot_b) {
        self_.Insert(int64_t{a} << 32 | b);
      } else if (robot_a && owners.IsScene(b)) {
        environment_.Insert(b);
      } else if (robot_b && owners.IsScene(a)) {
        environment_.Insert(a);
      }
    }
    environment_.Commit();
    self_.Commit();
  }

  int64_t environment() const { return environment_.count(); }
  int64_t self() const { return self_.count(); }

 private:
  int64_t window_;
  int64_t samples_ = 0;
  NewMembers environment_;
  NewMembers self_;
};

}  // namespace evalbus
