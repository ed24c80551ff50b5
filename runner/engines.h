// Sims with other versions of MuJoCo (docs/engines.md).
#pragma once

#include <string>

namespace evalbus::runner {

// The newest version that begins with `wanted` ("3.3" or "3.3.3") and whose sim, evalbus-sim-VERSION, is
// beside this program. Throws InputError that lists the available versions.
std::string FindEngine(const std::string& wanted);

// Name of the sim's program: evalbus-sim for an empty version.
std::string SimProgram(const std::string& engine);

}  // namespace evalbus::runner
