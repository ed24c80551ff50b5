#include "sim/roster.h"

#include <algorithm>
#include <utility>

namespace evalbus::sim {
namespace {

constexpr size_t kMaxMembers = 100;

}  // namespace

void Roster::Begin(int32_t episode, int32_t attempt, std::vector<std::string> required,
                   int64_t own_instance) {
  episode_ = episode;
  attempt_ = attempt;
  required_ = std::move(required);
  instances_ = {{"sim", own_instance}};
  twice_.clear();
}

bool Roster::IsRequired(const std::string& component) const {
  return std::ranges::find(required_, component) != required_.end();
}

bool Roster::Hear(const component_status_t& status) {
  const bool is_sim = status.component == "sim", is_required = IsRequired(status.component);
  if (status.state == component_status_t::READY && status.episode == episode_ && status.attempt == attempt_ &&
      (is_required || is_sim) &&
      instances_.emplace(status.component, status.instance).first->second != status.instance) {
    twice_ = status.component;
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

std::string Roster::Missing() const {
  std::string missing;
  for (const std::string& name : required_) {
    const auto found = members_.find(name);
    if (found != members_.end() && found->second.ready && IsHere(found->second)) continue;
    missing += (missing.empty() ? "" : ", ") + name;
  }
  return missing;
}

std::string Roster::Lagging(int64_t tick) const {
  for (const auto& [name, member] : members_) {
    if (member.lag_window_ticks > 0 && member.episode == episode_ &&
        tick - member.last_tick >= member.lag_window_ticks) {
      return name;
    }
  }
  return "";
}

int64_t Roster::LastTick(const std::string& component) const {
  const auto found = members_.find(component);
  return found != members_.end() && IsHere(found->second) ? found->second.last_tick : -1;
}

}  // namespace evalbus::sim
