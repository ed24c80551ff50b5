#include <fmt/format.h>

#include "base/text.h"
#include "report/page/report_sections.h"

namespace evalbus::report {
namespace {

void SettingRow(const std::string& key, const std::string& value, Markup* html) {
  html->Element("tr", {}, [&] {
    html->Element("th", {{"scope", "row"}}, key);
    html->Element("td", {}, value);
  });
}

std::string SettingText(const nlohmann::ordered_json& value) {
  return value.is_string() ? value.get<std::string>() : value.dump();
}

// Returns the value of a key in run.json as text; empty if the key is missing.
std::string SettingOf(const nlohmann::ordered_json& info, const char* key) {
  const auto found = info.find(key);
  return found == info.end() || found->is_null() ? "" : SettingText(*found);
}

void MainSettings(const ReportRun& run, Markup* html) {
  const nlohmann::ordered_json& info = run.run.info;
  const auto row = [&](const std::string& key, const std::string& value) {
    if (!value.empty()) SettingRow(key, value, html);
  };
  if (!run.command.empty()) {
    html->Element("tr", {}, [&] {
      html->Element("th", {{"scope", "row"}}, "command");
      html->Element("td", {}, [&] { html->Element("code", {}, run.command); });
    });
  }
  row("policy", run.run.policy);
  row("task", run.run.task_name());
  row("robot", std::filesystem::path(SettingOf(info, "robot")).stem().string());
  const std::string of_all = run.run.is_part() ? fmt::format("{} of ", run.run.num_planned()) : "";
  row("episodes", fmt::format("{}{}, seed {}", of_all, Plural(run.run.planned, "episode"), run.run.seed));
  const std::string rate = SettingOf(info, "control_hz");
  if (!rate.empty()) row("pace", fmt::format("{} Hz, {}", rate, run.run.clock()));
  row("MuJoCo", run.run.engine());
  row("renderer", SettingOf(info, "renderer"));
  row("warning", SettingOf(info, "renderer_warning"));
  const std::string commit = SettingOf(info, "git_commit");
  row("evalbus", SettingOf(info, "evalbus_version") + (commit.empty() ? "" : " (" + commit + ")"));
}

// Writes all values of run.json except empty ones, and the hashes of the models unless run.json contains
// them.
void AllSettings(const ReportRun& run, Markup* html) {
  for (const auto& [key, value] : run.run.info.items()) {
    if (value.is_null() || value.empty() || value == "") continue;
    if (!value.is_object()) {
      SettingRow(key, SettingText(value), html);
      continue;
    }
    for (const auto& [part, of_part] : value.items())
      SettingRow(fmt::format("{}.{}", key, part), SettingText(of_part), html);
  }
  for (const auto& [key, hash] : run.model_hashes) {
    if (!run.run.info.contains(key)) SettingRow(key, hash, html);
  }
}

}  // namespace

void WriteMade(const RunSection& section) {
  Markup* html = section.html;
  const auto table = [&](void (*rows)(const ReportRun&, Markup*)) {
    html->Element("table", {{"class", "made"}},
                  [&] { html->Element("tbody", {}, [&] { rows(section.run, html); }); });
  };
  html->Element("section", {}, [&] {
    html->Element(section.heading, {{"id", section.id + "made"}}, "Configuration");
    table(MainSettings);
    html->Element("details", {{"class", "more"}}, [&] {
      html->Element("summary", {}, "All settings");
      table(AllSettings);
    });
  });
}

}  // namespace evalbus::report
