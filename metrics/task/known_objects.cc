#include "metrics/task/known_objects.h"

#include <algorithm>

#include "models/unlocated_parts.h"

namespace evalbus::metrics {

KnownObjects::KnownObjects(const model_info_t& model, const TaskDescription& task) {
  for (int object = 0; object < model.num_objects; ++object) {
    if (!model.object_is_tracked[object]) AddUnknown(model.object_name[object], model);
  }
  all_objects_ = unknown_.empty();
  if (model.has_physics) return;
  for (const std::string& part : UnlocatedParts(task, model)) AddUnknown(part, model);
}

void KnownObjects::AddUnknown(const std::string& name, const model_info_t& model) {
  unknown_.push_back(name);
  unknown_geoms_.resize(model.num_geoms);
  for (int geom = 0; geom < model.num_geoms; ++geom) {
    const int entity = model.body_entity[model.geom_body[geom]];
    if (model.entity_name[entity] != name) continue;
    unknown_geoms_[geom] = 1;
    lacks_forbidden_contact_geoms_ |= model.entity_kind[entity] == model_info_t::FIXTURE ||
                                      std::ranges::count(model.forbidden_contact_geom, geom) > 0;
  }
}

bool KnownObjects::KnowsNames(const YamlValue& value) const {
  if (value.is_map()) {
    return std::ranges::all_of(value.Entries(), [this](const YamlValue& entry) {
      return entry.key() == "axis" || KnowsNames(entry);
    });
  }
  if (value.is_list()) {
    return std::ranges::all_of(value.List(), [this](const YamlValue& one) { return KnowsNames(one); });
  }
  if (!value.is_scalar()) return true;
  const std::string name = value.Text();
  return std::ranges::none_of(
      unknown_, [&](const std::string& object) { return name == object || name.starts_with(object + "/"); });
}

bool KnownObjects::Knows(const Expression& expression, const TaskDescription& task) const {
  if (unknown_.empty() || expression.name.empty()) return true;
  if (expression.name == "reached") {
    const std::string name = YamlMap(expression.arguments, {"stage"})["stage"].Text();
    const auto stage = std::ranges::find(task.stages, name, &Stage::name);
    return stage == task.stages.end() || Knows(stage->when, task);
  }
  // The arguments of a combination are the source text of its operands, so the operands are checked instead.
  if (expression.operands.empty()) return KnowsNames(expression.arguments);
  return std::ranges::all_of(expression.operands,
                             [&](const Expression& operand) { return Knows(operand, task); });
}

}  // namespace evalbus::metrics
