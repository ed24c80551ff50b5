// Converts the options of a table to JSON, in which a run stores them, and back.
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <type_traits>
#include <vector>

#include "base/options.h"

namespace evalbus {

namespace internal {
inline std::string Plain(const std::filesystem::path& path) { return path.string(); }
template <class Value>
const Value& Plain(const Value& value) {
  return value;
}

// Returns whether the value is a whole number that Number can represent. From 2^32 + 1, the JSON library
// would get the int 1.
template <class Number>
bool IsWhole(const nlohmann::json& value) {
  if (!value.is_number_integer()) return false;
  if (!value.is_number_unsigned() && value.get<int64_t>() < 0)
    return value.get<int64_t>() >= static_cast<int64_t>(std::numeric_limits<Number>::min());
  return value.get<uint64_t>() <= static_cast<uint64_t>(std::numeric_limits<Number>::max());
}

// Returns whether the value has the type of an option. The JSON library would convert true and 1.5 to 1.
template <class Value>
bool Fits(const nlohmann::json& value) {
  if constexpr (std::is_same_v<Value, bool>) {
    return value.is_boolean();
  } else if constexpr (std::is_integral_v<Value>) {
    return IsWhole<Value>(value);
  } else if constexpr (std::is_floating_point_v<Value>) {
    return value.is_number();
  } else if constexpr (std::is_same_v<Value, std::vector<int>>) {
    return std::ranges::all_of(value, [](const auto& item) { return IsWhole<int>(item); });
  } else {
    return true;
  }
}
}  // namespace internal

// Returns all options by key.
template <class Options>
nlohmann::ordered_json OptionsJson(const Options& options) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  ForEachOption(options, [&](const auto& row, const auto& value) {
    if constexpr (std::is_same_v<std::decay_t<decltype(value)>, std::vector<std::filesystem::path>>) {
      nlohmann::ordered_json& list = json[row.key] = nlohmann::ordered_json::array();
      for (const auto& path : value) list.push_back(path.string());
    } else {
      json[row.key] = internal::Plain(value);
    }
  });
  return json;
}

// Reads all options from an object, which may also contain other keys. Throws an InputError that names the
// file and, if there is an object, the key; or, if a number is out of its range, the command-line option.
template <class Options>
void ReadOptions(const nlohmann::json& json, const std::string& file, Options* options) {
  if (!json.is_object()) throw InputError(file + ": expected a JSON object");
  ForEachOption(*options, [&](const auto& row, auto& value) {
    using Value = std::decay_t<decltype(value)>;
    const auto found = json.find(row.key);
    if (found == json.end()) throw InputError(file + ": " + row.key + ": required key is missing");
    try {
      if constexpr (std::is_same_v<Value, std::filesystem::path>) {
        value = found->template get<std::string>();
      } else if constexpr (std::is_same_v<Value, std::vector<std::filesystem::path>>) {
        value.clear();
        for (const std::string& path : found->template get<std::vector<std::string>>())
          value.emplace_back(path);
      } else {
        if (!internal::Fits<Value>(*found)) throw nlohmann::json::type_error::create(302, "", nullptr);
        value = found->template get<Value>();
      }
    } catch (const nlohmann::json::exception&) {
      const bool is_too_large =
          std::is_integral_v<Value> && !std::is_same_v<Value, bool> && found->is_number_integer();
      throw InputError(file + ": " + row.key + ": expected " +
                       (std::is_same_v<Value, bool>                 ? "true or false"
                        : std::is_integral_v<Value>                 ? "a whole number"
                        : std::is_floating_point_v<Value>           ? "a number"
                        : std::is_convertible_v<Value, std::string> ? "a string"
                        : std::is_same_v<Value, std::vector<int>>   ? "a list of whole numbers"
                                                                    : "a list") +
                       (is_too_large ? fmt::format(" of at most {} bits", 8 * sizeof(Value)) : "") +
                       ", got " +
                       found->dump(-1, ' ', false, nlohmann::json::error_handler_t::replace).substr(0, 40));
    }
  });
  CheckRanges(*options);
}

}  // namespace evalbus
