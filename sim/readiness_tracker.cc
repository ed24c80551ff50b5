#include "sim/readiness_tracker.h"

#include <algorithm>

namespace evalbus::sim {
namespace {

constexpr size_t kMaxMembers = 100;

}  // namespace

void ReadinessTracker::Begin(const command_t& start, int64_t own_instance) {
  episode_ = start.episode;
  attempt_ = start.attempt;
  required_ = start.required_component;
  instances_ = {{"sim", own_instance}};
  for (size_t i = 0; i < required_.size() && i < start.required_instance.size(); ++i) {
    if (start.required_instance[i] != 0) instances_[required_[i]] = start.required_instance[i];
  }
  twice_.clear();
}

bool ReadinessTracker::IsRequired(const std::string& component) const {
  return std::ranges::find(required_, component) != required_.end();
}

bool ReadinessTracker::Update(const component_status_t& status) {
  const bool is_sim = status.component == "sim", is_required = IsRequired(status.component);
  const bool is_ready =
      status.state == component_status_t::READY && status.episode == episode_ && status.attempt == attempt_;
  if (is_required || is_sim) {
    const auto known = is_ready ? instances_.emplace(status.component, status.instance).first
                                : instances_.find(status.component);
    if (known != instances_.end() && known->second != status.instance) {
      if (is_ready) twice_ = status.component;
      return false;
    }
  }
  if (is_sim) return true;
  if (!is_required && members_.size() >= kMaxMembers && !members_.contains(status.component)) return false;
  members_[status.component] = {.episode = status.episode,
                                .attempt = status.attempt,
                                .ready = status.state == component_status_t::READY,
                                .last_tick = std::max<int64_t>(status.last_tick, -1),
                                .lag_window_ticks = status.lag_window_ticks};
  return true;
}

std::string ReadinessTracker::Missing() const {
  std::string missing;
  for (const std::string& name : required_) {
    const auto found = members_.find(name);
    if (found != members_.end() && found->second.ready && IsHere(found->second)) continue;
    missing += (missing.empty() ? "" : ", ") + name;
  }
  return missing;
}

std::string ReadinessTracker::Lagging(int64_t tick) const {
  for (const auto& [name, member] : members_) {
    if (member.lag_window_ticks > 0 && member.episode == episode_ &&
        tick - member.last_tick >= member.lag_window_ticks) {
      return name;
    }
  }
  return "";
}

int64_t ReadinessTracker::LastTick(const std::string& component) const {
  const auto found = members_.find(component);
  return found != members_.end() && IsHere(found->second) ? found->second.last_tick : -1;
}

}  // namespace evalbus::sim
