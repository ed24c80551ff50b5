#include "results/verdicts.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <utility>

#include "base/errors.h"
#include "base/input_file.h"
#include "base/json_file.h"
#include "base/text.h"
#include "base/write_whole.h"
#include "results/run_folder.h"

namespace evalbus::results {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

bool IsCount(const ordered_json& json) {
  return json.is_number_unsigned() && json.get<uint64_t>() <= 10'000'000;
}

bool IsOperatorName(const std::string& name) {
  return !name.empty() && name.size() <= kMaxOperatorBytes && Printable(name) == name;
}

template <class T>
std::optional<T> GetIfSet(const ordered_json& json) {
  return json.is_null() ? std::nullopt : std::optional(json.get<T>());
}

template <class T>
ordered_json OrNull(const std::optional<T>& value) {
  return value ? ordered_json(*value) : ordered_json();
}

ordered_json ToJson(const Verdict& verdict) {
  ordered_json json = {{"episode", verdict.episode},       {"operator", verdict.operator_name},
                       {"verdict", Word(verdict.outcome)}, {"stages_reached", OrNull(verdict.stages)},
                       {"rubric", OrNull(verdict.rubric)}, {"time_utc", verdict.time},
                       {"place", verdict.place},           {"order_seed", OrNull(verdict.order_seed)}};
  if (!verdict.other_run.empty()) json["other_run"] = verdict.other_run;
  return json;
}

// A key and the check of its value. The first key whose check fails is reported.
struct Key {
  const char *name, *expected;
  bool (*holds)(const ordered_json&);
  bool is_optional = false;
};
constexpr Key kKeys[] = {
    {"episode", "the number of an episode", IsCount},
    {"operator", "a name of 1 to 100 bytes without control characters",
     [](const ordered_json& json) { return json.is_string() && IsOperatorName(json.get<std::string>()); }},
    {"verdict", "\"success\", \"failure\" or \"abstain\"",
     [](const ordered_json& json) { return json.is_string() && ParseOutcome(json.get<std::string>()); }},
    {"stages_reached", "a number of stages or null",
     [](const ordered_json& json) { return json.is_null() || IsCount(json); }},
    {"rubric", "a number from 0 to 10 or null",
     [](const ordered_json& json) {
       return json.is_null() ||
              (json.is_number() && json.get<double>() >= 0 && json.get<double>() <= kMaxRubric);
     }},
    {"time_utc", "a string", [](const ordered_json& json) { return json.is_string(); }},
    {"place", "a number from 0", IsCount},
    {"order_seed", "an integer or null",
     [](const ordered_json& json) {
       if (json.is_number_unsigned()) return std::in_range<int64_t>(json.get<uint64_t>());
       return json.is_null() || json.is_number_integer();
     }},
    {"other_run", "a SHA-256",
     [](const ordered_json& json) { return json.is_string() && json.get<std::string>().size() == 64; }, true},
};

Verdict ParseVerdict(const ordered_json& json, const std::string& where) {
  if (!json.is_object()) throw InputError(where + ": expected a JSON object with a verdict");
  for (const Key& key : kKeys) {
    const auto found = json.find(key.name);
    if (found == json.end() && key.is_optional) continue;
    if (found == json.end() || !key.holds(*found))
      throw InputError(fmt::format("{}: \"{}\": expected {}", where, key.name, key.expected));
  }
  // WriteVerdict() would drop other keys.
  for (const auto& [name, value] : json.items()) {
    if (std::ranges::none_of(kKeys, [&](const Key& key) { return name == key.name; }))
      throw InputError(fmt::format("{}: unknown key \"{}\"", where, Printable(name)));
  }
  return {.episode = json["episode"].get<int>(),
          .operator_name = json["operator"].get<std::string>(),
          .outcome = *ParseOutcome(json["verdict"].get<std::string>()),
          .stages = GetIfSet<int>(json["stages_reached"]),
          .rubric = GetIfSet<double>(json["rubric"]),
          .time = json["time_utc"].get<std::string>(),
          .place = json["place"].get<int>(),
          .order_seed = GetIfSet<int64_t>(json["order_seed"]),
          .other_run = json.value("other_run", "")};
}

}  // namespace

const char* Word(Outcome outcome) {
  return outcome == Outcome::kSuccess ? "success" : outcome == Outcome::kFailure ? "failure" : "abstain";
}

std::optional<Outcome> ParseOutcome(const std::string& word) {
  for (const Outcome outcome : {Outcome::kSuccess, Outcome::kFailure, Outcome::kAbstain}) {
    if (word == Word(outcome)) return outcome;
  }
  return std::nullopt;
}

void CheckOperatorName(const std::string& name) {
  if (IsOperatorName(name)) return;
  throw InputError(fmt::format("--operator: expected a name of 1 to {} bytes without control characters",
                               kMaxOperatorBytes));
}

std::vector<Verdict> ReadVerdicts(const fs::path& run) {
  const fs::path file = run / kVerdictsJsonl;
  std::vector<Verdict> verdicts;
  if (!fs::exists(file)) return verdicts;
  std::istringstream lines(ReadInput(file, "verdicts"));
  std::set<std::pair<int, std::string>> known;
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    const std::string where = fmt::format("{}:{}", file.string(), number);
    verdicts.push_back(ParseVerdict(ParseJson<ordered_json>(line, file.string(), number), where));
    const Verdict& verdict = verdicts.back();
    if (!known.emplace(verdict.episode, verdict.operator_name).second) {
      throw InputError(fmt::format("{}: a second verdict of {} on episode {}", where,
                                   Printable(verdict.operator_name), verdict.episode));
    }
  }
  return verdicts;
}

void WriteVerdict(const fs::path& run, const Verdict& verdict) {
  const fs::path file = run / kVerdictsJsonl;
  // A link could lead out of the run's folder.
  if (fs::is_symlink(file))
    throw InputError(file.string() + ": a link; verdicts are not written through links");
  const RunFilesLock lock(run);
  std::vector<Verdict> verdicts = ReadVerdicts(run);
  const auto same = std::ranges::find_if(verdicts, [&](const Verdict& other) {
    return other.episode == verdict.episode && other.operator_name == verdict.operator_name;
  });
  if (same == verdicts.end()) {
    verdicts.push_back(verdict);
  } else {
    *same = verdict;
  }
  std::string text;
  for (const Verdict& one : verdicts) text += ToText(ToJson(one)) + "\n";
  WriteWhole(file, text);
}

}  // namespace evalbus::results
