#include "models/expression.h"

#include <algorithm>

namespace evalbus {
namespace {

// An expression is a map with one entry, {name: body}. The body determines its kind:
//
//     {touching: {a: pot, b: floor}}    a map of values       named arguments
//     {height: 1.2}                     a value or a list     one argument without a name
//     {lasts: {min_s: 1, when: {...}}}  values and `when`     named arguments and an operand
//     {not: {touching: {...}}}          an expression         operand
//     {all: [{...}, {...}]}             list of expressions   operands
//
constexpr char kOperandKey[] = "when";
// The expression in which users forget `when`.
constexpr char kTimedName[] = "lasts";

// Returns whether the body of an expression is an expression, not arguments: a map with exactly one entry
// other than `when`, which is a map or a list of maps. The map {height: 1.2} therefore contains an argument.
bool IsExpression(const YamlValue& value) {
  if (!value.is_map()) return false;
  const std::vector<YamlValue> entries = value.Entries();
  if (entries.size() != 1 || entries[0].key() == kOperandKey) return false;
  if (entries[0].is_map()) return true;
  if (!entries[0].is_list()) return false;
  const std::vector<YamlValue> elements = entries[0].List();
  return std::any_of(elements.begin(), elements.end(), [](const YamlValue& e) { return !e.is_scalar(); });
}

void CheckArgument(const YamlValue& value) {
  if (value.is_list()) {
    value.Texts();
  } else {
    value.Text();
  }
}

}  // namespace

Expression ReadExpression(const YamlValue& value) {
  const std::vector<YamlValue> entries = value.is_map() ? value.Entries() : std::vector<YamlValue>();
  if (entries.size() != 1) {
    value.Fail("expected one expression such as {holding: {gripper: left, object: pot}}");
  }
  const YamlValue& body = entries[0];
  Expression expression{.name = body.key(), .arguments = body, .operands = {}};
  if (IsExpression(body)) {
    expression.operands.push_back(ReadExpression(body));
  } else if (body.is_map()) {
    for (const YamlValue& entry : body.Entries()) {
      if (entry.key() == kOperandKey) {
        expression.operands.push_back(ReadExpression(entry));
      } else if (entry.is_map() && body.key() == kTimedName) {
        entry.Fail("expected a value, got a map; a predicate in 'lasts' is written as when: {" + entry.key() +
                   ": {...}}");
      } else {
        CheckArgument(entry);
      }
    }
  } else if (body.is_list() && !body.List().empty() && !body.List()[0].is_scalar()) {
    for (const YamlValue& element : body.List()) expression.operands.push_back(ReadExpression(element));
  } else {
    CheckArgument(body);
  }
  return expression;
}

std::vector<NamedExpression> ReadNamedExpressions(const YamlValue& value) {
  const std::vector<YamlValue> entries = value.Entries();
  if (entries.size() == 1 && !IsExpression(entries[0])) return {{"", ReadExpression(value)}};
  std::vector<NamedExpression> result;
  for (const YamlValue& entry : entries) result.push_back({entry.KeyName(), ReadExpression(entry)});
  return result;
}

}  // namespace evalbus
