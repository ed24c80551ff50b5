// Options as data. Each option is a member of a plain struct and one row of a table. The table defines the
// command line and its help (base/arguments.h), the check of ranges, the JSON that a run stores, and which
// options `--resume` requires to be unchanged.
//
// Each struct with options has a function ForEachOption(Struct& or const Struct&, f) in its namespace, which
// calls f(row, value) for each option.
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

// Allowed range of a number, both ends included. NaN is in no range.
struct Range {
  double least = std::numeric_limits<double>::lowest();
  double most = std::numeric_limits<double>::max();
};

template <class Options, class Value>
struct Option {
  Value Options::*member;
  // Key in JSON ("control_hz"), from which the option's name on the command line (--control-hz) is derived.
  const char* key;
  // Text for --help. Empty for options that are internal, which --help does not list.
  std::string help{};
  // Allowed range of the number, or of each element of a list.
  Range range{};
  // `--resume` requires the same value as in the original run.
  bool is_fixed = false;
};
template <class Options, class Value, class... Rest>
Option(Value Options::*, Rest...) -> Option<Options, Value>;

// Calls f(row, value) for each row of a table (a tuple of Option) and its value in options.
template <class Table, class Options, class F>
void ForEachRow(const Table& table, Options& options, const F& f) {
  std::apply([&](const auto&... row) { (f(row, options.*row.member), ...); }, table);
}

// Returns the option's name on the command line: "control_hz" -> "--control-hz".
inline std::string OptionName(const std::string& key) {
  std::string name = "--" + key;
  std::replace(name.begin(), name.end(), '_', '-');
  return name;
}

// Throws InputError for the first number that is out of its range; the text names the command-line option.
template <class Options>
void CheckRanges(const Options& options) {
  const auto check = [](const std::string& key, const Range& range, const auto& number) {
    if (const auto x = static_cast<double>(number); x >= range.least && x <= range.most) return;
    throw InputError(OptionName(key) +
                     (range.most == Range{}.most
                          ? fmt::format(": expected {} or more, got {}", range.least, number)
                          : fmt::format(": expected {} to {}, got {}", range.least, range.most, number)));
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

// Returns the keys of the options that must not change when a run is resumed.
template <class Options>
std::vector<std::string> FixedKeys(const Options& options) {
  std::vector<std::string> keys;
  ForEachOption(options, [&](const auto& row, const auto&) {
    if (row.is_fixed) keys.push_back(row.key);
  });
  return keys;
}

}  // namespace evalbus
