#include "models/force_limits.h"

#include <limits>

#include "models/yaml_reader.h"

namespace evalbus {
namespace {

// The duration below which ISO/TS 15066:2016 calls a contact transient.
constexpr double kTransientTime = 0.5;

ForceLimit ParseForceLimit(const YamlValue& value) {
  constexpr const char *kQuasiStatic = "quasi_static_force_N", *kTransient = "transient_force_N",
                       *kTime = "transient_s", *kGrip = "grip_force_N";
  const YamlMap map(value, {"bodies"}, {kQuasiStatic, kTransient, kTime, kGrip});
  const auto force = [&map](const char* key) {
    const YamlValue* given = map.Find(key);
    return given ? given->Number(kPositive) : std::numeric_limits<double>::infinity();
  };
  if (!map.Find(kGrip) || map.Find(kQuasiStatic) || map.Find(kTransient) || map.Find(kTime)) {
    // Reports which of the two limits of contacts is missing.
    YamlMap(value, {"bodies", kQuasiStatic, kTransient}, {kTime, kGrip});
  }
  ForceLimit limit{.region = value.key(),
                   .bodies = map["bodies"].Texts(),
                   .locations = {},
                   .quasi_static_force = force(kQuasiStatic),
                   .transient_force = force(kTransient),
                   .grip_force = force(kGrip),
                   .transient_time = kTransientTime};
  if (limit.bodies.empty()) map["bodies"].Fail("expected at least one body");
  for (const YamlValue& body : map["bodies"].List()) limit.locations.push_back(body.location());
  if (limit.transient_force < limit.quasi_static_force) {
    map[kTransient].Fail("expected at least quasi_static_force_N");
  }
  if (const YamlValue* time = map.Find(kTime)) limit.transient_time = time->Number(kNotNegative);
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
