#include "models/scene_composer.h"

#include <tinyxml2.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <sstream>

#include "base/errors.h"
#include "models/mjcf_file.h"
#include "models/source_location.h"

namespace evalbus {
namespace {

using tinyxml2::XMLDocument;
using tinyxml2::XMLElement;

constexpr double kRadPerDeg = std::numbers::pi / 180;

// --- XML helpers
// ----------------------------------------------------------------------------------------------------

[[noreturn]] void Fail(const XMLElement* element, const std::string& message) {
  throw InputError(OneLine(SourceOf(element) + ": " + message));
}

std::string Tag(const XMLElement* element) { return "<" + std::string(element->Name()) + ">"; }

std::string Get(const XMLElement* element, const char* attribute, const std::string& otherwise = "") {
  const char* value = element->Attribute(attribute);
  return value ? value : otherwise;
}

void Set(XMLElement* element, const char* attribute, const std::string& value) {
  element->SetAttribute(attribute, value.c_str());
}

bool Is(const XMLElement* element, const char* name) { return std::string(element->Name()) == name; }

std::vector<XMLElement*> Children(XMLElement* element) {
  std::vector<XMLElement*> children;
  for (XMLElement* child = element->FirstChildElement(); child; child = child->NextSiblingElement()) {
    children.push_back(child);
  }
  return children;
}

// Calls visit(element) for the element and all below it, parents first.
template <typename Visit>
void ForEach(XMLElement* element, const Visit& visit) {
  visit(element);
  for (XMLElement* child : Children(element)) ForEach(child, visit);
}

// Shortest text that reads back as the same number.
std::string Number(double value) {
  std::array<char, 32> text{};
  const auto result = std::to_chars(text.data(), text.data() + text.size(), value);
  return std::string(text.data(), result.ptr);
}

template <typename Numbers>
std::string Join(const Numbers& numbers) {
  std::string text;
  for (double number : numbers) {
    if (!text.empty()) text += ' ';
    text += Number(number);
  }
  return text;
}

// `count` numbers; 0: any count.
std::vector<double> ParseNumbers(const XMLElement* element, const char* attribute, const std::string& text,
                                 size_t count) {
  std::vector<double> numbers;
  std::istringstream stream(text);
  double number = 0;
  while (stream >> number) numbers.push_back(number);
  if (!stream.eof() || (count != 0 && numbers.size() != count)) {
    Fail(element, Tag(element) + ": attribute '" + attribute + "': expected " +
                      (count != 0 ? std::to_string(count) + " " : "") + "numbers, got '" + text + "'");
  }
  return numbers;
}

// --- What the installed MuJoCo knows
// --------------------------------------------------------------------------------

struct SchemaNode {
  std::set<std::string> attributes;
  std::map<std::string, SchemaNode> children;
};

// MuJoCo prints its own schema as an indented table: name in steps of 3 columns, attributes from column 30
// on.
SchemaNode ReadSchema() {
  std::vector<char> buffer(1 << 20);
  mj_printSchema(nullptr, buffer.data(), static_cast<int>(buffer.size()), 0, 0);
  std::istringstream table(buffer.data());
  constexpr size_t kAttributeColumn = 30;
  SchemaNode root;
  std::vector<SchemaNode*> open{&root};
  for (std::string line; std::getline(table, line);) {
    const size_t first = line.find_first_not_of(' ');
    if (first == std::string::npos) continue;
    std::istringstream words(line);
    if (first < kAttributeColumn) {
      std::string name, count;
      words >> name >> count;
      open.resize(first / 3 + 1);
      open.push_back(&open.back()->children[name]);
    }
    for (std::string attribute; words >> attribute;) open.back()->attributes.insert(attribute);
  }
  SchemaNode mujoco = root.children.at("mujoco");
  mujoco.children["worldbody"] = mujoco.children.at("(world)body");
  return mujoco;
}

const SchemaNode& Schema() {
  static const SchemaNode schema = ReadSchema();
  return schema;
}

// The schema of a child element; <body> and <default> contain themselves.
const SchemaNode* ChildSchema(const SchemaNode& parent, const std::string& parent_name,
                              const std::string& name) {
  const auto found = parent.children.find(name);
  if (found != parent.children.end()) return &found->second;
  if (name == "body" && (parent_name == "body" || parent_name == "worldbody")) {
    return &Schema().children.at("worldbody");
  }
  if (name == "default" && parent_name == "default") return &Schema().children.at("default");
  return nullptr;
}

// Attributes of newer versions without which the physics stays meaningful.
bool CanBeDropped(const std::string& element, const std::string& attribute) {
  static const std::set<std::string> kLooks = {
      "metallic",   "roughness",  "sensorsize", "focal",      "focalpixel",   "principal",   "principalpixel",
      "resolution", "bulbradius", "intensity",  "colorspace", "content_type", "orthographic"};
  static const std::map<std::string, std::set<std::string>> kPhysics = {
      {"body", {"gravcomp", "sleep"}},
      {"joint", {"actuatorfrcrange", "actuatorfrclimited", "actuatorgravcomp"}},
      {"mesh", {"maxhullvert", "inertia"}},
      {"light", {"type", "range", "texture"}},
  };
  const auto found = kPhysics.find(element);
  return kLooks.contains(attribute) || (found != kPhysics.end() && found->second.contains(attribute));
}

// --- Names
// ----------------------------------------------------------------------------------------------------------

// Attributes that hold the name of an element or a class.
const std::set<std::string>& NameAttributes() {
  static const std::set<std::string> names = {
      "name",    "class",   "childclass",    "mesh",      "material",  "texture",  "hfield", "joint",
      "joint1",  "joint2",  "jointinparent", "body",      "body1",     "body2",    "geom",   "geom1",
      "geom2",   "site",    "tendon",        "tendon1",   "tendon2",   "actuator", "target", "objname",
      "refname", "refsite", "sidesite",      "cranksite", "slidersite"};
  return names;
}

// Does this attribute of this element name a body?
bool NamesBody(const XMLElement* element, const std::string& attribute) {
  if (attribute == "body" || attribute == "body1" || attribute == "body2" || attribute == "target")
    return true;
  const std::string type = attribute == "objname"   ? Get(element, "objtype")
                           : attribute == "refname" ? Get(element, "reftype")
                                                    : "";
  return type == "body" || type == "xbody";
}

// --- Orientation
// ----------------------------------------------------------------------------------------------------

using Quaternion = std::array<double, 4>;

Quaternion Multiply(const Quaternion& a, const Quaternion& b) {
  return {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
          a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
          a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
          a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
}

// Lower-case letters rotate about the moving axes, capitals about the fixed ones.
Quaternion FromEuler(const std::vector<double>& angles, const std::string& sequence) {
  Quaternion result{1, 0, 0, 0};
  for (size_t i = 0; i < 3; ++i) {
    Quaternion turn{std::cos(angles[i] / 2), 0, 0, 0};
    turn[1 + std::tolower(sequence[i]) - 'x'] = std::sin(angles[i] / 2);
    result = std::islower(sequence[i]) ? Multiply(result, turn) : Multiply(turn, result);
  }
  return result;
}

// --- One file, made ready for the composed document
// -----------------------------------------------------------------

// Compiler settings that MuJoCo has once for the whole document, with their defaults.
const std::map<std::string, std::string>& GlobalSettings() {
  static const std::map<std::string, std::string> settings = {
      {"boundmass", "0"},           {"boundinertia", "0"},   {"settotalmass", "-1"},
      {"balanceinertia", "false"},  {"coordinate", "local"}, {"fitaabb", "false"},
      {"convexhull", "true"},       {"fusestatic", "false"}, {"inertiagrouprange", "0 5"},
      {"exactmeshinertia", "false"}};
  return settings;
}

class Part {
 public:
  Part(const std::filesystem::path& file, std::vector<std::string>* warnings)
      : mjcf_(ReadMjcf(file)), warnings_(warnings) {
    ReadCompiler();
  }

  XMLElement* root() { return mjcf_.root; }

  // The value of a compiler attribute, or its default.
  std::string compiler(const std::string& attribute, const std::string& otherwise) const {
    const auto found = compiler_.find(attribute);
    return found == compiler_.end() ? otherwise : found->second;
  }

  std::vector<XMLElement*> Sections(const char* name) {
    std::vector<XMLElement*> sections;
    for (XMLElement* section : Children(mjcf_.root)) {
      if (Is(section, name)) sections.push_back(section);
    }
    return sections;
  }

  void DeleteSections(const char* name) {
    for (XMLElement* section : Sections(name)) mjcf_.root->DeleteChild(section);
  }

  // The <default> sections, merged into one with the class name "main".
  XMLElement* MainDefault() {
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
        // MuJoCo would not hand these on to the classes that are there already.
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

  // Checks every element and attribute against the installed MuJoCo.
  void CheckSchema() {
    for (XMLElement* section : Children(mjcf_.root)) CheckSchema(section, Schema(), "mujoco");
    for (const auto& [what, occurrence] : dropped_) {
      const auto& [source, count] = occurrence;
      warnings_->push_back(source + ": " + what + " is not known to MuJoCo " + mj_versionString() +
                           "; dropped" + (count > 1 ? " (" + std::to_string(count) + " times)" : ""));
    }
  }

  // Makes angles radians, files absolute and bodies' inertias what this file's compiler settings say.
  void Normalise() {
    CollectClasses(MainDefault());
    const bool degree = compiler("angle", "degree") == "degree";
    std::string sequence = compiler("eulerseq", "xyz");
    for (XMLElement* section : Sections("worldbody")) {
      const auto* attribute = section->FirstAttribute();
      while (attribute && std::string(attribute->Name()) == kSourceAttribute) attribute = attribute->Next();
      if (attribute) Fail(section, "<worldbody> cannot have attributes");
      if (degree) ConvertJoints(section, "main");
      if (compiler("inertiafromgeom", "auto") == "true") RemoveInertials(section);
    }
    ForEach(mjcf_.root, [&](XMLElement* element) {
      if (const char* text = element->Attribute("euler"); text && (degree || sequence != "xyz")) {
        std::vector<double> angles = ParseNumbers(element, "euler", text, 3);
        if (degree) {
          for (double& angle : angles) angle *= kRadPerDeg;
        }
        Set(element, "quat", Join(FromEuler(angles, sequence)));
        element->DeleteAttribute("euler");
      }
      if (const char* text = element->Attribute("axisangle"); text && degree) {
        std::vector<double> values = ParseNumbers(element, "axisangle", text, 4);
        values[3] *= kRadPerDeg;
        Set(element, "axisangle", Join(values));
      }
    });
    for (XMLElement* section : Sections("asset")) {
      for (XMLElement* asset : Children(section)) ResolveFiles(asset);
    }
  }

  // Prefixes every name and reference; `world` is what the file's world body becomes.
  void Prefix(const std::string& prefix, const std::string& world) {
    ForEach(mjcf_.root, [&](XMLElement* element) {
      for (const auto* a = element->FirstAttribute(); a; a = a->Next()) {
        const std::string name = a->Name(), value = a->Value();
        if (!NameAttributes().contains(name) || value.empty()) continue;
        const bool is_world = value == "world" && NamesBody(element, name);
        element->SetAttribute(a->Name(), (is_world ? world : prefix + value).c_str());
      }
      // Without a second body these bind to the world.
      if ((Is(element, "connect") || Is(element, "weld")) && element->Attribute("body1") &&
          !element->Attribute("body2")) {
        Set(element, "body2", world);
      }
    });
  }

 private:
  void ReadCompiler() {
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

  void CheckSchema(XMLElement* element, const SchemaNode& parent, const std::string& parent_name) {
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
    for (XMLElement* child : Children(element)) CheckSchema(child, *schema, name);
  }

  void CollectClasses(XMLElement* definition) {
    classes_[Get(definition, "class")] = definition;
    for (XMLElement* child : Children(definition)) {
      if (Is(child, "default")) CollectClasses(child);
    }
  }

  // An attribute's value as the element or its default class says.
  std::optional<std::string> Effective(const XMLElement* element, const std::string& childclass,
                                       const char* attribute) const {
    if (const char* own = element->Attribute(attribute)) return own;
    const auto found = classes_.find(Get(element, "class", childclass));
    const XMLElement* definition = found == classes_.end() ? nullptr : found->second;
    for (; definition && Is(definition, "default"); definition = definition->Parent()->ToElement()) {
      const XMLElement* defaults = definition->FirstChildElement(element->Name());
      if (defaults && defaults->Attribute(attribute)) return defaults->Attribute(attribute);
    }
    return std::nullopt;
  }

  // Writes angles in radians at the joints themselves: in a default class it is not known yet whether a joint
  // slides.
  void ConvertJoints(XMLElement* body, const std::string& childclass) {
    for (XMLElement* child : Children(body)) {
      if (Is(child, "body")) ConvertJoints(child, Get(child, "childclass", childclass));
      if (!Is(child, "joint")) continue;
      const std::string type = Effective(child, childclass, "type").value_or("hinge");
      for (const char* attribute : {"range", "ref", "springref"}) {
        const bool is_angle = type == "hinge" || (type == "ball" && std::string(attribute) == "range");
        const std::optional<std::string> text = Effective(child, childclass, attribute);
        if (!is_angle || !text) continue;
        std::vector<double> values = ParseNumbers(child, attribute, *text, 0);
        for (double& value : values) value *= kRadPerDeg;
        Set(child, attribute, Join(values));
      }
    }
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

  // Makes the asset's files absolute; an asset without a name is called after its file.
  void ResolveFiles(XMLElement* asset) {
    const char* setting = Is(asset, "texture") ? "texturedir" : "meshdir";
    const std::filesystem::path folder =
        mjcf_.file.parent_path() / compiler(setting, compiler("assetdir", ""));
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
    }
  }

  MjcfFile mjcf_;
  std::vector<std::string>* warnings_;
  std::map<std::string, std::string> compiler_;
  XMLElement* main_default_ = nullptr;
  std::map<std::string, XMLElement*> classes_;
  // What was dropped -> where first, how often.
  std::map<std::string, std::pair<std::string, int>> dropped_;
};

}  // namespace

// --- The composer
// ---------------------------------------------------------------------------------------------------

struct SceneComposer::Impl {
  XMLDocument document;
  XMLElement* root = nullptr;
  std::map<std::string, XMLElement*> sections;
  std::vector<std::string> warnings;
  // The base file's value of each global compiler setting.
  std::map<std::string, std::string> settings;

  void MoveSections(Part* part, std::initializer_list<const char*> names) {
    for (const char* name : names) {
      for (XMLElement* section : part->Sections(name)) {
        for (const auto* a = section->FirstAttribute(); a; a = a->Next()) {
          sections.at(name)->SetAttribute(a->Name(), a->Value());
        }
        for (XMLElement* child : Children(section)) {
          sections.at(name)->InsertEndChild(child->DeepClone(&document));
        }
      }
    }
  }

  // Gives what has no class the file's main class.
  static void SetMainClass(XMLElement* element, const std::string& main_class) {
    const SchemaNode* section = ChildSchema(Schema(), "mujoco", element->Parent()->ToElement()->Name());
    const SchemaNode* schema = ChildSchema(*section, element->Parent()->ToElement()->Name(), element->Name());
    const char* attribute = Is(element, "body") ? "childclass" : "class";
    if (schema->attributes.contains(attribute) && !element->Attribute(attribute)) {
      Set(element, attribute, main_class);
    }
  }

  void AddContent(Part* part, const std::string& main_class) {
    for (const char* name : {"asset", "contact", "equality", "tendon", "actuator", "worldbody"}) {
      for (XMLElement* section : part->Sections(name)) {
        for (XMLElement* child : Children(section)) SetMainClass(child, main_class);
      }
    }
    sections.at("default")->InsertEndChild(part->MainDefault()->DeepClone(&document));
    MoveSections(part, {"asset", "contact", "equality", "tendon", "actuator", "sensor", "custom"});
  }

  // Says which options of an attached file differ from the base file's.
  void CompareOptions(Part* part, XMLElement* base, XMLElement* option) {
    for (const auto* a = option->FirstAttribute(); a; a = a->Next()) {
      const std::string name = a->Name();
      if (name == kSourceAttribute || Get(base, a->Name()) == a->Value()) continue;
      warnings.push_back(
          SourceOf(option) + ": " + Tag(option) + " " + name + "=\"" + a->Value() +
          "\" does not count; the scene's is " +
          (base->Attribute(a->Name()) ? "\"" + Get(base, a->Name()) + "\"" : "MuJoCo's default"));
    }
    for (XMLElement* child : Children(option)) {
      XMLElement* same = base->FirstChildElement(child->Name());
      if (!same) same = base->InsertNewChildElement(child->Name());
      CompareOptions(part, same, child);
    }
  }

  XMLElement* Find(XMLElement* element, const char* kind, const std::string& name) {
    for (XMLElement* child : Children(element)) {
      if ((!kind || Is(child, kind)) && Get(child, "name") == name) return child;
      if (XMLElement* found = Find(child, kind, name)) return found;
    }
    return nullptr;
  }
};

SceneComposer::SceneComposer(const std::filesystem::path& base_file) : impl_(std::make_unique<Impl>()) {
  Impl& impl = *impl_;
  impl.root = impl.document.NewElement("mujoco");
  impl.document.InsertFirstChild(impl.root);
  for (const char* name : {"compiler", "option", "size", "visual", "statistic", "custom", "default", "asset",
                           "worldbody", "contact", "equality", "tendon", "actuator", "sensor"}) {
    impl.sections[name] = impl.root->InsertNewChildElement(name);
  }

  Part part(base_file, &impl.warnings);
  Set(impl.root, "model", Get(part.root(), "model", "scene"));
  Set(impl.sections["compiler"], "angle", "radian");
  // Also right for a file without autolimits: MuJoCo 2.2 then insists that limits are stated.
  Set(impl.sections["compiler"], "autolimits", "true");
  for (const auto& [name, value] : GlobalSettings()) {
    impl.settings[name] = part.compiler(name, value);
    if (impl.settings[name] != value) Set(impl.sections["compiler"], name.c_str(), impl.settings[name]);
  }
  part.DeleteSections("compiler");
  part.DeleteSections("keyframe");
  for (XMLElement* option : part.Sections("option")) {
    if (Get(option, "integrator") != "implicitfast") continue;
    impl.warnings.push_back(SourceOf(option) + ": integrator implicitfast is not known to MuJoCo " +
                            mj_versionString() + "; Euler is used");
    Set(option, "integrator", "Euler");
  }
  part.CheckSchema();
  part.Normalise();
  // Not just "main": that is the root of all classes.
  const std::string main_class = "world/main";
  ForEach(part.root(), [&](XMLElement* element) {
    for (const char* attribute : {"class", "childclass"}) {
      if (Get(element, attribute) == "main") Set(element, attribute, main_class);
    }
  });
  impl.AddContent(&part, main_class);
  impl.MoveSections(&part, {"option", "size", "visual", "statistic", "worldbody"});
}

SceneComposer::~SceneComposer() = default;

void SceneComposer::Attach(const std::filesystem::path& file, const std::string& prefix, const Pose& pose,
                           Mount mount, const std::string& parent_body) {
  const bool free = mount == Mount::kFree;
  Impl& impl = *impl_;
  const std::string body_name = prefix.substr(0, prefix.size() - 1);
  Part part(file, &impl.warnings);
  const std::string root_source = SourceOf(part.root());

  for (const auto& [name, value] : GlobalSettings()) {
    const std::string own = part.compiler(name, value);
    if (own != impl.settings[name]) {
      Fail(part.Sections("compiler").empty() ? part.root() : part.Sections("compiler")[0],
           "<compiler>: " + name + "=\"" + own + "\" cannot be kept: the scene has \"" + impl.settings[name] +
               "\"");
    }
  }
  // Options of the attached file, compared with a copy that may grow.
  XMLDocument scratch;
  XMLElement* options = impl.sections["option"]->DeepClone(&scratch)->ToElement();
  scratch.InsertFirstChild(options);
  for (XMLElement* option : part.Sections("option")) impl.CompareOptions(&part, options, option);
  for (const char* name : {"compiler", "option", "size", "visual", "statistic", "keyframe"}) {
    part.DeleteSections(name);
  }
  part.CheckSchema();
  part.Normalise();

  // A file made to stand alone may bring a free joint or lights of its own.
  std::vector<XMLElement*> free_joints;
  for (XMLElement* section : part.Sections("worldbody")) {
    for (XMLElement* child : Children(section)) {
      if (Is(child, "light")) {
        impl.warnings.push_back(SourceOf(child) + ": <light> dropped: the scene's lights count");
        section->DeleteChild(child);
      } else if (Is(child, "body")) {
        if (Get(child, "mocap") == "true") Fail(child, "a mocap body cannot be attached");
        for (XMLElement* joint : Children(child)) {
          if (Is(joint, "freejoint") || (Is(joint, "joint") && Get(joint, "type") == "free")) {
            free_joints.push_back(joint);
          }
        }
      }
    }
  }
  if (!free_joints.empty()) {
    if (!free || free_joints.size() > 1) {
      Fail(free_joints.back(),
           free ? "only one free joint can be in a file that is attached free"
                : "a free joint in an attached file needs 'free: true' where it is attached");
    }
    free_joints[0]->Parent()->DeleteChild(free_joints[0]);
  }
  for (XMLElement* section : part.Sections("asset")) {
    for (XMLElement* asset : Children(section)) {
      if (Is(asset, "texture") && Get(asset, "type") == "skybox") section->DeleteChild(asset);
    }
  }

  part.Prefix(prefix, body_name);
  const std::string main_class = prefix + "main";

  XMLElement* parent = parent_body.empty() ? impl.sections["worldbody"]
                                           : impl.Find(impl.sections["worldbody"], "body", parent_body);
  if (!parent) throw InputError(root_source + ": cannot be attached: there is no body '" + parent_body + "'");
  if (mount != Mount::kFixed && !parent_body.empty()) {
    throw InputError(root_source + ": a part on a body cannot be free or placed");
  }
  if (impl.Find(impl.sections["worldbody"], "body", body_name)) {
    throw InputError(root_source + ": cannot be attached as '" + body_name +
                     "': there is such a body already");
  }
  impl.AddContent(&part, main_class);
  XMLElement* body = parent->InsertNewChildElement("body");
  Set(body, kSourceAttribute, root_source);
  Set(body, "name", body_name);
  Set(body, "pos", Join(pose.position));
  Set(body, "quat", Join(pose.quaternion));
  Set(body, "childclass", main_class);
  if (mount == Mount::kMocap) Set(body, "mocap", "true");
  if (free) {
    XMLElement* joint = body->InsertNewChildElement("freejoint");
    Set(joint, kSourceAttribute, root_source);
    Set(joint, "name", body_name);
  }
  for (XMLElement* section : part.Sections("worldbody")) {
    for (XMLElement* child : Children(section)) body->InsertEndChild(child->DeepClone(&impl.document));
  }
}

void SceneComposer::SetJointAttribute(const std::string& joint, const std::string& attribute, double value) {
  XMLElement* element = impl_->Find(impl_->sections["worldbody"], "joint", joint);
  if (!element) throw InputError("the scene has no joint '" + joint + "'");
  Set(element, attribute.c_str(), Number(value));
}

void SceneComposer::SetPositionGain(const std::string& actuator, double gain) {
  XMLElement* element = impl_->Find(impl_->sections["actuator"], nullptr, actuator);
  if (!element) throw InputError("the scene has no actuator '" + actuator + "'");
  if (!Is(element, "general") && !Is(element, "position")) {
    Fail(element, "actuator '" + actuator + "' is a " + element->Name() + ", which has no position gain");
  }
  element->SetName("general");
  element->DeleteAttribute("kp");
  Set(element, "dyntype", "none");
  Set(element, "gaintype", "fixed");
  Set(element, "biastype", "affine");
  Set(element, "gainprm", Number(gain) + " 0 0");
  Set(element, "biasprm", "0 " + Number(-gain) + " 0");
}

void SceneComposer::SetInertials(const mjModel& model) {
  // Body ids are in document order, the world first.
  int id = -1;
  ForEach(impl_->sections["worldbody"], [&](XMLElement* element) {
    if (!Is(element, "body") && !Is(element, "worldbody")) return;
    ++id;
    if (id == 0 || model.body_mass[id] == 0 || element->FirstChildElement("inertial")) return;
    const auto numbers = [id](const mjtNum* values, int n) {
      return Join(std::vector<double>(values + n * id, values + n * (id + 1)));
    };
    XMLElement* inertial = impl_->document.NewElement("inertial");
    element->InsertFirstChild(inertial);
    Set(inertial, kSourceAttribute, SourceOf(element));
    Set(inertial, "mass", Number(model.body_mass[id]));
    Set(inertial, "pos", numbers(model.body_ipos, 3));
    Set(inertial, "quat", numbers(model.body_iquat, 4));
    Set(inertial, "diaginertia", numbers(model.body_inertia, 3));
  });
}

std::string SceneComposer::ToXml(bool discard_visual) const {
  XMLDocument copy;
  impl_->document.DeepCopy(&copy);
  ForEach(copy.RootElement(), [](XMLElement* element) { element->DeleteAttribute(kSourceAttribute); });
  if (discard_visual) Set(copy.RootElement()->FirstChildElement("compiler"), "discardvisual", "true");
  tinyxml2::XMLPrinter printer;
  copy.Print(&printer);
  return printer.CStr();
}

std::string SceneComposer::Locate(int line) const {
  // The printed text has the same elements in the same order.
  XMLDocument printed;
  printed.Parse(ToXml().c_str());
  std::vector<int> lines;
  ForEach(printed.RootElement(), [&](XMLElement* element) { lines.push_back(element->GetLineNum()); });
  std::string source;
  size_t i = 0;
  ForEach(impl_->root, [&](XMLElement* element) {
    if (lines[i++] == line) source = Get(element, kSourceAttribute);
  });
  return source;
}

const std::vector<std::string>& SceneComposer::warnings() const { return impl_->warnings; }

}  // namespace evalbus
