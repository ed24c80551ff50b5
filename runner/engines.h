// Sims with other versions of MuJoCo (docs/engines.md).
#pragma once

#include <string>

namespace evalbus::runner {

// Finds the engine for a version ("3.3" or "3.3.3"): the sim evalbus-sim-VERSION beside this program that has
// exactly this version; otherwise evalbus' own MuJoCo if its version begins with `wanted`; otherwise the
// newest of those sims that does. Returns the sim's version, or an empty string for evalbus' own MuJoCo.
// Throws InputError that begins with `option` and lists the available versions.
std::string FindEngine(const std::string& wanted, const std::string& option = "--engine");

// Version of MuJoCo of an engine that FindEngine() returned.
std::string EngineVersion(const std::string& engine);

// Name of the sim's program: evalbus-sim for an empty version.
std::string SimProgram(const std::string& engine);

}  // namespace evalbus::runner
