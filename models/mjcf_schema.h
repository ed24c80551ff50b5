// MJCF schema of the installed MuJoCo, which defines the elements and the attributes of each element.
#pragma once

#include <map>
#include <set>
#include <string>

namespace evalbus::mjcf {

struct SchemaNode {
  std::set<std::string> attributes;
  std::map<std::string, SchemaNode> children;
};

// Schema of <mujoco>, as printed by MuJoCo itself.
const SchemaNode& Schema();

// Schema of a child element; <body> and <default> contain themselves. Null if there is no such child.
const SchemaNode* ChildSchema(const SchemaNode& parent, const std::string& parent_name,
                              const std::string& name);

// Returns true for attributes of newer MuJoCo versions without which the physics remains meaningful.
bool CanBeDropped(const std::string& element, const std::string& attribute);

}  // namespace evalbus::mjcf
