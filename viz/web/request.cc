#include "viz/web/request.h"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <tuple>

#include "base/number_from.h"
#include "base/run_layout.h"

namespace evalbus::viz {
namespace {

constexpr size_t kMaxName = 64, kIdLength = 64;
// Largest index of a run in a message.
constexpr uint64_t kMaxRun = 1'000'000;

std::optional<int> WholeNumber(std::string_view text) {
  const auto number = NumberFrom<int>(text);
  return number && *number >= 0 ? number : std::nullopt;
}

bool IsFileName(std::string_view name) {
  const auto is_plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-' || c == '.';
  };
  return !name.empty() && name.size() <= kMaxName && name[0] != '.' && std::ranges::all_of(name, is_plain);
}

bool IsId(std::string_view name) {
  return name.size() == kIdLength &&
         std::ranges::all_of(name, [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
}

// Removes a prefix of the text. Returns false if the text does not begin with it.
bool RemovePrefix(std::string_view* text, std::string_view prefix) {
  if (!text->starts_with(prefix)) return false;
  text->remove_prefix(prefix.size());
  return true;
}

}  // namespace

bool SameText(std::string_view a, std::string_view b) {
  unsigned char difference = a.size() == b.size() ? 0 : 1;
  for (size_t i = 0; i < b.size(); ++i) {
    const char other = a.empty() ? '\0' : a[i % a.size()];
    difference = static_cast<unsigned char>(difference | (other ^ b[i]));
  }
  return difference == 0;
}

WebTarget ParseTarget(std::string_view target, std::string_view token) {
  using Kind = WebTarget::Kind;
  target = target.substr(0, target.find('?'));
  if (!RemovePrefix(&target, "/")) return {};
  if (!token.empty()) {
    const size_t end = target.find('/');
    if (end == target.npos || !SameText(target.substr(0, end), token)) return {};
    target.remove_prefix(end + 1);
  }
  if (target.empty()) return {Kind::kPage};
  if (target == "live") return {Kind::kLive};
  if (RemovePrefix(&target, "page/")) {
    return IsFileName(target) ? WebTarget{Kind::kPageFile, std::string(target)} : WebTarget{};
  }
  if (RemovePrefix(&target, "block/")) {
    return IsId(target) ? WebTarget{Kind::kBlock, std::string(target)} : WebTarget{};
  }
  if (RemovePrefix(&target, "episode/")) {
    const size_t slash = target.find('/');
    if (slash == target.npos) return {};
    const auto run = WholeNumber(target.substr(0, slash)), episode = WholeNumber(target.substr(slash + 1));
    if (run && episode) return {Kind::kEpisode, "", *run, *episode};
  }
  return {};
}

bool IsLoopbackHost(std::string_view host) {
  constexpr std::array<std::string_view, 3> kNames = {"127.0.0.1", "localhost", "[::1]"};
  for (const std::string_view name : kNames) {
    std::string_view rest = host;
    if (!RemovePrefix(&rest, name)) continue;
    if (rest.empty()) return true;
    if (!RemovePrefix(&rest, ":")) return false;
    const auto port = WholeNumber(rest);
    return port && *port > 0 && *port <= 65535;
  }
  return false;
}

bool IsOwnOrigin(std::string_view origin, std::string_view host) {
  if (origin.empty()) return true;  // no page sent it, because browsers add Origin to each WebSocket request
  return !host.empty() && RemovePrefix(&origin, "http://") && origin == host;
}

std::optional<int> ParseWatch(std::string_view message) {
  const auto json = nlohmann::json::parse(message, nullptr, false);
  if (!json.is_object() || json.size() != 1) return std::nullopt;
  const auto watch = json.find("watch");
  if (watch == json.end() || !watch->is_number_unsigned()) return std::nullopt;
  const auto run = watch->get<uint64_t>();
  return run <= kMaxRun ? std::optional(static_cast<int>(run)) : std::nullopt;
}

std::optional<WebNote> ParseNote(std::string_view message) {
  const auto json = nlohmann::json::parse(message, nullptr, false);
  if (!json.is_object() || json.size() != 1 || !json.contains("note")) return std::nullopt;
  const auto& note = json["note"];
  if (!note.is_object() || note.size() != 3 || !note.contains("text") || !note["text"].is_string()) {
    return std::nullopt;
  }
  WebNote parsed{.text = note["text"].get<std::string>()};
  for (const auto& [key, number, max] :
       {std::tuple("run", &parsed.run, kMaxRun), {"episode", &parsed.episode, kMaxEpisode}}) {
    const auto value = note.find(key);
    if (value == note.end() || !value->is_number_unsigned() || value->get<uint64_t>() > max) {
      return std::nullopt;
    }
    *number = value->get<int>();
  }
  return parsed;
}

std::optional<WebVerdict> ParseVerdict(std::string_view message) {
  constexpr int kMaxStages = 1000;
  constexpr double kMaxRubric = 10;
  const auto json = nlohmann::json::parse(message, nullptr, false);
  if (!json.is_object() || json.size() != 1 || !json.contains("verdict")) return std::nullopt;
  const auto& verdict = json["verdict"];
  if (!verdict.is_object() || verdict.size() != 4) return std::nullopt;
  for (const char* key : {"episode", "outcome", "stages", "rubric"}) {
    if (!verdict.contains(key)) return std::nullopt;
  }
  const auto is_count = [](const nlohmann::json& value, uint64_t max) {
    return value.is_number_unsigned() && value.get<uint64_t>() <= max;
  };
  const auto &episode = verdict["episode"], &outcome = verdict["outcome"], &stages = verdict["stages"],
             &rubric = verdict["rubric"];
  if (!is_count(episode, kMaxEpisode)) return std::nullopt;
  if (outcome != "success" && outcome != "failure" && outcome != "abstain") return std::nullopt;
  if (!stages.is_null() && !is_count(stages, kMaxStages)) return std::nullopt;
  if (!rubric.is_null() &&
      !(rubric.is_number() && rubric.get<double>() >= 0 && rubric.get<double>() <= kMaxRubric)) {
    return std::nullopt;
  }
  WebVerdict parsed{
      .episode = episode.get<int>(), .outcome = outcome.get<std::string>(), .stages = {}, .rubric = {}};
  if (!stages.is_null()) parsed.stages = stages.get<int>();
  if (!rubric.is_null()) parsed.rubric = rubric.get<double>();
  return parsed;
}

}  // namespace evalbus::viz
