#include "base/json_file.h"

#include <algorithm>
#include <fstream>
#include <set>
#include <string>
#include <vector>

#include "base/errors.h"

namespace evalbus {

using nlohmann::json;

nlohmann::json ReadJsonFile(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream || std::filesystem::is_directory(file)) {
    throw InputError(file.string() + ": expected a JSON file, it cannot be read");
  }
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  const auto fail = [&](size_t position, const std::string& reason) {
    const auto line = 1 + std::count(text.begin(), text.begin() + std::min(position, text.size()), '\n');
    throw InputError(file.string() + ":" + std::to_string(line) + ": expected JSON, " + reason);
  };
  // A repeated key would silently replace the first.
  std::vector<std::set<std::string>> open_objects;
  const auto check_keys = [&](int, json::parse_event_t event, json& parsed) {
    if (event == json::parse_event_t::object_start) open_objects.emplace_back();
    if (event == json::parse_event_t::object_end) open_objects.pop_back();
    if (event == json::parse_event_t::key && !open_objects.back().insert(parsed.get<std::string>()).second) {
      throw InputError(file.string() + ": " + parsed.get<std::string>() +
                       ": expected each key once, it is repeated");
    }
    return true;
  };
  try {
    return json::parse(text, check_keys);
  } catch (const json::parse_error& error) {
    // "[json.exception.parse_error.101] parse error at line 1, column 2: REASON"
    const std::string what = error.what();
    const size_t colon = what.find(": ");
    fail(error.byte > 0 ? error.byte - 1 : 0, colon == std::string::npos ? what : what.substr(colon + 2));
  } catch (const json::out_of_range& error) {
    // "number overflow parsing '1e999'"
    const std::string what = error.what();
    const size_t open = what.find('\''), close = what.rfind('\'');
    const std::string number = open < close ? what.substr(open + 1, close - open - 1) : "";
    fail(text.find(number), "the number " + number + " does not fit a double");
  }
  return {};
}

}  // namespace evalbus
