// JSON from outside, whose mistakes are to be found, and with words from outside.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

namespace evalbus {

// Reads a JSON file. Throws InputError: file, line and reason. NaN, infinities and repeated keys are refused.
nlohmann::json ReadJsonFile(const std::filesystem::path& file);

// JSON as text, in lines where indent is not negative. Words of another process, or names in a file, may be
// any bytes: what is no UTF-8 becomes U+FFFD.
template <class Json>
std::string ToText(const Json& json, int indent = -1) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

}  // namespace evalbus
