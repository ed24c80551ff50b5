// Converts the options of a table to JSON, in which a run stores them, and back.
#pragma once

#include <algorithm>
#include <filesystem>
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
        // The JSON library would convert true and 1.5 to 1.
        const bool fits =
            std::is_same_v<Value, bool>       ? found->is_boolean()
            : std::is_integral_v<Value>       ? found->is_number_integer()
            : std::is_floating_point_v<Value> ? found->is_number()
            : std::is_same_v<Value, std::vector<int>>
                ? std::ranges::all_of(*found, [](const auto& item) { return item.is_number_integer(); })
                : true;
        if (!fits) throw nlohmann::json::type_error::create(302, "", nullptr);
        value = found->template get<Value>();
      }
    } catch (const nlohmann::json::exception&) {
      throw InputError(file + ": " + row.key + ": expected " +
                       (std::is_same_v<Value, bool>                 ? "true or false"
                        : std::is_integral_v<Value>                 ? "a whole number"
                        : std::is_floating_point_v<Value>           ? "a number"
                        : std::is_convertible_v<Value, std::string> ? "a string"
                        : std::is_same_v<Value, std::vector<int>>   ? "a list of whole numbers"
                                                                    : "a list") +
                       ", got " +
                       found->dump(-1, ' ', false, nlohmann::json::error_handler_t::replace).substr(0, 40));
    }
  });
  CheckRanges(*options);
}

}  // namespace evalbus
