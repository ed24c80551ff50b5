// A recorded trajectory as JSON (docs/metrics.md, "Scoring a recorded trajectory"), scored without any bus.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "base/json_file.h"

namespace evalbus::metrics {

struct ScoreOptions {
  // Collisions are looked at every this many steps, >= 1. The reference implementation looks every
  // slip_sample_window steps; 0 takes that window.
  int collision_sample_window = 1;
};

// The result dictionary of one episode. `file` is what error messages call the source. Throws InputError: one
// line with file, key and what was expected.
nlohmann::ordered_json ScoreEpisode(const nlohmann::json& episode, const std::string& file,
                                    const ScoreOptions& options = {});

// Likewise of a file, of any length: of its steps one at a time is in memory, where those come after what
// they need (all but "stages" and "finalize").
nlohmann::ordered_json ScoreFile(const std::filesystem::path& file, const ScoreOptions& options = {});

}  // namespace evalbus::metrics
