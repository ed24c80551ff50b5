// Conditions and quantities of a task, as written in its YAML file.
#pragma once

#include <string>
#include <vector>

#include "models/source_location.h"
#include "models/yaml_reader.h"

namespace evalbus {

// A named predicate or quantity, {holding: {gripper: left, object: pot}}, or a combination of expressions,
// {all: [...]}. Valid names and arguments are defined where expressions are compiled (metrics/task/).
struct Expression {
  // Name of the predicate, quantity or combination. Empty if there is no expression.
  std::string name;
  // The value under the name. It is a map of arguments, each a string or a list of strings, possibly with an
  // operand under `when`; or a single text or list; or the value from which the operands were read.
  YamlValue arguments;
  // Operands of `all`, `any`, `not`, `latched` and `lasts`.
  std::vector<Expression> operands;

  SourceLocation location() const { return arguments.location(); }
};

struct NamedExpression {
  // Empty for a single unnamed value ("target_distance" as a plain number).
  std::string name;
  Expression expression;
};

// Throws InputError if the value is not an expression.
Expression ReadExpression(const YamlValue& value);

// Reads {name: expression, ...}, or a single expression without a name. Throws InputError.
std::vector<NamedExpression> ReadNamedExpressions(const YamlValue& value);

}  // namespace evalbus
