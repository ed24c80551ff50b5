// JSON from outside, whose mistakes are to be found, and with words from outside.
#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace evalbus {

// The only ways in for JSON; Json is nlohmann::json or nlohmann::ordered_json. Throw InputError: file, line
// and reason. NaN, infinities, numbers that no double holds, repeated keys and what is nested deeper than any
// of ours are refused.
template <class Json = nlohmann::json>
Json ReadJsonFile(const std::filesystem::path& file);
// Of the array at `key` of the outermost object each element for which take(what was read before it, it) is
// true is not kept: files of any length. Of what comes behind an object so taken, take_text has the first
// say: from the text from there on, which may end anywhere, it takes as many elements as it can, and returns
// where the last of them begins, with the comma before it, and ends; 0 and 0: none. What it takes must be
// right.
using TakeElement = std::function<bool(const nlohmann::json& so_far, const nlohmann::json& element)>;
struct LastTaken {
  size_t begin = 0, end = 0;
};
using TakeText = std::function<LastTaken(std::string_view text)>;
nlohmann::json ReadJsonFile(const std::filesystem::path& file, const std::string& key,
                            const TakeElement& take, const TakeText& take_text = {});
// `line`: the text is this one of the file; 0: it is the whole file.
template <class Json = nlohmann::json>
Json ParseJson(const std::string& text, const std::string& file, int line = 0);

// JSON as text, in lines where indent is not negative. Words of another process, or names in a file, may be
// any bytes: what is no UTF-8 becomes U+FFFD.
template <class Json>
std::string ToText(const Json& json, int indent = -1) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

}  // namespace evalbus
