#include "results/pacing.h"

#include <fmt/format.h>

#include <algorithm>

namespace evalbus::results {
namespace {

using nlohmann::ordered_json;

constexpr const char* kCounts[] = {"ticks", "deadline_misses", "late_ticks"};

ordered_json Json(const time_distribution_t& times) {
  return {{"count", times.count},
          {"p50_s", times.p50_s},
          {"p99_s", times.p99_s},
          {"p999_s", times.p999_s},
          {"max_s", times.max_s}};
}

}  // namespace

ordered_json EpisodePacing(const episode_end_t& end, int64_t deadline_misses) {
  return {{"ticks", end.header.tick},
          {"deadline_misses", deadline_misses},
          {"late_ticks", end.late_ticks},
          {"error", Json(end.pacing_error)},
          {"action_latency", Json(end.action_latency)},
          {"partial_latency", Json(end.partial_latency)}};
}

ordered_json RunPacing(const RecordedRun& run) {
  ordered_json sums;
  if (!run.info.value("realtime", false)) return sums;
  for (const RecordedEpisode& episode : run.episodes) {
    const ordered_json pacing = episode.Json().value("pacing", ordered_json());
    if (pacing.is_null()) return nullptr;
    if (sums.is_null()) {
      sums = pacing;
      continue;
    }
    for (const char* count : kCounts) sums[count] = sums[count].get<int64_t>() + pacing[count].get<int64_t>();
    for (const PacingTimes& times : kPacingTimes) {
      ordered_json& all = sums[times.key];
      for (const auto& [key, value] : pacing[times.key].items()) {
        if (key == "count") {
          all[key] = all[key].get<int64_t>() + value.get<int64_t>();
        } else {
          all[key] = std::max(all[key].get<double>(), value.get<double>());
        }
      }
    }
  }
  return sums;
}

std::string PacingSentence(const ordered_json& run_pacing) {
  return fmt::format(
      "Of {} ticks, {} had no message from the policy process in time and {} were late by at least a whole "
      "tick.",
      run_pacing["ticks"].get<int64_t>(), run_pacing["deadline_misses"].get<int64_t>(),
      run_pacing["late_ticks"].get<int64_t>());
}

std::string PacingText(const ordered_json& run_pacing) {
  if (run_pacing.is_null()) return "Real time. Not available for every episode.\n";
  std::string text = "Real time. " + PacingSentence(run_pacing) + "\n";
  text += fmt::format("  {:26}{:>9}{:>9}{:>9}{:>9}  ms, worst episode\n", "", "p50", "p99", "p99.9", "max");
  for (const PacingTimes& times : kPacingTimes) {
    const ordered_json& json = run_pacing[times.key];
    text += fmt::format("  {:26}", times.name);
    for (const char* key : {"p50_s", "p99_s", "p999_s", "max_s"}) {
      text += fmt::format("{:9.2f}", json[key].get<double>() * 1e3);
    }
    text += "\n";
  }
  return text;
}

}  // namespace evalbus::results
