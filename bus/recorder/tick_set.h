// Set of received ticks, in any order. Pure.
#pragma once

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <map>

namespace evalbus {

class TickSet {
 public:
  void Add(int64_t tick) {
    auto next = ranges_.upper_bound(tick);
    const auto before = next == ranges_.begin() ? ranges_.end() : std::prev(next);
    const bool joins_before = before != ranges_.end() && before->second >= tick;
    if (joins_before && before->second > tick) return;
    int64_t end = tick + 1;
    if (next != ranges_.end() && next->first == end) {
      end = next->second;
      ranges_.erase(next);
    }
    if (joins_before) {
      before->second = end;
    } else {
      ranges_[tick] = end;
    }
  }

  // Returns the number of ticks from 0 to end - 1 that are not in the set.
  int64_t MissingBefore(int64_t end) const {
    int64_t missing = end;
    for (const auto& [from, to] : ranges_) missing -= std::max<int64_t>(0, std::min(to, end) - from);
    return missing;
  }

 private:
  // Contiguous ranges of ticks: from the key to the value (exclusive).
  std::map<int64_t, int64_t> ranges_;
};

}  // namespace evalbus
