#include "models/mjcf_part.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "base/angles.h"
#include "models/mesh_faces.h"
#include "models/mjcf_xml.h"

namespace evalbus::mjcf {
namespace {

using tinyxml2::XMLElement;

// Attributes whose value is the name of an element or a class.
const std::set<std::string>& NameAttributes() {
  static const std::set<std::string> names = {
      "name",    "class",   "childclass",    "mesh",      "material",  "texture",  "hfield", "joint",
      "joint1",  "joint2",  "jointinparent", "body",      "body1",     "body2",    "geom",   "geom1",
      "geom2",   "site",    "tendon",        "tendon1",   "tendon2",   "actuator", "target", "objname",
      "refname", "refsite", "sidesite",      "cranksite", "slidersite"};
  return names;
}

// Returns true if this attribute of this element names a body.
bool NamesBody(const XMLElement* element, const std::string& attribute) {
  if (attribute == "body" || attribute == "body1" || attribute == "body2" || attribute == "target")
    return true;
  const std::string type = attribute == "objname"   ? Get(element, "objtype")
                           : attribute == "refname" ? Get(element, "reftype")
                                                    : "";
  return type == "body" || type == "xbody";
}

using Quaternion = std::array<double, 4>;

Quaternion Multiply(const Quaternion& a, const Quaternion& b) {
  return {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
          a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
          a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
          a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
}

// In `sequence`, lower-case letters rotate about the moving axes, upper-case letters about the fixed axes.
Quaternion FromEuler(const std::vector<double>& angles, const std::string& sequence) {
  Quaternion result{1, 0, 0, 0};
  for (size_t i = 0; i < 3; ++i) {
    Quaternion turn{std::cos(angles[i] / 2), 0, 0, 0};
    turn[1 + std::tolower(sequence[i]) - 'x'] = std::sin(angles[i] / 2);
    result = std::islower(sequence[i]) ? Multiply(result, turn) : Multiply(turn, result);
  }
  return result;
}

void RemoveInertials(XMLElement* body) {
  for (XMLElement* child : Children(body)) {
    if (Is(child, "body")) {
      RemoveInertials(child);
    } else if (Is(child, "inertial")) {
      body->DeleteChild(child);
    }
  }
}

}  // namespace

const std::map<std::string, std::string>& GlobalSettings() {
  static const std::map<std::string, std::string> settings = {
      {"boundmass", "0"},           {"boundinertia", "0"},   {"settotalmass", "-1"},
      {"balanceinertia", "false"},  {"coordinate", "local"}, {"fitaabb", "false"},
      {"convexhull", "true"},       {"fusestatic", "false"}, {"inertiagrouprange", "0 5"},
      {"exactmeshinertia", "false"}};
  return settings;
}

Part::Part(const std::filesystem::path& file, std::vector<std::string>* warnings)
    : mjcf_(ReadMjcf(file)), warnings_(warnings) {
  ReadCompiler();
  CollectClasses(MainDefault());
}

std::string Part::compiler(const std::string& attribute, const std::string& otherwise) const {
  const auto found = compiler_.find(attribute);
  return found == compiler_.end() ? otherwise : found->second;
}

std::vector<XMLElement*> Part::Sections(const char* name) {
  std::vector<XMLElement*> sections;
  for (XMLElement* section : Children(mjcf_.root)) {
    if (Is(section, name)) sections.push_back(section);
  }
  return sections;
}

void Part::DeleteSections(const char* name) {
  for (XMLElement* section : Sections(name)) mjcf_.root->DeleteChild(section);
}

XMLElement* Part::MainDefault() {
  if (main_default_) return main_default_;
  XMLElement*& main = main_default_;
  for (XMLElement* section : Sections("default")) {
    const std::string name = Get(section, "class", "main");
    if (name != "main")
      Fail(section, "the outermost default class must be called 'main', not '" + name + "'");
    if (!main) {
      main = section;
      continue;
    }
    for (XMLElement* child : Children(section)) {
      // MuJoCo does not pass defaults on to classes that have already been defined.
      if (!Is(child, "default") && main->FirstChildElement("default")) {
        Fail(child, Tag(child) + " defaults must come before the default classes of " +
                        SourceOf(main->FirstChildElement("default")));
      }
      XMLElement* same = Is(child, "default") ? nullptr : main->FirstChildElement(child->Name());
      if (!same) {
        main->InsertEndChild(child);
        continue;
      }
      for (const auto* a = child->FirstAttribute(); a; a = a->Next())
        same->SetAttribute(a->Name(), a->Value());
    }
    mjcf_.root->DeleteChild(section);
  }
  if (!main) {
    main = mjcf_.root->InsertNewChildElement("default");
    Set(main, kSourceAttribute, SourceOf(mjcf_.root));
  }
  Set(main, "class", "main");
  return main;
}

void Part::CheckSchema() {
  for (XMLElement* section : Children(mjcf_.root)) CheckElement(section, Schema(), "mujoco");
  for (const auto& [what, occurrence] : dropped_) {
    const auto& [source, count] = occurrence;
    warnings_->push_back(source + ": " + what + " is not known to MuJoCo " + mj_versionString() +
                         "; dropped" + (count > 1 ? " (" + std::to_string(count) + " times)" : ""));
  }
}

void Part::Normalize() {
  const bool degree = compiler("angle", "degree") == "degree";
  for (XMLElement* section : Sections("worldbody")) {
    const auto* attribute = section->FirstAttribute();
    while (attribute && std::string(attribute->Name()) == kSourceAttribute) attribute = attribute->Next();
    if (attribute) Fail(section, "<worldbody> cannot have attributes");
    if (degree) ConvertJoints(section, "main");
    StateDensities(section, "main");
    if (compiler("inertiafromgeom", "auto") == "true") RemoveInertials(section);
  }
  ConvertOrientations();
  for (XMLElement* section : Sections("asset")) {
    for (XMLElement* asset : Children(section)) ResolveFiles(asset);
  }
}

void Part::ConvertOrientations() {
  const bool degree = compiler("angle", "degree") == "degree";
  const std::string sequence = compiler("eulerseq", "xyz");
  ForEach(mjcf_.root, [&](XMLElement* element) {
    if (const char* text = element->Attribute("euler"); text && (degree || sequence != "xyz")) {
      std::vector<double> angles = ParseNumbers(element, "euler", text, 3);
      if (degree) {
        for (double& angle : angles) angle *= kDegree;
      }
      Set(element, "quat", Join(FromEuler(angles, sequence)));
      element->DeleteAttribute("euler");
    }
    if (const char* text = element->Attribute("axisangle"); text && degree) {
      std::vector<double> values = ParseNumbers(element, "axisangle", text, 4);
      values[3] *= kDegree;
      Set(element, "axisangle", Join(values));
    }
  });
}

void Part::RemoveBody(const std::string& name) {
  XMLElement* found = nullptr;
  for (XMLElement* section : Sections("worldbody")) {
    ForEach(section, [&](XMLElement* element) {
      if (Is(element, "body") && Get(element, "name") == name) found = element;
    });
  }
  if (!found) Fail(mjcf_.root, "there is no body '" + name + "' to leave out");
  found->Parent()->DeleteChild(found);
}

std::string Part::DescribeAsset(const XMLElement* asset) const {
  const bool is_mesh = Is(asset, "mesh") && (asset->Attribute("file") || asset->Attribute("vertex"));
  const bool is_texture = Is(asset, "texture") && asset->Attribute("file");
  if (!is_mesh && !is_texture) return "";
  std::string text = asset->Name();
  const SchemaNode* section = ChildSchema(Schema(), "mujoco", "asset");
  for (const std::string& attribute : ChildSchema(*section, "asset", asset->Name())->attributes) {
    if (attribute == "name" || attribute == "class") continue;
    if (const auto value = Effective(asset, "main", attribute.c_str()))
      text += "\n" + attribute + "=" + *value;
  }
  return text;
}

void Part::Prefix(const std::string& prefix, const std::string& world, const SharedAssets& shared) {
  ForEach(mjcf_.root, [&](XMLElement* element) {
    for (const auto* a = element->FirstAttribute(); a; a = a->Next()) {
      const std::string name = a->Name(), value = a->Value();
      if (!NameAttributes().contains(name) || value.empty()) continue;
      const bool is_world = value == "world" && NamesBody(element, name);
      const auto asset = shared.find({name, value});
      element->SetAttribute(a->Name(), (is_world                ? world
                                        : asset != shared.end() ? asset->second
                                                                : prefix + value)
                                           .c_str());
    }
    // Without a second body, these elements connect to the world.
    if ((Is(element, "connect") || Is(element, "weld")) && element->Attribute("body1") &&
        !element->Attribute("body2")) {
      Set(element, "body2", world);
    }
  });
}

void Part::ReadCompiler() {
  static const std::set<std::string> kOwn = {"autolimits", "angle",        "eulerseq",  "meshdir",
                                             "texturedir", "assetdir",     "strippath", "inertiafromgeom",
                                             "usethread",  "discardvisual"};
  const XMLElement* last = mjcf_.root;
  for (XMLElement* compiler : Sections("compiler")) {
    if (const XMLElement* child = compiler->FirstChildElement()) {
      Fail(child, Tag(child) + " in <compiler> is not supported");
    }
    for (const auto* a = compiler->FirstAttribute(); a; a = a->Next()) {
      const std::string name = a->Name();
      if (name == kSourceAttribute) continue;
      if (!kOwn.contains(name) && !GlobalSettings().contains(name)) {
        Fail(compiler, "<compiler>: attribute '" + name + "' is not supported");
      }
      compiler_[name] = a->Value();
    }
    last = compiler;
  }
  const auto check = [&](const std::string& attribute, std::initializer_list<const char*> values) {
    const std::string value = compiler(attribute, *values.begin());
    if (std::find(values.begin(), values.end(), value) == values.end()) {
      Fail(last, "<compiler>: attribute '" + attribute + "': '" + value + "' is not allowed");
    }
  };
  check("angle", {"degree", "radian"});
  check("strippath", {"false", "true"});
  check("inertiafromgeom", {"auto", "true", "false"});
  const std::string sequence = compiler("eulerseq", "xyz");
  if (sequence.size() != 3 || sequence.find_first_not_of("xyzXYZ") != std::string::npos) {
    Fail(last, "<compiler>: attribute 'eulerseq': expected three of xyzXYZ, got '" + sequence + "'");
  }
}

void Part::CheckElement(XMLElement* element, const SchemaNode& parent, const std::string& parent_name) {
  const std::string name = element->Name();
  const SchemaNode* schema = ChildSchema(parent, parent_name, name);
  if (!schema) {
    Fail(element, Tag(element) + " in <" + parent_name + "> is not known to MuJoCo " + mj_versionString());
  }
  if (name == "composite") Fail(element, "<composite> is not supported");
  for (const auto* a = element->FirstAttribute(); a;) {
    const std::string attribute = a->Name();
    a = a->Next();
    if (attribute == kSourceAttribute || schema->attributes.contains(attribute)) continue;
    const std::string what = Tag(element) + ": attribute '" + attribute + "'";
    if (!CanBeDropped(name, attribute)) {
      Fail(element, what + " is not known to MuJoCo " + mj_versionString());
    }
    ++dropped_.emplace(what, std::pair(SourceOf(element), 0)).first->second.second;
    element->DeleteAttribute(attribute.c_str());
  }
  for (XMLElement* child : Children(element)) CheckElement(child, *schema, name);
}

void Part::CollectClasses(XMLElement* definition) {
  classes_[Get(definition, "class")] = definition;
  for (XMLElement* child : Children(definition)) {
    if (Is(child, "default")) CollectClasses(child);
  }
}

std::vector<const XMLElement*> Part::ClassChain(const std::string& name) const {
  std::vector<const XMLElement*> chain;
  const auto found = classes_.find(name);
  const XMLElement* definition = found == classes_.end() ? nullptr : found->second;
  for (; definition && Is(definition, "default"); definition = definition->Parent()->ToElement()) {
    chain.insert(chain.begin(), definition);
  }
  return chain;
}

std::optional<std::string> Part::Effective(const XMLElement* element, const std::string& childclass,
                                           const char* attribute) const {
  if (const char* own = element->Attribute(attribute)) return own;
  std::optional<std::string> value;
  for (const XMLElement* definition : ClassChain(Get(element, "class", childclass))) {
    const XMLElement* defaults = definition->FirstChildElement(element->Name());
    if (defaults && defaults->Attribute(attribute)) value = defaults->Attribute(attribute);
  }
  return value;
}

void Part::ConvertJoints(XMLElement* body, const std::string& childclass) {
  for (XMLElement* child : Children(body)) {
    if (Is(child, "body")) ConvertJoints(child, Get(child, "childclass", childclass));
    if (!Is(child, "joint")) continue;
    const std::string type = Effective(child, childclass, "type").value_or("hinge");
    for (const char* attribute : {"range", "ref", "springref"}) {
      const bool is_angle = type == "hinge" || (type == "ball" && std::string(attribute) == "range");
      const std::optional<std::string> text = Effective(child, childclass, attribute);
      if (!is_angle || !text) continue;
      std::vector<double> values = ParseNumbers(child, attribute, *text, 0);
      for (double& value : values) value *= kDegree;
      Set(child, attribute, Join(values));
    }
  }
}

void Part::StateDensities(XMLElement* body, const std::string& childclass) {
  for (XMLElement* child : Children(body)) {
    if (Is(child, "body")) StateDensities(child, Get(child, "childclass", childclass));
    if (!Is(child, "geom") || !child->Attribute("mesh")) continue;
    if (Effective(child, childclass, "type") != "mesh" || Effective(child, childclass, "mass")) continue;
    Set(child, kDensityAttribute, Effective(child, childclass, "density").value_or("1000"));
  }
}

void Part::ResolveFiles(XMLElement* asset) {
  const char* setting = Is(asset, "texture") ? "texturedir" : "meshdir";
  const std::filesystem::path folder = mjcf_.file.parent_path() / compiler(setting, compiler("assetdir", ""));
  for (const char* attribute :
       {"file", "fileright", "fileleft", "fileup", "filedown", "filefront", "fileback"}) {
    const char* text = asset->Attribute(attribute);
    if (!text) continue;
    std::filesystem::path file = text;
    if (std::string(attribute) == "file" && !asset->Attribute("name"))
      Set(asset, "name", file.stem().string());
    if (compiler("strippath", "false") == "true") file = file.filename();
    file = (folder / file).lexically_normal();
    if (!std::filesystem::is_regular_file(file)) {
      Fail(asset, Tag(asset) + ": file " + file.string() + " does not exist");
    }
    Set(asset, attribute, file.string());
    if (!Is(asset, "mesh") || file.extension() != ".obj") continue;
    if (const std::optional<MeshFaces> mesh = SeparateFaces(file)) {
      asset->DeleteAttribute("file");
      Set(asset, "vertex", Join(mesh->vertex));
      Set(asset, "face", Join(mesh->face));
      if (!mesh->texcoord.empty()) Set(asset, "texcoord", Join(mesh->texcoord));
    }
  }
}

}  // namespace evalbus::mjcf
