// Force limits of a run by region of bodies, similar to ISO/TS 15066:2016 and ISO 10218-2:2025. A region has
// a limit for short (transient) contacts and one for lasting (quasi-static) contacts, or a limit of the grip
// force on fragile objects, or both. The user gives the values (docs/limits.md).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "models/model_names.h"
#include "models/source_location.h"

namespace evalbus {

struct ForceLimit {
  std::string region;
  // Names of bodies, or of entities, which stand for all their bodies.
  std::vector<std::string> bodies;
  // The location of each name in the file.
  std::vector<SourceLocation> locations = {};
  // Limits in N; infinite if the region has no such limit. Either both of the first two are given or neither.
  double quasi_static_force;
  double transient_force;
  double grip_force;
  // A contact that has lasted for at most this time is transient, s.
  double transient_time;
};

// Throws InputError with file, line and key. `file` is only used in messages.
std::vector<ForceLimit> ParseForceLimits(const std::string& text, const std::string& file);

// Returns, for each body of the model, whether the limit concerns it. Throws InputError if a name does not
// exist, if a body with a limit of the grip force is not part of a manipulated object, or if no body has a
// geom, because such a limit could never be exceeded.
std::vector<uint8_t> BodiesOf(const ForceLimit& limit, const ModelNames& names);

}  // namespace evalbus
