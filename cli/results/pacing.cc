#include "cli/results/pacing.h"

#include <fmt/format.h>

#include <algorithm>

namespace evalbus::results {

using nlohmann::ordered_json;

ordered_json EpisodePacing(const episode_end_t& end, int64_t deadline_misses) {
  return {{"ticks", end.header.tick},
          {"deadline_misses", deadline_misses},
          {"late_ticks", end.late_ticks},
          {"error_p50_s", end.pacing_error_p50_s},
          {"error_p99_s", end.pacing_error_p99_s},
          {"error_max_s", end.pacing_error_max_s}};
}

ordered_json RunPacing(const std::vector<ordered_json>& episodes) {
  ordered_json run;
  for (const ordered_json& episode : episodes) {
    const ordered_json pacing = episode.value("pacing", ordered_json());
    if (pacing.is_null()) return nullptr;
    if (run.is_null()) {
      run = pacing;
      continue;
    }
    for (const char* count : {"ticks", "deadline_misses", "late_ticks"}) {
      run[count] = run[count].get<int64_t>() + pacing[count].get<int64_t>();
    }
    for (const char* error : {"error_p50_s", "error_p99_s", "error_max_s"}) {
      run[error] = std::max(run[error].get<double>(), pacing[error].get<double>());
    }
  }
  return run;
}

std::string PacingText(const ordered_json& run_pacing) {
  if (run_pacing.is_null()) return "Real time: not known of every episode\n";
  const auto ms = [&](const char* key) { return run_pacing[key].get<double>() * 1e3; };
  return fmt::format(
      "Real time: of {} ticks {} without an action in time, {} a whole tick late;\n"
      "behind the clock by {:.2f} ms in the median, {:.2f} ms at 99 %, {:.2f} ms at most (worst episode)\n",
      run_pacing["ticks"].get<int64_t>(), run_pacing["deadline_misses"].get<int64_t>(),
      run_pacing["late_ticks"].get<int64_t>(), ms("error_p50_s"), ms("error_p99_s"), ms("error_max_s"));
}

}  // namespace evalbus::results
