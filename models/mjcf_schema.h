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

// Returns the schema of <mujoco>, as printed by MuJoCo itself.
const SchemaNode& Schema();

// Returns the schema of a child element; null if there is no such child. <body> and <default> contain
// themselves.
const SchemaNode* ChildSchema(const SchemaNode& parent, const std::string& parent_name,
                              const std::string& name);

// Returns true for attributes of newer MuJoCo versions without which the physics remains meaningful.
bool CanBeDropped(const std::string& element, const std::string& attribute);

}  // namespace evalbus::mjcf
