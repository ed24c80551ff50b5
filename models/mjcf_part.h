// One MJCF file made ready for a composed document: checked against the installed MuJoCo, with angles in
// radians, absolute files and, if it is attached, names of its own.
#pragma once

#include <tinyxml2.h>

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "models/mjcf_file.h"
#include "models/mjcf_schema.h"

namespace evalbus::mjcf {

// Compiler settings that MuJoCo has once for the whole document, with their defaults.
const std::map<std::string, std::string>& GlobalSettings();

// All functions throw InputError with file and line.
class Part {
 public:
  // Reads the file and its <compiler>. What is dropped is said in warnings, which must outlive this object.
  Part(const std::filesystem::path& file, std::vector<std::string>* warnings);

  tinyxml2::XMLElement* root() { return mjcf_.root; }

  // The value of a compiler attribute, or its default.
  std::string compiler(const std::string& attribute, const std::string& otherwise) const;

  // Elements below <mujoco>; a file may have several of a name.
  std::vector<tinyxml2::XMLElement*> Sections(const char* name);
  void DeleteSections(const char* name);
  // The <default> sections, merged into one with the class name "main".
  tinyxml2::XMLElement* MainDefault();

  // Writes what MuJoCo 2.2 does not know of position servos (kv, inheritrange) in its own words, and gives
  // those that are named another stiffness (N m / rad, N / m) in place of theirs, without a velocity gain;
  // motors, which have none, become servos with it.
  // Before CheckSchema().
  void WriteServos(const std::map<std::string, double>& stiffness);
  // Checks every element and attribute against the installed MuJoCo.
  void CheckSchema();
  // Makes angles radians, files absolute and bodies' inertias what this file's compiler settings say.
  void Normalize();
  // Prefixes every name and reference; `world` is what the file's world body becomes.
  void Prefix(const std::string& prefix, const std::string& world);

 private:
  void ReadCompiler();
  void CheckElement(tinyxml2::XMLElement* element, const SchemaNode& parent, const std::string& parent_name);
  void CollectClasses(tinyxml2::XMLElement* definition);
  // The default classes that a class takes values over from, the outermost first, itself last.
  std::vector<const tinyxml2::XMLElement*> ClassChain(const std::string& name) const;
  // Makes the range of a motor's commands, torques, that of its force, and its commands angles.
  void ServoOfMotor(tinyxml2::XMLElement* motor);
  // Makes a multiple of its joint's range the range of the actuator's commands.
  void InheritRange(tinyxml2::XMLElement* actuator, double factor);
  // An attribute's value as the element or its default class says.
  std::optional<std::string> Effective(const tinyxml2::XMLElement* element, const std::string& childclass,
                                       const char* attribute) const;
  // Writes angles in radians at the joints themselves: in a default class it is not known yet whether a joint
  // slides.
  void ConvertJoints(tinyxml2::XMLElement* body, const std::string& childclass);
  // Those of euler and axisangle.
  void ConvertOrientations();
  // Makes the asset's files absolute; an asset without a name is called after its file.
  void ResolveFiles(tinyxml2::XMLElement* asset);

  MjcfFile mjcf_;
  std::vector<std::string>* warnings_;
  std::map<std::string, std::string> compiler_;
  tinyxml2::XMLElement* main_default_ = nullptr;
  std::map<std::string, tinyxml2::XMLElement*> classes_;
  // What was dropped -> where first, how often.
  std::map<std::string, std::pair<std::string, int>> dropped_;
};

}  // namespace evalbus::mjcf
