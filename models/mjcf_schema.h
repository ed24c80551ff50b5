// What the installed MuJoCo knows of MJCF: which elements there are, and which attributes each may have.
#pragma once

#include <map>
#include <set>
#include <string>

namespace evalbus::mjcf {

struct SchemaNode {
  std::set<std::string> attributes;
  std::map<std::string, SchemaNode> children;
};

// Of <mujoco>, as MuJoCo itself prints it.
const SchemaNode& Schema();

// The schema of a child element; <body> and <default> contain themselves. Null: there is no such child.
const SchemaNode* ChildSchema(const SchemaNode& parent, const std::string& parent_name,
                              const std::string& name);

// Attributes of newer versions without which the physics stays meaningful.
bool CanBeDropped(const std::string& element, const std::string& attribute);

}  // namespace evalbus::mjcf
