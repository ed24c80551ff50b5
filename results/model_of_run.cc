#include "results/model_of_run.h"

#include <fmt/format.h>

#include <cmath>

#include "base/json_file.h"
#include "base/sha256.h"
#include "lcmtypes/clock.h"

namespace evalbus::results {
namespace {

using nlohmann::ordered_json;

// Compares numbers with a tolerance, because rates are rounded differently in run.json and MODEL.
bool IsEqual(const ordered_json& recorded, const ordered_json& found) {
  if (!recorded.is_number() || !found.is_number()) return recorded == found;
  return std::abs(recorded.get<double>() - found.get<double>()) <= 1e-9 * std::abs(found.get<double>());
}

}  // namespace

std::vector<std::string> ModelDifferences(const RecordedRun& run, const model_info_t& model) {
  ordered_json found = {{"task", model.task},
                        {"variation", model.variation},
                        {"task_sha256", Sha256Text(model.task_yaml)},
                        {"physics_sha256", model.physics_sha256},
                        {"visual_sha256", model.visual_sha256}};
  if (run.is_simulated()) {
    found["control_hz"] = 1 / ControlPeriod(model);
    found["realtime"] = model.clock == clock_name::kRealtime;
    if (run.info.value("realtime", false)) found["rtf"] = model.realtime_factor;
  }
  std::vector<std::string> differences;
  for (const auto& [key, value] : found.items()) {
    const auto recorded = run.info.find(key);
    if (recorded == run.info.end() || IsEqual(*recorded, value)) continue;
    differences.push_back(fmt::format("{} is {}, MODEL has {}", key, ToText(*recorded), ToText(value)));
  }
  // MODEL rounds the time that an episode continues after success up to a whole tick.
  const double after_success_s = run.info.value("after_success_s", 0.0);
  const double rounded_up_s = Seconds(model.after_success_us) - after_success_s;
  if (run.is_simulated() && (rounded_up_s < -1e-6 || rounded_up_s > ControlPeriod(model)))
    differences.push_back(fmt::format("after_success_s is {:g}, MODEL has {:g}", after_success_s,
                                      Seconds(model.after_success_us)));
  return differences;
}

}  // namespace evalbus::results
