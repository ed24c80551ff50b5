#include "models/mjcf_schema.h"

#include <mujoco/mujoco.h>

#include <sstream>
#include <vector>

namespace evalbus::mjcf {
namespace {

// MuJoCo prints its schema as a table. An element's name is indented by 3 columns per level, and its
// attributes start at column 30.
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

}  // namespace

const SchemaNode& Schema() {
  static const SchemaNode schema = ReadSchema();
  return schema;
}

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

}  // namespace evalbus::mjcf
