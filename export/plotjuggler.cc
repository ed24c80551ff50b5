#include "export/plotjuggler.h"

#include <nlohmann/json.hpp>

#include "base/json_file.h"

namespace evalbus::exports {
namespace {

using Json = nlohmann::ordered_json;

void Flatten(const std::string& path, const Json& json, std::vector<std::pair<std::string, Json>>* numbers) {
  if (json.is_number()) {
    numbers->emplace_back(path, json);
  } else if (json.is_boolean()) {
    numbers->emplace_back(path, json.get<bool>() ? 1 : 0);
  } else if (json.is_object()) {
    for (const auto& [key, value] : json.items()) {
      if (key != "timestamp") Flatten(path + "/" + key, value, numbers);
    }
  } else if (json.is_array()) {
    for (const Json& entry : json) {
      if (entry.is_object() && entry.contains("name") && entry["name"].is_string()) {
        Flatten(path + "/" + entry["name"].get<std::string>(), entry, numbers);
      }
    }
  }
}

}  // namespace

std::vector<std::string> Datagrams(const std::string& topic, double time_s, const std::string& json) {
  std::vector<std::pair<std::string, Json>> numbers;
  Flatten(topic, ParseJson<Json>(json, topic), &numbers);
  const std::string begin = "{\"timestamp\":" + Json(time_s).dump();
  std::vector<std::string> datagrams;
  std::string text = begin;
  for (const auto& [path, value] : numbers) {
    const std::string entry = "," + ToText(Json(path)) + ":" + value.dump();
    if (begin.size() + entry.size() + 1 > kDatagramBytes) continue;  // too long for any datagram
    if (text.size() + entry.size() + 1 > kDatagramBytes) {
      datagrams.push_back(text + "}");
      text = begin;
    }
    text += entry;
  }
  if (text.size() > begin.size()) datagrams.push_back(text + "}");
  return datagrams;
}

}  // namespace evalbus::exports
