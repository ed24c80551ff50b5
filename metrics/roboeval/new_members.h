// Members that a set has now but did not have before. RoboEval's metrics page counts collisions by this rule.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

namespace evalbus::metrics {

// Counts the members of a set that were not in the previous set. A set is filled with Insert() and ended with
// Commit().
class NewMembers {
 public:
  NewMembers() {
    now_.reserve(64);
    before_.reserve(64);
    counts_.reserve(64);
  }
  void Start() {
    now_.clear();
    before_.clear();
    counts_.clear();
    count_ = 0;
  }
  void Insert(int64_t key) { now_.push_back(key); }
  // Ends the current set: counts its new members and makes it the previous set.
  void Commit() {
    std::sort(now_.begin(), now_.end());
    now_.erase(std::unique(now_.begin(), now_.end()), now_.end());
    for (int64_t key : now_) {
      if (!std::binary_search(before_.begin(), before_.end(), key)) Count(key);
    }
    std::swap(now_, before_);
    now_.clear();
  }
  int64_t count() const { return count_; }
  // How often each member was new, in order of first appearance.
  const std::vector<std::pair<int64_t, int64_t>>& counts() const { return counts_; }

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
  std::vector<int64_t> now_;
  std::vector<int64_t> before_;
  std::vector<std::pair<int64_t, int64_t>> counts_;
  int64_t count_ = 0;
};

}  // namespace evalbus::metrics
