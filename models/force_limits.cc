#include "models/force_limits.h"

#include "models/yaml_reader.h"

namespace evalbus {
namespace {

// The duration below which ISO/TS 15066:2016 calls a contact transient.
constexpr double kTransientTime = 0.5;

ForceLimit ParseForceLimit(const YamlValue& value) {
  const YamlMap map(value, {"bodies", "quasi_static_force_N", "transient_force_N"}, {"transient_s"});
  ForceLimit limit{.region = value.key(),
                   .bodies = map["bodies"].Texts(),
                   .locations = {},
                   .quasi_static_force = map["quasi_static_force_N"].Number(kPositive),
                   .transient_force = map["transient_force_N"].Number(kPositive),
                   .transient_time = kTransientTime};
  if (limit.bodies.empty()) map["bodies"].Fail("expected at least one body");
  for (const YamlValue& body : map["bodies"].List()) limit.locations.push_back(body.location());
  if (limit.transient_force < limit.quasi_static_force) {
    map["transient_force_N"].Fail("expected at least quasi_static_force_N");
  }
  if (const YamlValue* time = map.Find("transient_s")) limit.transient_time = time->Number(kNotNegative);
  return limit;
}

}  // namespace

std::vector<ForceLimit> ParseForceLimits(const std::string& text, const std::string& file) {
  const YamlValue regions = YamlMap(ParseYaml(text, file), {"limits"})["limits"];
  std::vector<ForceLimit> limits;
  for (const YamlValue& region : regions.Entries()) limits.push_back(ParseForceLimit(region));
  if (limits.empty()) regions.Fail("expected at least one region");
  return limits;
}

}  // namespace evalbus
