// Implements `evalbus demo`, which summarizes demonstrations of RoboEval and reduces their number of steps.
// It simulates nothing.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <set>

#include "base/errors.h"
#include "base/json_file.h"
#include "base/text.h"
#include "base/write_whole.h"
#include "cli/commands/commands.h"
#include "policy_bridge/policies/demonstration.h"

namespace evalbus::commands {
namespace {

namespace fs = std::filesystem;
using policy::Demonstration;

// Summary of one demonstration, or of all demonstrations of a task.
struct Facts {
  int demos = 0;
  size_t steps = 0;
  double seconds = 0, shortest = INFINITY, longest = 0;
  // Joint path length of each arm, rad: sum of the Euclidean norms of the changes of its joint positions.
  std::array<double, 2> path{};
  std::array<int, 2> closings{}, openings{};
  std::array<double, policy::kDemoWidth> min, max;
  // Steps per second of the demonstrations.
  std::set<double> rates;
  // Seeds of RoboEval's scenes, in the order of the files; null for a file whose metadata have no whole
  // number as seed.
  nlohmann::json seeds = nlohmann::json::array();

  Facts() {
    min.fill(INFINITY);
    max.fill(-INFINITY);
  }
  void Add(const Demonstration& demo) {
    ++demos;
    steps += demo.steps.size();
    rates.insert(demo.hz);
    const auto seed = demo.metadata.find("seed");
    const auto number =
        seed == demo.metadata.end() ? nlohmann::json() : nlohmann::json::parse(seed->second, nullptr, false);
    seeds.push_back(number.is_number_integer() ? number : nlohmann::json());
    seconds += demo.seconds();
    shortest = std::min(shortest, demo.seconds());
    longest = std::max(longest, demo.seconds());
    for (size_t i = 0; i < demo.steps.size(); ++i) {
      for (size_t c = 0; c < policy::kDemoWidth; ++c) {
        min[c] = std::min(min[c], demo.steps[i][c]);
        max[c] = std::max(max[c], demo.steps[i][c]);
      }
      if (i == 0) continue;
      for (size_t arm = 0; arm < 2; ++arm) {
        double squared = 0;
        for (size_t j = 0; j < 7; ++j) {
          const double change = demo.steps[i][7 * arm + j] - demo.steps[i - 1][7 * arm + j];
          squared += change * change;
        }
        path[arm] += std::sqrt(squared);
        const bool was = demo.steps[i - 1][policy::kDemoJoints + arm] > 0.5;
        const bool is = demo.steps[i][policy::kDemoJoints + arm] > 0.5;
        closings[arm] += !was && is;
        openings[arm] += was && !is;
      }
    }
  }
};

nlohmann::ordered_json Json(const Facts& facts) {
  nlohmann::ordered_json json = {
      {"demonstrations", facts.demos}, {"steps", facts.steps},         {"hz", nullptr},
      {"seconds", facts.seconds},      {"shortest_s", facts.shortest}, {"longest_s", facts.longest}};
  if (facts.rates.size() == 1) json["hz"] = *facts.rates.begin();
  json["joint_path_length_rad"] = {{"left", facts.path[0]}, {"right", facts.path[1]}};
  json["gripper_closings"] = {{"left", facts.closings[0]}, {"right", facts.closings[1]}};
  json["gripper_openings"] = {{"left", facts.openings[0]}, {"right", facts.openings[1]}};
  json["seeds"] = facts.seeds;
  json["min"] = facts.min;
  json["max"] = facts.max;
  return json;
}

std::string SeedsText(const nlohmann::json& seeds) {
  constexpr size_t kMost = 8;
  std::string text;
  for (size_t i = 0; i < std::min(kMost, seeds.size()); ++i) {
    text += (i == 0 ? "" : ", ") + (seeds[i].is_null() ? "unknown" : seeds[i].dump());
  }
  return seeds.size() <= kMost ? text : text + fmt::format(", {} more (--json)", seeds.size() - kMost);
}

int Info(const fs::path& path, bool as_json) {
  std::map<std::string, Facts> tasks;
  for (const fs::path& file : policy::DemonstrationFiles(path)) {
    const Demonstration demo = policy::ReadDemonstration(file);
    tasks[demo.task.empty() ? "(not in a task's folder)" : demo.task].Add(demo);
  }
  if (as_json) {
    nlohmann::ordered_json json;
    for (const auto& [task, facts] : tasks) json[task] = Json(facts);
    fmt::print("{}\n", ToText(json, 2));
    return 0;
  }
  for (const auto& [task, facts] : tasks) {
    const double n = facts.demos;
    fmt::print("{}\n", Printable(task));
    fmt::print("  {}, {} steps at {:g} Hz, mean duration {:.2f} s ({:.2f} to {:.2f})\n",
               Plural(facts.demos, "demonstration"), facts.steps, fmt::join(facts.rates, " and "),
               facts.seconds / n, facts.shortest, facts.longest);
    fmt::print("  seeds of RoboEval's scenes: {}\n", SeedsText(facts.seeds));
    for (size_t arm = 0; arm < 2; ++arm) {
      fmt::print("  {:<5}  on average: joint path {:.2f} rad, gripper closes {:.1f} and opens {:.1f} times\n",
                 arm == 0 ? "left" : "right", facts.path[arm] / n, facts.closings[arm] / n,
                 facts.openings[arm] / n);
      fmt::print("         rad ");
      for (size_t j = 7 * arm; j < 7 * arm + 7; ++j)
        fmt::print(" [{:.2f} {:.2f}]", facts.min[j], facts.max[j]);
      fmt::print("\n");
    }
  }
  return 0;
}

int Convert(const fs::path& path, const fs::path& out, double hz, bool as_csv) {
  const auto files = policy::DemonstrationFiles(path);
  const bool is_folder = fs::is_directory(path);
  if (fs::exists(out)) throw InputError("--out " + out.string() + ": exists; choose another name");
  // All files are read before the first file is written.
  std::vector<std::pair<fs::path, std::string>> results;
  for (const fs::path& file : files) {
    const Demonstration demo = policy::AtRate(policy::ReadDemonstration(file), hz);
    fs::path name = out;
    if (is_folder) name /= fs::relative(file, path).replace_extension(as_csv ? ".csv" : ".safetensors");
    results.emplace_back(name, as_csv ? policy::AsCsv(demo) : policy::AsSafetensors(demo));
  }
  for (const auto& [name, text] : results) {
    if (is_folder) fs::create_directories(name.parent_path());
    WriteWhole(name, text);
  }
  fmt::print("{} at {:g} Hz  {}\n", Plural(files.size(), "demonstration"), hz, out.string());
  return 0;
}

}  // namespace

Action AddDemo(CLI::App* app) {
  struct Options {
    fs::path path, out;
    bool json = false, csv = false;
    double hz = 20;
  };
  const auto options = std::make_shared<Options>();
  app->require_subcommand(1);
  CLI::App* info = app->add_subcommand(
      "info", "print duration, joint path, gripper events and joint ranges of each task's demonstrations");
  info->add_option("path", options->path, "a *.safetensors file, or a folder of them")->required();
  info->add_flag("--json", options->json, "print JSON");
  CLI::App* convert = app->add_subcommand("convert",
                                          "reduce the number of steps by RoboEval's rule: each window "
                                          "becomes the mean of its joint values and its last gripper values");
  convert->add_option("path", options->path, "a *.safetensors file, or a folder of them")->required();
  convert->add_option("--hz", options->hz, "steps per second in the result")->capture_default_str();
  convert->add_option("--out", options->out, "file or folder to write")->required();
  convert->add_flag("--csv", options->csv, "write CSV tables instead of safetensors");
  return [=] {
    return info->parsed() ? Info(options->path, options->json)
                          : Convert(options->path, options->out, options->hz, options->csv);
  };
}

}  // namespace evalbus::commands
