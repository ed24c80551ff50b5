// Reads and writes JSON that comes from users or other programs.
#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

namespace evalbus {

// Files of users are read with these functions; Json is nlohmann::json or nlohmann::ordered_json. They throw
// InputError with file, reason and, for an error that the parser reports, line; and the errors of InputFile.
// They refuse NaN, infinities, numbers that do not fit a double, repeated keys and excessive nesting.
template <class Json = nlohmann::json>
Json ReadJsonFile(const std::filesystem::path& file);
// Streaming variant for files of any length. For each object in the array at `key` of the outermost object,
// take(what was read so far, the object) is called; if it returns true, the object is not stored. Once an
// element is stored, take() is not called any more.
using TakeElement = std::function<bool(const nlohmann::json& so_far, const nlohmann::json& element)>;
nlohmann::json ReadJsonFile(const std::filesystem::path& file, const std::string& key,
                            const TakeElement& take);
// Parses a text. line: number of the text's line in the file; 0 if the text is the whole file.
template <class Json = nlohmann::json>
Json ParseJson(const std::string& text, const std::string& file, int line = 0);

// Returns JSON as text, on several lines if indent is not negative. Invalid UTF-8, which texts of other
// processes and file names may contain, is replaced by U+FFFD.
template <class Json>
std::string ToText(const Json& json, int indent = -1) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

}  // namespace evalbus
