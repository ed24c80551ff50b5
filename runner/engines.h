// Finds sims with other versions of MuJoCo (docs/engines.md).
#pragma once

#include <filesystem>
#include <string>

#include "runner/processes.h"

namespace evalbus::runner {

// Finds the engine for a version ("3.3" or "3.3.3"). Candidates are evalbus' own MuJoCo and the sims
// evalbus-sim-VERSION in `folder`. Prefers a sim with exactly this version, then evalbus'
// own MuJoCo if its version begins with `wanted`, then the newest sim whose version does. Returns the sim's
// version, or an empty string for evalbus' own MuJoCo. Throws an InputError that begins with `option` and
// lists the available versions.
std::string FindEngine(const std::string& wanted, const std::string& option = "--engine",
                       const std::filesystem::path& folder = Processes::BinaryFolder());

// Returns the MuJoCo version of an engine that FindEngine() returned.
std::string EngineVersion(const std::string& engine);

// Returns the name of the sim's program: evalbus-sim if `engine` is empty.
std::string SimProgram(const std::string& engine);

}  // namespace evalbus::runner
