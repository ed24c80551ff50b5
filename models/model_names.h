// The names of a run's model: what those in a task description refer to, and what its geoms are called. An
// operand is the name of an entity (an arm, an object, a fixture, "world"), else "<gripper>_gripper" for the
// pads of a gripper, else the name of a body, else of a geom.
#pragma once

#include <string>
#include <vector>

#include "evalbus/model_info_t.hpp"
#include "models/source_location.h"

namespace evalbus {

std::vector<std::string> ArmNames(const model_info_t& model);

class ModelNames {
 public:
  // Throws InputError where the message contradicts itself (an index out of range, another message version).
  // `model` must outlive this object.
  explicit ModelNames(const model_info_t& model);

  const model_info_t& model() const { return model_; }

  // These take ids of geoms that the model has.

  // Its own name, or its body's where it has none.
  const std::string& GeomName(int geom) const;
  bool IsRobot(int geom) const;
  // Of a manipulated object, and not one of its geoms that must not be touched.
  bool IsObject(int geom) const;

  // These throw InputError at `where`, with the names there are.

  // By geom id: 1 for the geoms of the operand, all of an entity's or a body's.
  std::vector<uint8_t> Geoms(const std::string& operand, const SourceLocation& where) const;
  // Body whose frame stands for the operand: an entity's first body. Not for geoms: their poses are not in
  // STATE.
  int Body(const std::string& operand, const SourceLocation& where) const;
  // Index into the lists of joints.
  int Joint(const std::string& name, const SourceLocation& where) const;
  // Index of a gripper; -1 where there is none of this name.
  int FindGripper(const std::string& name) const;
  int Gripper(const std::string& name, const SourceLocation& where) const;
  // By geom id: 1 for the gripper's pads.
  std::vector<uint8_t> Pads(int gripper) const;
  // By geom id: 1 for the geoms of an object (index into model_info_t.object_name).
  std::vector<uint8_t> ObjectGeoms(int object) const;

 private:
  int EntityOf(int geom) const { return model_.body_entity[model_.geom_body[geom]]; }
  std::vector<uint8_t> GeomsOfEntity(int entity) const;

  const model_info_t& model_;
};

}  // namespace evalbus
