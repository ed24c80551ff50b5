// Pairs STATE and CONTACTS by tick and hands the pairs out in tick order, whatever order they arrived in.
// Pure.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "evalbus/contacts_t.hpp"
#include "evalbus/state_t.hpp"

namespace evalbus::metrics {

class TickMerger {
 public:
  struct Pair {
    const state_t* state;
    const contacts_t* contacts;
  };

  // A gap is given up on once this many later ticks are complete, or after GiveUp().
  static constexpr int kMaxCompleteAhead = 100;

  // Begins an episode.
  void Start();

  // Ticks further ahead of the next pair than this are not kept: no publisher of ours is so far ahead.
  static constexpr int64_t kMaxAhead = 4096;
  bool IsNear(int64_t tick) const { return tick >= 0 && tick - next_tick_ < kMaxAhead; }

  // A copy is kept until its pair was handed out. Returns false, and counts in duplicates(), for a tick that
  // was added before, handed out or given up on, too far ahead, or beyond the end.
  bool Add(const state_t& state);
  bool Add(const contacts_t& contacts);

  // The next pair if it is there; valid until the next call of any member. Ticks that were given up on are
  // skipped and counted in missing().
  bool Next(Pair* pair);

  // The episode ends with this tick.
  void EndAt(int64_t last_tick);
  // What has not come by now is missing.
  void GiveUp() { given_up_ = true; }
  // Every tick to the end was handed out or given up on; false before EndAt().
  bool finished() const { return last_tick_ >= 0 && next_tick_ > last_tick_; }

  int64_t missing() const { return missing_; }
  int64_t duplicates() const { return duplicates_; }

 private:
  struct Slot {
    state_t state{};
    contacts_t contacts{};
    bool has_state = false;
    bool has_contacts = false;
    bool complete() const { return has_state && has_contacts; }
  };
  using Slots = std::map<int64_t, Slot>;

  Slot* SlotFor(int64_t tick);
  void Recycle(Slots::iterator slot);
  // Takes back what Next() handed out.
  void Release();
  void SkipTo(int64_t tick);

  Slots slots_;
  // Nodes to use again, so that a steady stream allocates nothing.
  std::vector<Slots::node_type> spare_;
  bool handed_out_ = false;  // slots_.begin() is what the caller of Next() holds
  int64_t next_tick_ = 0;
  int64_t last_tick_ = -1;
  int complete_ = 0;
  bool given_up_ = false;
  int64_t missing_ = 0;
  int64_t duplicates_ = 0;
};

}  // namespace evalbus::metrics
