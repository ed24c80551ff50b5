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

// An episode of a log as training steps. Action i was executed at the state of tick i and led to the state of
// tick i + 1. In real time, it is the held action if no action arrived in time for tick i.
struct EpisodeSteps {
  std::filesystem::path log;
  model_info_t model{};
  episode_begin_t begin{};
  std::vector<state_t> states;    // ticks 0 to N
  std::vector<action_t> actions;  // ticks 0 to N - 1
  std::optional<episode_summary_t> summary;

  bool success() const { return summary && summary->complete && summary->metrics.success; }
};

// Throws InputError, with one line that names the log, if the log is damaged, has no episode or several, or
// lacks a tick, the action of a tick, or the end of the episode.
EpisodeSteps ReadSteps(const std::filesystem::path& log);

// Name of the HDF5 dataset, or (with ".jsonl") of the file in the folder, that lists the start of each
// episode. A line is JSON such as {"task": "lift_pot/position", "parameters": {"pot_x_m": 0.731}}; parameters
// are null if they are unknown. A contract can name the training set in `trained_on`.
inline constexpr char kStarts[] = "evalbus_starts";

// Writes the episodes as demo_0, demo_1, ... in the given order. `progress` receives the finished fraction,
// from 0 to 1: of the rendered states or, without images, of the logs. Both functions below throw InputError
// and EnvironmentError, and leave no partially written files.
void WriteRobomimic(const std::vector<std::filesystem::path>& logs, const std::filesystem::path& file,
                    const ImageOptions& images, const std::function<void(double)>& progress);
// Writes one file per episode, and the file of kStarts. Supports only robots with two grippers and two arms
// of seven joints each. `progress` receives the finished fraction of the logs.
void WriteSafetensors(const std::vector<std::filesystem::path>& logs, const std::filesystem::path& folder,
                      const std::function<void(double)>& progress);

}  // namespace evalbus::exports
