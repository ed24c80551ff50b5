// Scores a recorded trajectory given as JSON (docs/metrics.md, "Scoring a recorded trajectory"), without a
// bus.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "base/json_file.h"

namespace evalbus::metrics {

struct ScoreOptions {
  // Collisions are evaluated every this many steps, >= 1. 0: every slip_sample_window steps, as in the
  // reference implementation.
  int collision_sample_window = 1;
};

// Returns the result dictionary of one episode. `file` is the name of the source in error messages. Throws
// InputError, one line with file, key and what was expected.
nlohmann::ordered_json ScoreEpisode(const nlohmann::json& episode, const std::string& file,
                                    const ScoreOptions& options = {});

// Returns the result dictionary of the episode in `file`, which may have any length. Only one step at a time
// is in memory if the keys that describe the robot, the configuration and the initial state ("robot",
// "control_frequency", "control_dt", "config", "geoms" and "initial") precede the steps.
nlohmann::ordered_json ScoreFile(const std::filesystem::path& file, const ScoreOptions& options = {});

}  // namespace evalbus::metrics
