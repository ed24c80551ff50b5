#include "models/scene_composer.h"

#include <tinyxml2.h>

#include <cmath>

#include "base/errors.h"
#include "models/inferred_inertials.h"
#include "models/mjcf_file.h"
#include "models/mjcf_part.h"
#include "models/mjcf_schema.h"
#include "models/mjcf_xml.h"

namespace evalbus {

using mjcf::Children;
using mjcf::Fail;
using mjcf::ForEach;
using mjcf::Get;
using mjcf::Is;
using mjcf::Join;
using mjcf::NumberText;
using mjcf::Set;
using mjcf::Tag;
using tinyxml2::XMLDocument;
using tinyxml2::XMLElement;

namespace {

XMLElement* Find(XMLElement* element, const char* kind, const std::string& name) {
  for (XMLElement* child : Children(element)) {
    if ((!kind || Is(child, kind)) && Get(child, "name") == name) return child;
    if (XMLElement* found = Find(child, kind, name)) return found;
  }
  return nullptr;
}

// Assigns the file's main class to the element if the element can have a class and has none.
void SetMainClass(XMLElement* element, const std::string& main_class) {
  const std::string section_name = element->Parent()->ToElement()->Name();
  const mjcf::SchemaNode* section = mjcf::ChildSchema(mjcf::Schema(), "mujoco", section_name);
  const mjcf::SchemaNode* schema = mjcf::ChildSchema(*section, section_name, element->Name());
  const char* attribute = Is(element, "body") ? "childclass" : "class";
  if (schema->attributes.contains(attribute) && !element->Attribute(attribute)) {
    Set(element, attribute, main_class);
  }
}

bool IsFreeJoint(const XMLElement* element) {
  return Is(element, "freejoint") || (Is(element, "joint") && Get(element, "type") == "free");
}

// A model that was made to be used alone may already have a free joint. If the model is attached with a free
// joint, removes the model's own; otherwise throws InputError.
void RemoveFreeJoint(mjcf::Part* part, bool free) {
  std::vector<XMLElement*> joints;
  for (XMLElement* section : part->Sections("worldbody")) {
    for (XMLElement* body : Children(section)) {
      if (!Is(body, "body")) continue;
      if (Get(body, "mocap") == "true") Fail(body, "a mocap body cannot be attached");
      for (XMLElement* child : Children(body)) {
        if (IsFreeJoint(child)) joints.push_back(child);
      }
    }
  }
  if (joints.empty()) return;
  if (!free || joints.size() > 1) {
    Fail(joints.back(),
         free ? "only one free joint can be in a file that is attached free"
              : "a free joint in an attached file requires 'free: true' where the file is attached");
  }
  joints[0]->Parent()->DeleteChild(joints[0]);
}

// Removes the sky of an attached file, and its lights unless keep_lights is true.
void RemoveSurroundings(mjcf::Part* part, bool keep_lights, std::vector<std::string>* warnings) {
  for (XMLElement* section : part->Sections("worldbody")) {
    for (XMLElement* child : Children(section)) {
      if (keep_lights || !Is(child, "light")) continue;
      warnings->push_back(SourceOf(child) + ": <light> dropped: only the scene's lights are used");
      section->DeleteChild(child);
    }
  }
  for (XMLElement* section : part->Sections("asset")) {
    for (XMLElement* asset : Children(section)) {
      if (Is(asset, "texture") && Get(asset, "type") == "skybox") section->DeleteChild(asset);
    }
  }
}

// Returns the volume of a mesh, m^3: the sum of the tetrahedra between its center of mass, which is its
// origin, and its faces.
double Volume(const mjModel& model, int mesh) {
  const float* vertices = model.mesh_vert + 3 * model.mesh_vertadr[mesh];
  const int* faces = model.mesh_face + 3 * model.mesh_faceadr[mesh];
  double volume = 0;
  for (int i = 0; i < model.mesh_facenum[mesh]; ++i) {
    mjtNum corner[3][3], normal[3];
    for (int k = 0; k < 3; ++k) mju_f2n(corner[k], vertices + 3 * faces[3 * i + k], 3);
    mju_cross(normal, corner[0], corner[1]);
    volume += std::abs(mju_dot3(normal, corner[2])) / 6;
  }
  return volume;
}

}  // namespace

struct SceneComposer::Impl {
  XMLDocument document;
  XMLElement* root = nullptr;
  std::map<std::string, XMLElement*> sections;
  std::vector<std::string> warnings;
  // The base file's value of each global compiler setting.
  std::map<std::string, std::string> settings;
  // Names of meshes and textures by their descriptions.
  std::map<std::string, std::string> assets;
  // Name of the texture that replaces each merged texture.
  std::map<std::string, std::string> merged_textures;

