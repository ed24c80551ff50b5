// Conditions and quantities of a task as its YAML file writes them.
#pragma once

#include <string>
#include <vector>

#include "models/source_location.h"
#include "models/yaml_reader.h"

namespace evalbus {

// A named predicate or quantity, {holding: {gripper: left, object: pot}}, or one made of others, {all:
// [...]}. What names and arguments there are is decided where expressions are compiled (metrics/task/).
struct Expression {
  // Empty: there is no expression.
  std::string name;
  // What stands under the name: a map of arguments, each text or a list of texts, but the operand under
  // `when`; a single such value; or what the operands were read from.
  YamlValue arguments;
  // Of all, any, not, latched, lasts.
  std::vector<Expression> operands;

  SourceLocation location() const { return arguments.location(); }
};

struct NamedExpression {
  // Empty: a single unnamed value ("target_distance" as a plain number).
  std::string name;
  Expression expression;
};

// Throws InputError where the value is no expression.
Expression ReadExpression(const YamlValue& value);

// {name: expression, ...}, or a single expression without a name. Throws InputError.
std::vector<NamedExpression> ReadNamedExpressions(const YamlValue& value);

}  // namespace evalbus
