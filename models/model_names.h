// Resolves names in a task description to bodies, geoms, joints and grippers of a run's model. An operand is
// looked up in this order: an entity (an arm, an object, a fixture, "world"), "<gripper>_gripper" for the
// pads of a gripper, a body, a geom.
#pragma once

#include <string>
#include <vector>

#include "evalbus/model_info_t.hpp"
#include "models/source_location.h"

namespace evalbus {

std::vector<std::string> ArmNames(const model_info_t& model);

class ModelNames {
 public:
  // Throws InputError if the message is inconsistent (an index out of range, another message version).
  // `model` must outlive this object.
  explicit ModelNames(const model_info_t& model);

  const model_info_t& model() const { return model_; }

  // The following three functions require a valid geom id.

  // Returns the geom's name or, if the geom has no name, its body's name.
  const std::string& GeomName(int geom) const;
  bool IsRobot(int geom) const;
  // Returns true for geoms of a manipulated object, except those that must not be touched.
  bool IsObject(int geom) const;

  // For an unknown name, functions with the parameter `where` throw an InputError that names this location,
  // and suggests a similar name or lists the valid names.

  // Returns a mask by geom id: 1 for the geoms of the operand (a gripper's pads, all geoms of an entity or a
  // body, or one geom).
  std::vector<uint8_t> Geoms(const std::string& operand, const SourceLocation& where) const;
  // Returns the body whose frame represents the operand; for an entity, this is its first body. Geoms are not
  // accepted, because their poses are not in STATE.
  int Body(const std::string& operand, const SourceLocation& where) const;
  // Returns a mask by body id: 1 for all bodies of an entity, or for the body.
  std::vector<uint8_t> Bodies(const std::string& operand, const SourceLocation& where) const;
  // Returns the index into the lists of joints.
  int Joint(const std::string& name, const SourceLocation& where) const;
  // Returns the index of a gripper; -1 if there is no gripper with this name.
  int FindGripper(const std::string& name) const;
  int Gripper(const std::string& name, const SourceLocation& where) const;
  // Returns a mask by geom id: 1 for the gripper's pads.
  std::vector<uint8_t> Pads(int gripper) const;
  // Returns a mask by geom id: 1 for the geoms of an object (index into model_info_t.object_name).
  std::vector<uint8_t> ObjectGeoms(int object) const;

 private:
  int EntityOf(int geom) const { return model_.body_entity[model_.geom_body[geom]]; }
  std::vector<uint8_t> GeomsOfEntity(int entity) const;

  const model_info_t& model_;
};

}  // namespace evalbus