  // Reads an attached file and removes everything that only the base file may define.
  mjcf::Part Load(const std::filesystem::path& file, bool free,
                  const std::map<std::string, double>& stiffness, bool keep_lights);
  // Removes the assets that the document already has from the part.
  mjcf::SharedAssets MergeAssets(mjcf::Part* part, const std::string& prefix);
  // Adds the part, whose names are prefixed, as the body `name` of the document.
  void Place(mjcf::Part* part, const std::string& name, const Pose& pose, Mount mount,
             const std::string& parent_body);

  // Checks that those settings of the part that MuJoCo has only once per document equal the base file's.
  void CheckSettings(mjcf::Part* part) const;
  // Adds a warning for each option of an attached file that differs from the base file's. May add empty
  // elements to `base`.
  void CompareOptions(XMLElement* base, XMLElement* option);
  // Copies everything except bodies from the part. Elements without a class get `main_class`.
  void AddContent(mjcf::Part* part, const std::string& main_class);
  void CopySections(mjcf::Part* part, std::initializer_list<const char*> names);
};

void SceneComposer::Impl::CheckSettings(mjcf::Part* part) const {
  for (const auto& [name, value] : mjcf::GlobalSettings()) {
    const std::string own = part->compiler(name, value);
    if (own == settings.at(name)) continue;
    const std::vector<XMLElement*> compilers = part->Sections("compiler");
    Fail(compilers.empty() ? part->root() : compilers[0], "<compiler>: " + name + "=\"" + own +
                                                              "\" cannot be kept: the scene has \"" +
                                                              settings.at(name) + "\"");
  }
}

void SceneComposer::Impl::CompareOptions(XMLElement* base, XMLElement* option) {
  for (const auto* a = option->FirstAttribute(); a; a = a->Next()) {
    const std::string name = a->Name();
    if (name == kSourceAttribute || Get(base, a->Name()) == a->Value()) continue;
    warnings.push_back(
        SourceOf(option) + ": " + Tag(option) + " " + name + "=\"" + a->Value() +
        "\" is ignored; the scene's is " +
        (base->Attribute(a->Name()) ? "\"" + Get(base, a->Name()) + "\"" : "MuJoCo's default"));
  }
  for (XMLElement* child : Children(option)) {
    XMLElement* same = base->FirstChildElement(child->Name());
    if (!same) same = base->InsertNewChildElement(child->Name());
    CompareOptions(same, child);
  }
}

void SceneComposer::Impl::CopySections(mjcf::Part* part, std::initializer_list<const char*> names) {
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

void SceneComposer::Impl::AddContent(mjcf::Part* part, const std::string& main_class) {
  for (const char* name : {"asset", "contact", "equality", "tendon", "actuator", "worldbody"}) {
    for (XMLElement* section : part->Sections(name)) {
      for (XMLElement* child : Children(section)) SetMainClass(child, main_class);
    }
  }
  sections.at("default")->InsertEndChild(part->MainDefault()->DeepClone(&document));
  CopySections(part, {"asset", "contact", "equality", "tendon", "actuator", "sensor", "custom"});
}

mjcf::Part SceneComposer::Impl::Load(const std::filesystem::path& file, bool free,
                                     const std::map<std::string, double>& stiffness, bool keep_lights) {
  mjcf::Part part(file, &warnings);
  CheckSettings(&part);
  XMLDocument scratch;
  XMLElement* options = sections["option"]->DeepClone(&scratch)->ToElement();
  scratch.InsertFirstChild(options);
  for (XMLElement* option : part.Sections("option")) CompareOptions(options, option);
  for (const char* name : {"compiler", "option", "size", "visual", "statistic", "keyframe"}) {
    part.DeleteSections(name);
  }
  part.WriteServos(stiffness);
  part.CheckSchema();
  part.Normalize();
  RemoveFreeJoint(&part, free);
  RemoveSurroundings(&part, keep_lights, &warnings);
  return part;
}

mjcf::SharedAssets SceneComposer::Impl::MergeAssets(mjcf::Part* part, const std::string& prefix) {
  mjcf::SharedAssets shared;
  for (XMLElement* section : part->Sections("asset")) {
    for (XMLElement* asset : Children(section)) {
      const std::string description = part->DescribeAsset(asset);
      if (description.empty()) continue;
      const std::string kind = asset->Name(), name = Get(asset, "name");
      const auto [first, is_new] = assets.emplace(description, prefix + name);
      if (is_new) continue;
      shared[{kind, name}] = first->second;
      if (kind == "texture") merged_textures[prefix + name] = first->second;
      section->DeleteChild(asset);
    }
  }
  return shared;
}

void SceneComposer::Impl::Place(mjcf::Part* part, const std::string& name, const Pose& pose, Mount mount,
                                const std::string& parent_body) {
  const std::string source = SourceOf(part->root());
  XMLElement* parent =
      parent_body.empty() ? sections["worldbody"] : Find(sections["worldbody"], "body", parent_body);
  if (!parent) {
    throw InputError(source + ": cannot be attached to body '" + parent_body +
                     "': the scene has no such body");
  }
  if (mount != Mount::kFixed && !parent_body.empty()) {
    throw InputError(source + ": a part on a body cannot be free or placed");
  }
  if (Find(sections["worldbody"], "body", name)) {
    throw InputError(source + ": cannot be attached as '" + name + "': a body of this name already exists");
  }
  const std::string main_class = name + "/main";
  AddContent(part, main_class);
  XMLElement* body = parent->InsertNewChildElement("body");
  Set(body, kSourceAttribute, source);
  Set(body, "name", name);
  Set(body, "pos", Join(pose.position));
  Set(body, "quat", Join(pose.quaternion));
  Set(body, "childclass", main_class);
  if (mount == Mount::kMocap) Set(body, "mocap", "true");
  if (mount == Mount::kFree) {
    XMLElement* joint = body->InsertNewChildElement("freejoint");
    Set(joint, kSourceAttribute, source);
    Set(joint, "name", name);
  }
  for (XMLElement* section : part->Sections("worldbody")) {
    for (XMLElement* child : Children(section)) body->InsertEndChild(child->DeepClone(&document));
  }
}

SceneComposer::SceneComposer(const std::filesystem::path& base_file) : impl_(std::make_unique<Impl>()) {
  Impl& impl = *impl_;
  impl.root = impl.document.NewElement("mujoco");
  impl.document.InsertFirstChild(impl.root);
  for (const char* name : {"compiler", "option", "size", "visual", "statistic", "custom", "default", "asset",
                           "worldbody", "contact", "equality", "tendon", "actuator", "sensor"}) {
    impl.sections[name] = impl.root->InsertNewChildElement(name);
  }

  mjcf::Part part(base_file, &impl.warnings);
  Set(impl.root, "model", Get(part.root(), "model", "scene"));
  Set(impl.sections["compiler"], "angle", "radian");
  // autolimits is set even if the file does not set it, because otherwise MuJoCo 2.2 requires explicit
  // attributes for limits.
  Set(impl.sections["compiler"], "autolimits", "true");
  for (const auto& [name, value] : mjcf::GlobalSettings()) {
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
  part.Normalize();
  // The class is renamed, because "main" is the root of all classes of the composed document.
  const std::string main_class = "world/main";
  ForEach(part.root(), [&](XMLElement* element) {
    for (const char* attribute : {"class", "childclass"}) {
      if (Get(element, attribute) == "main") Set(element, attribute, main_class);
    }
  });
  impl.AddContent(&part, main_class);
  Set(impl.sections["option"], kSourceAttribute, SourceOf(part.root()));
  impl.CopySections(&part, {"option", "size", "visual", "statistic", "worldbody"});
}

SceneComposer::~SceneComposer() = default;

void SceneComposer::Attach(const std::filesystem::path& file, const std::string& prefix, const Pose& pose,
                           const Attachment& how) {
  const std::string name = prefix.substr(0, prefix.size() - 1);
  mjcf::Part part = impl_->Load(file, how.mount == Mount::kFree, how.stiffness, how.keep_lights);
  for (const std::string& body : how.without) part.RemoveBody(body);
  const mjcf::SharedAssets shared = impl_->MergeAssets(&part, prefix);
  part.Prefix(prefix, name, shared);
  impl_->Place(&part, name, pose, how.mount, how.parent_body);
}

void SceneComposer::SetCamera(const std::string& name, const Pose& pose, double fov_deg,
                              const std::string& body) {
  XMLElement* parent = impl_->sections["worldbody"];
  if (!body.empty()) parent = Find(parent, "body", body);
  if (!parent) throw InputError("the scene has no body '" + body + "'");
  for (XMLElement* child : Children(parent)) {
    if (Is(child, "camera") && Get(child, "name") == name) parent->DeleteChild(child);
  }
  XMLElement* camera = parent->InsertNewChildElement("camera");
  Set(camera, "name", name);
  Set(camera, "pos", Join(pose.position));
  Set(camera, "quat", Join(pose.quaternion));
  Set(camera, "fovy", NumberText(fov_deg));
}

bool SceneComposer::KeepTexture(const std::string& name) {
  XMLElement* assets = impl_->sections.at("asset");
  if (Find(assets, "texture", name)) return true;
  const auto merged = impl_->merged_textures.find(name);
  if (merged == impl_->merged_textures.end()) return false;
  XMLElement* texture = Find(assets, "texture", merged->second)->DeepClone(&impl_->document)->ToElement();
  Set(texture, "name", name);
  assets->InsertEndChild(texture);
  return true;
}

void SceneComposer::AddTexture(const std::string& name, const std::filesystem::path& file,
                               const std::string& source) {
  XMLElement* texture = impl_->sections["asset"]->InsertNewChildElement("texture");
  Set(texture, kSourceAttribute, source);
  Set(texture, "name", name);
  Set(texture, "type", "2d");
  Set(texture, "file", file.string());
}

void SceneComposer::AddSite(const std::string& name, const Pose& pose, const std::string& body) {
  XMLElement* world = impl_->sections["worldbody"];
  if (Find(world, "site", name)) throw InputError("the scene has a site '" + name + "' already");
  XMLElement* parent = Find(world, "body", body);
  if (!parent) throw InputError("the scene has no body '" + body + "'");
  XMLElement* site = parent->InsertNewChildElement("site");
  Set(site, "name", name);
  Set(site, "pos", Join(pose.position));
  Set(site, "quat", Join(pose.quaternion));
}

void SceneComposer::SetJointAttribute(const std::string& joint, const std::string& attribute, double value) {
  XMLElement* element = Find(impl_->sections["worldbody"], "joint", joint);
  if (!element) throw InputError("the scene has no joint '" + joint + "'");
  Set(element, attribute.c_str(), NumberText(value));
}

void SceneComposer::SetNumber(const std::string& name, double value) {
  XMLElement* number = impl_->sections["custom"]->InsertNewChildElement("numeric");
  Set(number, "name", name);
  Set(number, "data", NumberText(value));
}

void SceneComposer::Exclude(const std::string& body, const std::string& other) {
  XMLElement* exclude = impl_->sections["contact"]->InsertNewChildElement("exclude");
  Set(exclude, "body1", body);
  Set(exclude, "body2", other);
}

void SceneComposer::SetInertials(const mjModel& model) {
  mjcf::AddInferredInertials(impl_->sections["worldbody"], model);
}

bool SceneComposer::SetMeshMasses(const mjModel& model) {
  bool found = false;
  ForEach(impl_->sections["worldbody"], [&](XMLElement* geom) {
    const char* density = geom->Attribute(kDensityAttribute);
    if (!density || geom->Parent()->FirstChildElement("inertial")) return;
    found = true;
    const int mesh = mj_name2id(&model, mjOBJ_MESH, geom->Attribute("mesh"));
    Set(geom, "mass", NumberText(std::stod(density) * Volume(model, mesh)));
  });
  return found;
}

void SceneComposer::RemoveMeshMasses() {
  ForEach(impl_->sections["worldbody"], [](XMLElement* geom) {
    if (geom->Attribute(kDensityAttribute)) geom->DeleteAttribute("mass");
  });
}

std::string SceneComposer::ToXml(bool discard_visual) const {
  XMLDocument copy;
  impl_->document.DeepCopy(&copy);
  ForEach(copy.RootElement(), [&](XMLElement* element) {
    element->DeleteAttribute(kSourceAttribute);
    element->DeleteAttribute(kDensityAttribute);
    if (discard_visual && Is(element, "material")) element->DeleteAttribute("texture");
  });
  if (discard_visual) {
    Set(copy.RootElement()->FirstChildElement("compiler"), "discardvisual", "true");
    // MuJoCo drops visual geoms, but not the textures, which can make up most of a model's size.
    XMLElement* assets = copy.RootElement()->FirstChildElement("asset");
    for (XMLElement* asset : Children(assets)) {
      if (Is(asset, "texture")) assets->DeleteChild(asset);
    }
  }
  tinyxml2::XMLPrinter printer;
  copy.Print(&printer);
  return printer.CStr();
}

std::string SceneComposer::OptionSource() const { return SourceOf(impl_->sections.at("option")); }

std::string SceneComposer::Locate(int line, bool discard_visual) const {
  // The printed text has the same elements in the same order, except for omitted textures.
  XMLDocument printed;
  printed.Parse(ToXml(discard_visual).c_str());
  std::vector<int> lines;
  ForEach(printed.RootElement(), [&](XMLElement* element) { lines.push_back(element->GetLineNum()); });
  std::string source;
  size_t i = 0;
  ForEach(impl_->root, [&](XMLElement* element) {
    if (discard_visual && Is(element, "texture")) return;
    if (lines[i++] == line) source = Get(element, kSourceAttribute);
  });
  return source;
}

const std::vector<std::string>& SceneComposer::warnings() const { return impl_->warnings; }

}  // namespace evalbus