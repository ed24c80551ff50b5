#include "sim/named_contacts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/suggestion.h"
#include "base/text.h"
#include "models/farthest.h"

namespace evalbus::sim {
namespace {

// Plausibility limit of depths, m.
constexpr double kDeepest = 1;

}  // namespace

NamedContacts::NamedContacts(const model_info_t& info) {
  std::vector<bool> is_pad(info.geom_name.size());
  for (const gripper_info_t& gripper : info.gripper) {
    for (const int geom : gripper.pad_geom) is_pad[static_cast<size_t>(geom)] = true;
  }
  // emplace() keeps the first geom of a name.
  for (int geom = 0; geom < info.num_geoms; ++geom) {
    const int entity = info.body_entity[info.geom_body[geom]];
    if (info.entity_kind[entity] != model_info_t::ROBOT) geoms_.emplace(info.entity_name[entity], geom);
  }
  for (const bool pads : {true, false}) {
    for (int geom = 0; geom < info.num_geoms; ++geom) {
      if (is_pad[static_cast<size_t>(geom)] == pads) {
        geoms_.emplace(info.body_name[info.geom_body[geom]], geom);
      }
    }
  }
  for (int geom = 0; geom < info.num_geoms; ++geom) {
    if (!info.geom_name[geom].empty()) geoms_.emplace(info.geom_name[geom], geom);
  }
}

std::vector<std::string> NamedContacts::Names() const {
  std::vector<std::string> names;
  for (const auto& [name, geom] : geoms_) names.push_back(name);
  return names;
}

std::string NamedContacts::Unknown(const std::string& name) const {
  return "there is no object, body or geom '" + Printable(name) + "'" +
         Suggestion(name, Names(), "; --map FILE can rename it");
}

std::string NamedContacts::Fault(const source_contact_t& contact) const {
  const std::string pair = "the contact of " + contact.name_a + " and " + contact.name_b;
  if (!(contact.penetration_m >= 0 && contact.penetration_m <= kDeepest)) {
    return fmt::format("{} has a penetration of {:.4g} m, expected 0 to {:g}", pair, contact.penetration_m,
                       kDeepest);
  }
  if (!std::ranges::all_of(contact.position_m, [](double at) { return std::abs(at) <= kFarthest; })) {
    return fmt::format("{} is at {:.4g}, {:.4g}, {:.4g} m, expected at most {:g} m from the origin", pair,
                       contact.position_m[0], contact.position_m[1], contact.position_m[2], kFarthest);
  }
  const double norm = std::hypot(contact.normal[0], contact.normal[1], contact.normal[2]);
  if (!(std::abs(norm - 1) <= 0.01)) {
    return fmt::format("{} has a normal of length {:.3g}, expected 1", pair, norm);
  }
  return "";
}

std::vector<contact_t> NamedContacts::Convert(const std::vector<source_contact_t>& contacts) const {
  std::map<std::pair<int, int>, contact_t> deepest;
  for (const source_contact_t& named : contacts) {
    contact_t contact{};
    contact.geom_a = geoms_.at(named.name_a);
    contact.geom_b = geoms_.at(named.name_b);
    if (contact.geom_a == contact.geom_b) continue;
    const double sign = contact.geom_a < contact.geom_b ? 1 : -1;
    if (sign < 0) std::swap(contact.geom_a, contact.geom_b);
    contact.distance_m = -named.penetration_m;
    std::ranges::copy(named.position_m, contact.position_m);
    for (int i = 0; i < 3; ++i) contact.normal[i] = sign * named.normal[i];
    const auto [at, is_new] = deepest.emplace(std::pair(contact.geom_a, contact.geom_b), contact);
    if (!is_new && contact.distance_m < at->second.distance_m) at->second = contact;
  }
  std::vector<contact_t> sorted;
  for (const auto& [pair, contact] : deepest) sorted.push_back(contact);
  return sorted;
}

}  // namespace evalbus::sim
