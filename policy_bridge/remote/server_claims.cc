#include "policy_bridge/remote/server_claims.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

namespace evalbus::policy {
namespace {

using Lines = std::vector<std::string>;

std::string TextOf(const Value* value) {
  const std::string* text = value ? value->As<std::string>() : nullptr;
  return text ? *text : "";
}

std::string Listed(const std::set<std::string>& names) {
  return names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "));
}

// Adds a line for names that only the server or only the contract has.
void CompareNames(const std::string& what, const std::set<std::string>& server,
                  const std::set<std::string>& ours, Lines* lines) {
  if (server == ours) return;
  lines->push_back(
      fmt::format("{}: the server has {}, the contract has {}", what, Listed(server), Listed(ours)));
}

// Checks RoboArena's configuration map.
Lines OfRoboArena(const Contract& contract, const Value& metadata) {
  Lines lines;
  const std::string space = TextOf(metadata.Find("action_space"));
  const std::string expected = space == "joint_position"       ? "joint_position"
                               : space == "joint_velocity"     ? "joint_velocity"
                               : space == "cartesian_position" ? "eef_pose"
                               : space == "cartesian_velocity" ? "eef_delta"
                                                               : "";
  if (!space.empty() && expected != NameOf(contract.actions.kind)) {
    lines.push_back(fmt::format("action space: the server states {}, the contract states {}", space,
                                NameOf(contract.actions.kind)));
  }
  const Value* resolution = metadata.Find("image_resolution");
  const List* size = resolution ? resolution->As<List>() : nullptr;
  if (!size || size->size() != 2) return lines;
  const int64_t* first = (*size)[0].As<int64_t>();
  const int64_t* second = (*size)[1].As<int64_t>();
  if (!first || !second) return lines;
  for (const ObservationEntry& entry : contract.observation) {
    if (entry.source != ObservationEntry::Source::kCamera) continue;
    const ImageForm& form = entry.image;
    const int width = form.width_px > 0 ? form.width_px : form.view.width_px;
    const int height = form.width_px > 0 ? form.height_px : form.view.height_px;
    // Whether the server's resolution is (width, height) or (height, width) is undocumented, and RoboArena's
    // own images are square. Either order is therefore accepted.
    if (std::minmax<int64_t>(width, height) == std::minmax(*first, *second)) continue;
    lines.push_back(fmt::format("{}: the server expects {} x {} pixels, the contract sends {} x {}",
                                entry.KeyText(), *first, *second, width, height));
  }
  return lines;
}

// Checks the payload of vla-eval's hello message.
Lines OfVlaEval(const Contract& contract, const Value& metadata) {
  Lines lines;
  const Value* spec = metadata.Find("action_spec");
  const Map* parts = spec ? spec->As<Map>() : nullptr;
  if (!parts || parts->empty()) return lines;
  int64_t values = 0;
  std::string words;
  for (const auto& [name, part] : *parts) {
    const Value* dims = part.Find("dims");
    const int64_t* count = dims ? dims->As<int64_t>() : nullptr;
    if (!count) return lines;
    values += *count;
    words +=
        fmt::format("{}{} {} ({})", words.empty() ? "" : ", ", name, *count, TextOf(part.Find("format")));
  }
  if (values != contract.actions.num_values) {
    lines.push_back(fmt::format("action: the server states {} values ({}), the contract states {}", values,
                                words, contract.actions.num_values));
  }
  return lines;
}

std::set<std::string> ModalityKeys(const Value& metadata, const char* modality) {
  std::set<std::string> names;
  const Value* config = metadata.Find(modality);
  const Value* keys = config ? config->Find("modality_keys") : nullptr;
  if (const List* list = keys ? keys->As<List>() : nullptr) {
    for (const Value& key : *list) names.insert(TextOf(&key));
  }
  return names;
}

// Checks GR00T's modality configuration.
Lines OfGroot(const Contract& contract, const Value& metadata) {
  Lines lines;
  for (const char* modality : {"video", "state"}) {
    const std::string prefix = std::string(modality) + ".";
    std::set<std::string> ours;
    for (const ObservationEntry& entry : contract.observation) {
      if (entry.KeyText().starts_with(prefix)) ours.insert(entry.KeyText().substr(prefix.size()));
    }
    if (metadata.Find(modality)) CompareNames(modality, ModalityKeys(metadata, modality), ours, &lines);
    const Value* config = metadata.Find(modality);
    const Value* indices = config ? config->Find("delta_indices") : nullptr;
    const List* list = indices ? indices->As<List>() : nullptr;
    if (!list) continue;
    for (const ObservationEntry& entry : contract.observation) {
      if (!entry.KeyText().starts_with(prefix) || entry.history_ticks.size() == list->size()) continue;
      lines.push_back(fmt::format("{}: the server expects {} ticks, the contract has {} (history_ticks)",
                                  entry.KeyText(), list->size(), entry.history_ticks.size()));
    }
  }
  if (metadata.Find("action")) {
    const std::set<std::string> server = ModalityKeys(metadata, "action");
    for (const std::string& key : contract.action_keys) {
      if (!server.contains(key)) {
        lines.push_back(
            fmt::format("action: the contract uses '{}', the server has {}", key, Listed(server)));
      }
    }
  }
  return lines;
}

}  // namespace

std::vector<std::string> FindContradictions(const Contract& contract, const Value& metadata) {
  switch (contract.wire) {
    case Wire::kOpenpi:
      // RoboArena's dialect of the same wire is recognized by its metadata.
      return metadata.Find("action_space") ? OfRoboArena(contract, metadata) : Lines{};
    case Wire::kRoboArena:
      return OfRoboArena(contract, metadata);
    case Wire::kVlaEval:
      return OfVlaEval(contract, metadata);
    case Wire::kGroot:
      return OfGroot(contract, metadata);
    case Wire::kRest:
    case Wire::kXPolicyLab:
      return {};
  }
  return {};
}

}  // namespace evalbus::policy
