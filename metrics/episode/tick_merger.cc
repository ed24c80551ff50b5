#include "metrics/episode/tick_merger.h"

#include <algorithm>

namespace evalbus::metrics {

void TickMerger::Start() {
  while (!slots_.empty()) Recycle(slots_.begin());
  handed_out_ = false;
  next_tick_ = 0;
  last_tick_ = -1;
  complete_ = 0;
  given_up_ = false;
  missing_ = 0;
  duplicates_ = 0;
}

void TickMerger::Recycle(Slots::iterator slot) { spare_.push_back(slots_.extract(slot)); }

TickMerger::Slot* TickMerger::SlotFor(int64_t tick) {
  if (tick < next_tick_ || !IsNear(tick) || (last_tick_ >= 0 && tick > last_tick_)) return nullptr;
  const auto found = slots_.find(tick);
  if (found != slots_.end()) return &found->second;
  if (spare_.empty()) return &slots_[tick];
  Slots::node_type node = std::move(spare_.back());
  spare_.pop_back();
  node.key() = tick;
  Slot& slot = slots_.insert(std::move(node)).position->second;
  slot.has_state = slot.has_contacts = false;
  return &slot;
}

bool TickMerger::Add(const state_t& state) {
  Slot* slot = SlotFor(state.header.tick);
  if (!slot || slot->has_state) {
    ++duplicates_;
    return false;
  }
  slot->state = state;
  slot->has_state = true;
  complete_ += slot->complete();
  return true;
}

bool TickMerger::Add(const contacts_t& contacts) {
  Slot* slot = SlotFor(contacts.header.tick);
  if (!slot || slot->has_contacts) {
    ++duplicates_;
    return false;
  }
  slot->contacts = contacts;
  slot->has_contacts = true;
  complete_ += slot->complete();
  return true;
}

void TickMerger::Release() {
  if (handed_out_) Recycle(slots_.begin());
  handed_out_ = false;
}

void TickMerger::SkipTo(int64_t tick) {
  missing_ += tick - next_tick_;
  next_tick_ = tick;
  while (!slots_.empty() && slots_.begin()->first < tick) Recycle(slots_.begin());
}

bool TickMerger::Next(Pair* pair) {
  Release();
  if (complete_ > 0 && !(slots_.begin()->first == next_tick_ && slots_.begin()->second.complete()) &&
      (given_up_ || complete_ >= kMaxCompleteAhead)) {
    SkipTo(std::find_if(slots_.begin(), slots_.end(), [](const auto& slot) {
             return slot.second.complete();
           })->first);
  }
  if (complete_ == 0 && given_up_ && last_tick_ >= 0) SkipTo(std::max(next_tick_, last_tick_ + 1));
  if (slots_.empty() || slots_.begin()->first != next_tick_ || !slots_.begin()->second.complete())
    return false;
  *pair = {&slots_.begin()->second.state, &slots_.begin()->second.contacts};
  --complete_;
  ++next_tick_;
  handed_out_ = true;
  return true;
}

void TickMerger::EndAt(int64_t last_tick) {
  Release();
  last_tick_ = std::max<int64_t>(last_tick, 0);
  for (auto slot = slots_.upper_bound(last_tick_); slot != slots_.end();
       slot = slots_.upper_bound(last_tick_)) {
    complete_ -= slot->second.complete();
    Recycle(slot);
  }
}

}  // namespace evalbus::metrics
