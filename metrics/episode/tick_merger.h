// Pairs STATE and CONTACTS by tick and returns the pairs in tick order. The messages may arrive in any order.
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

  // A gap is skipped once this many later ticks are complete, or after GiveUp().
  static constexpr int kMaxCompleteAhead = 100;

  // Begins an episode.
  void Start();

  // Messages that are at least this many ticks ahead of the next pair are dropped; no evalbus publisher is
  // that far ahead.
  static constexpr int64_t kMaxAhead = 4096;
  bool IsNear(int64_t tick) const { return tick >= 0 && tick - next_tick_ < kMaxAhead; }

  // Keeps a copy of the message until its pair has been returned. Returns false, and counts the message in
  // duplicates(), if its tick was added before, has already been returned or skipped, is too far ahead, or is
  // beyond the end.
  bool Add(const state_t& state);
  bool Add(const contacts_t& contacts);

  // Returns true and the next pair if it is complete; *pair is valid until the next call of any member.
  // Skipped ticks are counted in missing().
  bool Next(Pair* pair);

  // Sets the last tick of the episode.
  void EndAt(int64_t last_tick);
  // Declares everything that has not arrived yet as missing.
  void GiveUp() { given_up_ = true; }
  // Returns true if every tick up to the last has been returned or skipped; false before EndAt().
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
  // Releases the pair that Next() returned.
  void Release();
  void SkipTo(int64_t tick);

  Slots slots_;
  // Map nodes that are kept for reuse, so that no memory is allocated in steady state.
  std::vector<Slots::node_type> spare_;
  bool handed_out_ = false;  // the caller of Next() holds slots_.begin()
  int64_t next_tick_ = 0;
  int64_t last_tick_ = -1;
  int complete_ = 0;
  bool given_up_ = false;
  int64_t missing_ = 0;
  int64_t duplicates_ = 0;
};

}  // namespace evalbus::metrics
