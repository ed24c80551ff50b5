// A recorded trajectory as JSON (docs/metrics.md, "Scoring a recorded trajectory"), scored without any bus.
#pragma once

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

}  // namespace evalbus::metrics
