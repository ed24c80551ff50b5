// Exports training sets from the logs of runs: HDF5 for robomimic, safetensors for RoboEval. docs/data.md
// describes their contents.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <vector>

#include "evalbus/action_t.hpp"
#include "evalbus/episode_begin_t.hpp"
#include "evalbus/episode_summary_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "evalbus/state_t.hpp"
#include "export/drawn_images.h"

namespace evalbus::exports {

// An episode of a log as training steps: action i was commanded at the state of tick i and led to the state
// of tick i + 1.
struct EpisodeSteps {
  std::filesystem::path log;
  model_info_t model{};
  episode_begin_t begin{};
  std::vector<state_t> states;    // ticks 0 to N
  std::vector<action_t> actions;  // of ticks 0 to N - 1
  std::optional<episode_summary_t> summary;

  bool success() const { return summary && summary->complete && summary->metrics.success; }
};

// Throws InputError, one line that names the log: damaged; no or several episodes; no actions; missing ticks.
EpisodeSteps ReadSteps(const std::filesystem::path& log);

// Name of the dataset, or with ".jsonl" of the file in the folder, that has the start of each episode in a
// line of JSON, {"task": "lift_pot/position", "parameters": {"pot_x_m": 0.731}}; null if it is unknown. A
// contract can name the set in `trained_on`.
inline constexpr char kStarts[] = "evalbus_starts";

// `progress` receives the finished fraction of all steps, from 0 to 1. Both functions throw InputError and
// EnvironmentError, and leave no partially written files. The episodes become demo_0, demo_1, ... in the
// given order.
void WriteRobomimic(const std::vector<std::filesystem::path>& logs, const std::filesystem::path& file,
                    const ImageOptions& images, const std::function<void(double)>& progress);
// Supports only two arms with seven joints each. Writes one file per episode and returns their paths.
std::vector<std::filesystem::path> WriteSafetensors(const std::vector<std::filesystem::path>& logs,
                                                    const std::filesystem::path& folder,
                                                    const std::function<void(double)>& progress);

}  // namespace evalbus::exports
