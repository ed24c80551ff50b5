#include "models/model_names.h"

#include <algorithm>
#include <initializer_list>

#include "base/errors.h"
#include "models/model_consistency.h"
#include "models/physics_model.h"
#include "models/yaml_reader.h"

namespace evalbus {
namespace {

constexpr char kGripperSuffix[] = "_gripper";

int Find(const std::vector<std::string>& names, const std::string& name) {
  const auto found = std::find(names.begin(), names.end(), name);
  return found == names.end() ? -1 : static_cast<int>(found - names.begin());
}

std::string List(std::vector<std::string> names, const std::string& suffix = "") {
  for (std::string& name : names) name += suffix;
  const std::string list = ListOf(std::move(names));
  return list.empty() ? "(none)" : list;
}

std::vector<std::string> Joined(std::initializer_list<const std::vector<std::string>*> lists) {
  std::vector<std::string> all;
  for (const auto* list : lists) all.insert(all.end(), list->begin(), list->end());
  return all;
}

// Throws InputError for an unknown name. It suggests the most similar name in `known`, or contains `expected`
// if no name is similar.
[[noreturn]] void Refuse(const SourceLocation& where, const std::string& what, const std::string& name,
                         const std::vector<std::string>& known, const std::string& expected) {
  const std::string nearest = NearestName(name, known);
  throw InputError(where.ToString() + ": " + what + " has the name '" + name + "'; " +
                   (nearest.empty() ? "expected " + expected : "did you mean '" + nearest + "'?"));
}

std::vector<std::string> GripperNames(const model_info_t& model) {
  std::vector<std::string> names;
  for (const gripper_info_t& gripper : model.gripper) names.push_back(gripper.name);
  return names;
}

}  // namespace

std::vector<std::string> ArmNames(const model_info_t& model) {
  std::vector<std::string> names;
  for (const arm_info_t& arm : model.arm) names.push_back(arm.name);
  return names;
}

ModelNames::ModelNames(const model_info_t& model) : model_(model) {
  CheckMessageVersion(model);
  if (model.timestep_us <= 0 || model.substeps <= 0) {
    throw InputError("MODEL: expected timestep_us and substeps above 0");
  }
  CheckConsistency(model);
}

const std::string& ModelNames::GeomName(int geom) const {
  const std::string& name = model_.geom_name[geom];
  return name.empty() ? model_.body_name[model_.geom_body[geom]] : name;
}

bool ModelNames::IsRobot(int geom) const { return model_.entity_kind[EntityOf(geom)] == model_info_t::ROBOT; }

bool ModelNames::IsObject(int geom) const {
  if (std::ranges::find(model_.forbidden_contact_geom, geom) != model_.forbidden_contact_geom.end())
    return false;
  const std::vector<int32_t>& objects = model_.object_entity;
  return std::find(objects.begin(), objects.end(), EntityOf(geom)) != objects.end();
}

std::vector<uint8_t> ModelNames::GeomsOfEntity(int entity) const {
  std::vector<uint8_t> geoms(model_.num_geoms);
  for (int geom = 0; geom < model_.num_geoms; ++geom) geoms[geom] = EntityOf(geom) == entity;
  return geoms;
}

std::vector<uint8_t> ModelNames::Geoms(const std::string& operand, const SourceLocation& where) const {
  if (const int entity = Find(model_.entity_name, operand); entity >= 0) return GeomsOfEntity(entity);
  for (int gripper = 0; gripper < model_.num_grippers; ++gripper) {
    if (operand == model_.gripper[gripper].name + kGripperSuffix) return Pads(gripper);
  }
  std::vector<uint8_t> geoms(model_.num_geoms);
  if (const int body = Find(model_.body_name, operand); body >= 0) {
    for (int geom = 0; geom < model_.num_geoms; ++geom) geoms[geom] = model_.geom_body[geom] == body;
    return geoms;
  }
  if (const int geom = Find(model_.geom_name, operand); geom >= 0) {
    geoms[geom] = 1;
    return geoms;
  }
  std::vector<std::string> known = Joined({&model_.entity_name, &model_.body_name, &model_.geom_name});
  for (const std::string& gripper : GripperNames(model_)) known.push_back(gripper + kGripperSuffix);
  Refuse(where, "nothing", operand, known,
         "an entity (" + List(model_.entity_name) + "), a gripper (" +
             List(GripperNames(model_), kGripperSuffix) + "), a body (" + List(model_.body_name) +
             ") or a geom (" + List(model_.geom_name) + ")");
}

int ModelNames::Body(const std::string& operand, const SourceLocation& where) const {
  if (const int entity = Find(model_.entity_name, operand); entity >= 0) {
    const int body = static_cast<int>(
        std::find(model_.body_entity.begin(), model_.body_entity.end(), entity) - model_.body_entity.begin());
    if (body < model_.num_bodies) return body;
    throw InputError(where.ToString() + ": '" + operand + "' has no body");
  }
  if (const int body = Find(model_.body_name, operand); body >= 0) return body;
  Refuse(where, "no entity or body", operand, Joined({&model_.entity_name, &model_.body_name}),
         "an entity (" + List(model_.entity_name) + ") or a body (" + List(model_.body_name) + ")");
}

std::vector<uint8_t> ModelNames::Bodies(const std::string& operand, const SourceLocation& where) const {
  std::vector<uint8_t> bodies(model_.num_bodies);
  const int entity = Find(model_.entity_name, operand);
  if (entity < 0) {
    bodies[Body(operand, where)] = 1;
  } else {
    for (int body = 0; body < model_.num_bodies; ++body) bodies[body] = model_.body_entity[body] == entity;
  }
  return bodies;
}

int ModelNames::Joint(const std::string& name, const SourceLocation& where) const {
  if (const int joint = Find(model_.joint_name, name); joint >= 0) return joint;
  Refuse(where, "no joint", name, model_.joint_name, List(model_.joint_name));
}

int ModelNames::FindGripper(const std::string& name) const { return Find(GripperNames(model_), name); }

int ModelNames::Gripper(const std::string& name, const SourceLocation& where) const {
  const int gripper = FindGripper(name);
  if (gripper >= 0) return gripper;
  Refuse(where, "no gripper", name, GripperNames(model_), List(GripperNames(model_)) + " or any");
}

std::vector<uint8_t> ModelNames::Pads(int gripper) const {
  std::vector<uint8_t> geoms(model_.num_geoms);
  for (int32_t geom : model_.gripper[gripper].pad_geom) geoms[geom] = 1;
  return geoms;
}

std::vector<uint8_t> ModelNames::ObjectGeoms(int object) const {
  return GeomsOfEntity(model_.object_entity[object]);
}

}  // namespace evalbus
