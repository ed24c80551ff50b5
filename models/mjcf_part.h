// Prepares one MJCF file for a composed document: checks it against the installed MuJoCo, converts angles to
// radians, makes file paths absolute and, if it is attached, prefixes its names.
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

// Compiler settings that MuJoCo has only once per document, with their defaults.
const std::map<std::string, std::string>& GlobalSettings();

// Maps assets of a part that the document already has to their names in the document. The key is (kind, name
// in the part); kinds are "mesh" and "texture".
using SharedAssets = std::map<std::pair<std::string, std::string>, std::string>;

// All functions throw InputError with file and line.
class Part {
 public:
  // Reads the file and its <compiler>. Appends a line to `warnings` for everything that is dropped;
  // `warnings` must outlive this object.
  Part(const std::filesystem::path& file, std::vector<std::string>* warnings);

  tinyxml2::XMLElement* root() { return mjcf_.root; }

  // Returns the value of a compiler attribute, or `otherwise` if it is not set.
  std::string compiler(const std::string& attribute, const std::string& otherwise) const;

  // Elements with this name directly below <mujoco>; a file may have several.
  std::vector<tinyxml2::XMLElement*> Sections(const char* name);
  void DeleteSections(const char* name);
  // Returns the <default> sections, merged into one section of class "main".
  tinyxml2::XMLElement* MainDefault();

  // Replaces attributes of position servos that MuJoCo 2.2 does not support (such as kv) by equivalent
  // attributes that it supports. Servos named in `stiffness` get that stiffness (N m / rad, N / m) and no
  // velocity gain. Motors named in it become position servos. Must be called before CheckSchema(). Throws
  // InputError if this is impossible, for example for dampratio.
  void WriteServos(const std::map<std::string, double>& stiffness);
  // Checks every element and attribute against the installed MuJoCo.
  void CheckSchema();
  // Converts angles to radians, makes file paths absolute, and applies this file's compiler settings to the
  // inertias of its bodies.
  void Normalize();
  // Removes a body with everything attached to it.
  void RemoveBody(const std::string& name);
  // Returns a description of everything except the name that determines how MuJoCo compiles a mesh, or a
  // texture from a file. Equal assets therefore have equal descriptions. Empty for other assets.
  std::string DescribeAsset(const tinyxml2::XMLElement* asset) const;
  // Prefixes every name and reference. `world`: new name of the file's world body. References to assets in
  // `shared` are replaced by the names of these assets in the document.
  void Prefix(const std::string& prefix, const std::string& world, const SharedAssets& shared);

 private:
  void ReadCompiler();
  void CheckElement(tinyxml2::XMLElement* element, const SchemaNode& parent, const std::string& parent_name);
  void CollectClasses(tinyxml2::XMLElement* definition);
  // Returns the default classes from which a class inherits values: the outermost first, the class itself
  // last.
  std::vector<const tinyxml2::XMLElement*> ClassChain(const std::string& name) const;
  // Converts a motor to a position servo. The limits of its command (torque) become limits of its force, and
  // its command becomes a position.
  void ServoOfMotor(tinyxml2::XMLElement* motor);
  // Sets the actuator's command range to its joint's range, scaled by `factor`.
  void InheritRange(tinyxml2::XMLElement* actuator, double factor);
  // Returns the value of an attribute at the element or, if it is missing there, in its default class.
  std::optional<std::string> Effective(const tinyxml2::XMLElement* element, const std::string& childclass,
                                       const char* attribute) const;
  // Writes angles in radians at the joints themselves, because a default class does not show whether a joint
  // slides or rotates.
  void ConvertJoints(tinyxml2::XMLElement* body, const std::string& childclass);
  // Sets kDensityAttribute on the geoms below `body`.
  void StateDensities(tinyxml2::XMLElement* body, const std::string& childclass);
  // Converts euler and axisangle orientations.
  void ConvertOrientations();
  // Makes the asset's file paths absolute. An asset without a name is named after its file.
  void ResolveFiles(tinyxml2::XMLElement* asset);

  MjcfFile mjcf_;
  std::vector<std::string>* warnings_;
  std::map<std::string, std::string> compiler_;
  tinyxml2::XMLElement* main_default_ = nullptr;
  std::map<std::string, tinyxml2::XMLElement*> classes_;
  // Source of the first occurrence, and number of occurrences, of each dropped element or attribute.
  std::map<std::string, std::pair<std::string, int>> dropped_;
};

}  // namespace evalbus::mjcf
