// Options as data: each is a member of a plain struct and one row of a table, from which come the command
// line and its help (base/arguments.h), the check of its range, the JSON that a run keeps, and what may not
// change when a run is gone on with.
//
// A struct with options has a function ForEachOption(Struct& or const Struct&, f) beside it, found by its
// arguments, that calls f(row, value) for each.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <string>
#include <tuple>
#include <type_traits>
#include <vector>

#include "base/errors.h"

namespace evalbus {

// What a number may be, both ends included. NaN is in no range.
struct Range {
  double least = std::numeric_limits<double>::lowest();
  double most = std::numeric_limits<double>::max();
};

template <class Options, class Value>
struct Option {
  Value Options::*member;
  // In JSON, "control_hz"; on the command line it is --control-hz.
  const char* key;
  // For --help; empty: not shown there, and not meant for people.
  std::string help{};
  // Of a number, or of each in a list.
  Range range{};
  // A run that is gone on with must have been made with the same.
  bool is_fixed = false;
};
template <class Options, class Value, class... Rest>
Option(Value Options::*, Rest...) -> Option<Options, Value>;

// Calls f(row, value) for each row of a table (a tuple of Option) and its value in options.
template <class Table, class Options, class F>
void ForEachRow(const Table& table, Options& options, const F& f) {
  std::apply([&](const auto&... row) { (f(row, options.*row.member), ...); }, table);
}

// "control_hz" -> "--control-hz".
inline std::string OptionName(const std::string& key) {
  std::string name = "--" + key;
  std::replace(name.begin(), name.end(), '_', '-');
  return name;
}

// Throws InputError for the first number that is out of its range, in the words of the command line.
template <class Options>
void CheckRanges(const Options& options) {
  const auto check = [](const std::string& key, const Range& range, const auto& number) {
    if (const auto x = static_cast<double>(number); x >= range.least && x <= range.most) return;
    throw InputError(OptionName(key) +
                     (range.most == Range{}.most
                          ? fmt::format(": expected {} or more, not {}", range.least, number)
                          : fmt::format(": expected {} to {}, not {}", range.least, range.most, number)));
  };
  ForEachOption(options, [&](const auto& row, const auto& value) {
    using Value = std::decay_t<decltype(value)>;
    if constexpr (std::is_same_v<Value, std::vector<int>>) {
      for (const int number : value) check(row.key, row.range, number);
    } else if constexpr (std::is_arithmetic_v<Value> && !std::is_same_v<Value, bool>) {
      check(row.key, row.range, value);
    }
  });
}

// Keys of the options that a run keeps from its beginning to its end.
template <class Options>
std::vector<std::string> FixedKeys(const Options& options) {
  std::vector<std::string> keys;
  ForEachOption(options, [&](const auto& row, const auto&) {
    if (row.is_fixed) keys.push_back(row.key);
  });
  return keys;
}

}  // namespace evalbus
