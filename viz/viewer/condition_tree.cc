#include "viz/viewer/condition_tree.h"

#include <string>

namespace evalbus::viz {
namespace {

using Json = nlohmann::ordered_json;

// wanted: false within an odd number of `not`s. There, `all` and `any` are exchanged (De Morgan).
Json Tree(const Expression& expression, bool wanted, size_t* next) {
  if (expression.operands.empty()) return (*next)++;
  if (expression.name == "not") return Tree(expression.operands[0], !wanted, next);
  const bool is_in_time = expression.name == "latched" || expression.name == "lasts";
  std::string joined = expression.name;
  if (!is_in_time && !wanted) joined = joined == "all" ? "any" : "all";
  Json list = Json::array();
  for (const Expression& operand : expression.operands)
    list.push_back(Tree(operand, is_in_time || wanted, next));
  if (is_in_time) list.push_back((*next)++);
  return {{joined, list}};
}

}  // namespace

Json ConditionTree(const Expression& expression, size_t first, size_t count) {
  if (expression.name.empty()) return nullptr;
  size_t next = first;
  Json tree = Tree(expression, true, &next);
  return next == first + count ? tree : Json();
}

}  // namespace evalbus::viz
