#include "policy_bridge/wire/tree_builder.h"

#include <algorithm>
#include <string_view>

#include "base/text.h"
#include "policy_bridge/wire/policy_client.h"

namespace evalbus::policy {
namespace {

constexpr size_t kMaxLevels = 32, kMaxValues = 1 << 20;
constexpr int kShownKey = 100;  // characters

}  // namespace

bool TreeBuilder::Open(Value container) {
  if (open_.size() == kMaxLevels) Refuse("more than 32 levels");
  open_.push_back({std::move(container), {}});
  return true;
}

bool TreeBuilder::Add(Value value) {
  if (++num_values_ > kMaxValues) Refuse("more than a million values");
  if (open_.empty()) {
    whole_ = std::move(value);
  } else if (Opened& parent = open_.back(); List* list = parent.value.As<List>()) {
    list->push_back(std::move(value));
  } else {
    parent.value.As<Map>()->emplace_back(std::move(parent.key), std::move(value));
  }
  return true;
}

bool TreeBuilder::Close(Value value) {
  open_.pop_back();
  return Add(std::move(value));
}

void TreeBuilder::CheckKeys(const Map& map) const {
  std::vector<std::string_view> keys;
  for (const auto& [key, value] : map) keys.push_back(key);
  std::ranges::sort(keys);
  const auto twice = std::ranges::adjacent_find(keys);
  if (twice == keys.end()) return;
  Refuse("key \"" + Printable(Cut(std::string(*twice), kShownKey)) + "\" twice in a map");
}

void TreeBuilder::Refuse(const std::string& what) const {
  throw ServerError(ServerError::Kind::kProtocol, std::string(format_) + ": " + what);
}

}  // namespace evalbus::policy
