#include "results/episode_json.h"

#include <string>
#include <utility>

#include "lcmtypes/end_reason.h"
#include "metrics/episode/result_json.h"

namespace evalbus::results {

nlohmann::ordered_json EpisodeJson(const std::string& task, const std::string& variation,
                                   const episode_summary_t& summary, const episode_begin_t* begin) {
  nlohmann::ordered_json metrics = metrics::ResultJson(summary.metrics);
  if (summary.failure_reason == end_reason::kNotJudged) metrics.erase("success");
  nlohmann::ordered_json line = {
      {"task", task}, {"variation", variation}, {"episode", summary.header.episode}, {"seed", summary.seed}};
  nlohmann::ordered_json stage_names = nlohmann::ordered_json::object();
  for (size_t k = 0; k < summary.metrics.stage_name.size(); ++k)
    stage_names[std::to_string(summary.metrics.stage_index[k])] = summary.metrics.stage_name[k];
  if (begin) line["parameters"] = metrics::ParametersJson(*begin);
  line.update({{"end_reason", summary.end_reason},
               {"end_detail", summary.end_detail},
               {"failure_reason", summary.failure_reason},
               {"complete", summary.complete != 0},
               {"stage_names", std::move(stage_names)},
               {"metrics", std::move(metrics)},
               {"extended", metrics::ExtendedJson(summary.extended, summary.metrics)},
               {"final_poses", metrics::PosesJson(metrics::PosesOf(summary))},
               {"explanation", metrics::ExplanationJson(summary.explanation)},
               {"cause", metrics::CauseJson(summary.cause)}});
  return line;
}

}  // namespace evalbus::results
