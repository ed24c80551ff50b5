// Runs the components that share one thread and one bus.
#pragma once

#include <algorithm>
#include <chrono>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "bus/component.h"

namespace evalbus::runner {

class ComponentLoop {
 public:
  explicit ComponentLoop(Bus* bus) : bus_(bus) {}

  void Add(std::unique_ptr<Component> component) { components_.push_back(std::move(component)); }

  // Polls the components and calls `poll`, if a poll is due. Then handles one message, if a message arrives
  // before the next poll.
  void Advance(const std::function<void(SteadyTime)>& poll) {
    const auto now = std::chrono::steady_clock::now();
    if (now >= poll_at_) {
      for (const auto& component : components_) component->Poll(now);
      poll(now);
      idle_poll_at_ = now + kIdlePoll;
    }
    poll_at_ = idle_poll_at_;
    for (const auto& component : components_) poll_at_ = std::min(poll_at_, component->next_poll());
    // If no message was handled, a poll is due or a policy's answer has arrived.
    if (!bus_->Handle(poll_at_)) poll_at_ = {};
  }

 private:
  static constexpr std::chrono::milliseconds kIdlePoll{20};

  Bus* bus_;
  std::vector<std::unique_ptr<Component>> components_;
  SteadyTime idle_poll_at_{}, poll_at_{};
};

}  // namespace evalbus::runner
