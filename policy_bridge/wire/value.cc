#include "policy_bridge/wire/value.h"

namespace evalbus::policy {

const Value* Value::Find(std::string_view key) const {
  const Map* map = As<Map>();
  if (!map) return nullptr;
  for (const auto& [name, value] : *map) {
    if (name == key) return &value;
  }
  return nullptr;
}

}  // namespace evalbus::policy
