#include "cli/results/episode_json.h"

#include "metrics/episode/result_json.h"

namespace evalbus::results {

nlohmann::ordered_json EpisodeJson(const std::string& task, const std::string& variation,
                                   const episode_summary_t& summary) {
  return {{"task", task},
          {"variation", variation},
          {"episode", summary.header.episode},
          {"seed", summary.seed},
          {"end_reason", summary.end_reason},
          {"end_detail", summary.end_detail},
          {"failure_reason", summary.failure_reason},
          {"complete", summary.complete != 0},
          {"metrics", metrics::ResultJson(summary.metrics)},
          {"extended", metrics::ExtendedJson(summary.extended, summary.metrics)},
          {"explanation", metrics::ExplanationJson(summary.explanation)}};
}

}  // namespace evalbus::results
