#include "results/commanded_motion.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/run_layout.h"
#include "bus/channels.h"
#include "bus/event_log.h"
#include "bus/message.h"

namespace evalbus::results {
namespace {

constexpr double kLeastChange = 1e-3;

bool Differ(const std::vector<double>& a, const std::vector<double>& b) {
  return !std::ranges::equal(a, b, [](double x, double y) { return std::abs(x - y) <= kLeastChange; });
}

bool LogShowsMotion(const std::filesystem::path& log, int episode) {
  EventLogReader reader(log);
  std::optional<action_t> first;
  action_t action{};
  for (LogEvent event; reader.Next(&event);) {
    if (event.channel != channels::kAction || !Decode(event.data, &action)) continue;
    if (action.header.episode != episode || !action.error.empty()) continue;
    if (!first) first = action;
    if (Differ(action.joint_position_rad, first->joint_position_rad) ||
        Differ(action.gripper_closing, first->gripper_closing))
      return true;
  }
  return false;
}

}  // namespace

bool ShowsCommandedMotion(const RecordedRun& run) {
  return std::ranges::any_of(run.episodes, [&](const RecordedEpisode& episode) {
    const std::filesystem::path log = EpisodeLog(run.folder, episode.episode);
    return std::filesystem::exists(log) && LogShowsMotion(log, episode.episode);
  });
}

}  // namespace evalbus::results
