#include "results/no_return.h"

#include <fmt/format.h>

#include <array>
#include <utility>

#include "base/errors.h"
#include "base/json_file.h"
#include "base/number_from.h"
#include "base/write_whole.h"
#include "results/run_folder.h"

namespace evalbus::results {
namespace {

namespace fs = std::filesystem;
using Kind = NoReturn::Kind;

constexpr std::array<std::pair<Kind, const char*>, 4> kKinds = {{{Kind::kLost, "lost"},
                                                                 {Kind::kOutOfTime, "out_of_time"},
                                                                 {Kind::kNever, "never"},
                                                                 {Kind::kOpen, "open"}}};

const char* WordOf(Kind kind) {
  for (const auto& [known, word] : kKinds)
    if (known == kind) return word;
  return "";
}

NoReturn ReadPoint(const nlohmann::json& json) {
  NoReturn point;
  const auto word = json.at("kind").get<std::string>();
  bool is_known = false;
  for (const auto& [kind, known] : kKinds) {
    if (word != known) continue;
    point.kind = kind;
    is_known = true;
  }
  if (!is_known) throw InputError("unknown kind " + word);
  point.tick = json.at("tick").get<int64_t>();
  point.time_s = json.at("time_s").get<double>();
  point.is_monotone = json.at("monotone").get<bool>();
  return point;
}

}  // namespace

std::string NoReturnText(const NoReturn& point) {
  std::string text;
  switch (point.kind) {
    case Kind::kLost:
      text = fmt::format(
          "Point of no return at {:.2f} s: from later ticks, the expert fails, even with more time",
          point.time_s);
      break;
    case Kind::kOutOfTime:
      text = fmt::format("Point of no return at {:.2f} s: from later ticks, the expert has too little time",
                         point.time_s);
      break;
    case Kind::kNever:
      return "No point of no return: the expert fails even from the start.";
    case Kind::kOpen:
      text = fmt::format("No point of no return: the expert still succeeds from the end, at {:.2f} s",
                         point.time_s);
      break;
  }
  return text + (point.is_monotone ? "." : ". It also fails from some earlier ticks.");
}

NoReturns ReadNoReturns(const fs::path& run) {
  const fs::path file = run / kNoReturnJson;
  NoReturns points;
  if (!fs::exists(file)) return points;
  const auto json = ReadJsonFile(file);
  try {
    for (const auto& [key, point] : json.items()) {
      const auto episode = NumberFrom<int>(key);
      if (!episode) throw InputError("\"" + key + "\" is not the number of an episode");
      points[*episode] = ReadPoint(point);
    }
  } catch (const std::exception& error) {
    throw InputError(file.string() +
                     ": expected points by episode, as 'evalbus why' writes them: " + error.what());
  }
  return points;
}

nlohmann::ordered_json NoReturnsJson(const NoReturns& points) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (const auto& [episode, point] : points) {
    json[std::to_string(episode)] = {{"kind", WordOf(point.kind)},
                                     {"tick", point.tick},
                                     {"time_s", point.time_s},
                                     {"monotone", point.is_monotone},
                                     {"text", NoReturnText(point)}};
  }
  return json;
}

void AddNoReturns(const fs::path& run, const NoReturns& points) {
  const RunFilesLock lock(run);
  NoReturns all = ReadNoReturns(run);
  for (const auto& [episode, point] : points) all.insert_or_assign(episode, point);
  WriteWhole(run / kNoReturnJson, ToText(NoReturnsJson(all), 2) + "\n");
}

}  // namespace evalbus::results
