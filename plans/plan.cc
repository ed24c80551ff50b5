#include "plans/plan.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <iterator>
#include <map>
#include <set>

#include "base/errors.h"
#include "base/input_file.h"
#include "base/options_json.h"
#include "base/text.h"
#include "metrics/statistics/confidence_sequence.h"
#include "models/model_sources.h"
#include "models/robot_description.h"
#include "models/task_description.h"
#include "models/yaml_reader.h"
#include "plans/plan_folder.h"
#include "policy_bridge/policy_options.h"
#include "results/manifest.h"
#include "runner/engines.h"
#include "runner/suite.h"
#include "viz/images/renderer.h"

namespace evalbus::plans {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr int kMaxEpisodes = 10'000'000;
constexpr double kMaxAlpha = 0.5;
// Options that a plan sets with separate keys, or that are chosen separately on each machine that runs a part
// of it.
constexpr const char* kNotOptions[] = {"policy",  "contract", "policy_name", "episodes",   "seed", "only",
                                       "workers", "url",      "by_hand",     "in_process", "video"};

bool IsOption(const std::string& key) { return std::ranges::find(kNotOptions, key) == std::end(kNotOptions); }

// Resolves the path of a YAML file, or of a variation in it ("my_task.yaml/position"), relative to the plan's
// folder if the file exists there. Returns other names unchanged.
std::string FromPlan(const std::string& name, const fs::path& plan) {
  if (!IsTaskFile(name)) return name;
  const fs::path path(name), folder = fs::absolute(plan).parent_path();
  const fs::path file = IsTaskFile(path.parent_path()) ? path.parent_path() : path;
  return fs::exists(folder / file) ? (folder / name).lexically_normal().string() : name;
}

// Returns the reason why a policy's name is not allowed; empty if it is allowed. The name must be usable as a
// folder next to the plan's own files.
std::string ProblemOfPolicyName(const std::string& name) {
  constexpr std::array kTaken = {kPlanJson,    kStopsJson,  kPartsFolder,
                                 kSlurmFolder, kReportHtml, results::kManifestJson};
  if (name.empty() || name.starts_with(".") || name.find('/') != std::string::npos ||
      Printable(name) != name || name.size() > 100) {
    return "expected a name that is valid for a folder, got '" + OneLine(name) + "'";
  }
  if (std::ranges::find(kTaken, name) == kTaken.end()) return "";
  return "a policy cannot be named '" + name + "': the folder of a plan's results has a file of this name";
}

// Returns the default name of a policy; empty for the address of a server.
std::string DefaultName(const std::string& policy) {
  if (policy.find("://") != std::string::npos) return "";
  const bool is_path = policy.find('/') != std::string::npos || policy::IsContractFile(policy);
  std::string name = is_path ? fs::path(policy).stem().string() : policy;
  std::ranges::replace(name, ':', '-');
  return name;
}

PlannedPolicy ReadPolicy(const YamlValue& value, const fs::path& file) {
  PlannedPolicy policy;
  policy.where = value.Where();
  if (value.is_scalar()) {
    policy.policy = FromPlan(value.Text(), file);
  } else {
    const YamlMap map(value, {"policy"}, {"name", "contract", "latency", "execution"});
    policy.policy = FromPlan(map["policy"].Text(), file);
    if (const YamlValue* contract = map.Find("contract")) policy.contract = FromPlan(contract->Text(), file);
    if (const YamlValue* name = map.Find("name")) policy.name = name->Text();
    if (const YamlValue* latency = map.Find("latency")) policy.latency = latency->Text();
    if (const YamlValue* execution = map.Find("execution")) policy.execution = execution->Text();
  }
  if (policy.policy == policy::kExternalPolicy) {
    value.Fail("your own policy process requires one task on one bus: use 'evalbus run' with --policy lcm");
  }
  if (policy.name.empty()) policy.name = DefaultName(policy.policy);
  if (policy.name.empty()) value.Fail("expected 'name', because the policy is the address of a server");
  if (const std::string problem = ProblemOfPolicyName(policy.name); !problem.empty()) value.Fail(problem);
  try {
    policy::PolicyOptions options{.policy = policy.policy, .contract = policy.contract};
    if (!policy.latency.empty()) options.latency = policy.latency;
    if (!policy.execution.empty() && !policy.latency.empty()) options.execution = policy.execution;
    policy::FindPolicy(options);
  } catch (const InputError& error) {
    value.Fail(error.what());
  }
  return policy;
}

PlannedVideos ReadVideos(const YamlValue& value) {
  PlannedVideos videos;
  videos.cameras = {viz::kDefaultCamera};
  videos.where = value.Where();
  const auto which = [&](const YamlValue& episodes) {
    const std::string text = episodes.Text();
    int first = 0, end = 0;
    if (text == "none") {
      videos.which = PlannedVideos::Which::kNone;
    } else if (text == "all") {
      videos.which = PlannedVideos::Which::kAll;
    } else if (text == "failures") {
      videos.which = PlannedVideos::Which::kFailures;
    } else if (std::sscanf(text.c_str(), "first %9d%n", &first, &end) == 1 &&
               end == static_cast<int>(text.size()) && first > 0) {
      videos.which = PlannedVideos::Which::kFirst;
      videos.first = first;
    } else {
      episodes.Fail("expected none, all, failures or 'first N', got '" + text + "'");
    }
  };
  if (value.is_scalar()) {
    which(value);
  } else {
    const YamlMap map(value, {"episodes"}, {"cameras"});
    which(map["episodes"]);
    if (const YamlValue* cameras = map.Find("cameras")) {
      videos.cameras = cameras->Texts();
      videos.where = cameras->Where();
    }
    if (videos.cameras.empty()) map.Find("cameras")->Fail("expected at least one camera");
  }
  if (videos.which == PlannedVideos::Which::kNone) videos.cameras.clear();
  return videos;
}

// Parses a rule such as "decided(alpha 0.05, max 200)".
Until ReadUntil(const YamlValue& value, int least) {
  Until until;
  const std::string text = value.Text();
  int end = 0;
  double width = 0;
  const auto is_whole = [&] { return end == static_cast<int>(text.size()); };
  const auto check_width = [&] {
    if (!(width > 0 && width < 1)) value.Fail("expected a width above 0 and below 1, of a rate from 0 to 1");
    until.width = width;
  };
  if (std::sscanf(text.c_str(), "width(%lf, max %9d)%n", &width, &until.max_episodes, &end) == 2 &&
      is_whole()) {
    check_width();
  } else if (std::sscanf(text.c_str(), "width(%lf)%n", &width, &end) == 1 && is_whole()) {
    check_width();
    const int needed = metrics::TrialsForWidth(width, kMaxEpisodes);
    if (needed > kMaxEpisodes)
      value.Fail(
          fmt::format("this width requires more than {} episodes; expected a larger width", kMaxEpisodes));
    until.max_episodes = std::max(needed, least);
  } else if (std::sscanf(text.c_str(), "decided(alpha %lf, max %9d, on progress)%n", &until.alpha,
                         &until.max_episodes, &end) == 2 &&
             is_whole()) {
    until.on_progress = true;
  } else if (std::sscanf(text.c_str(), "decided(alpha %lf, max %9d)%n", &until.alpha, &until.max_episodes,
                         &end) != 2 ||
             !is_whole()) {
    value.Fail(
        "expected decided(alpha A, max N), decided(alpha A, max N, on progress), width(W) or "
        "width(W, max N), with error probability A, interval width W and at most N episodes, for example "
        "decided(alpha 0.05, max 200), got '" +
        text + "'");
  }
  if (!(until.alpha > 0 && until.alpha <= kMaxAlpha)) value.Fail("expected alpha above 0 and at most 0.5");
  if (until.max_episodes < least || until.max_episodes > kMaxEpisodes) {
    value.Fail(fmt::format("expected max {} to {}, because the first 'episodes' episodes are always run",
                           least, kMaxEpisodes));
  }
  return until;
}

// Optional keys of a plan's file.
constexpr std::array kPlanKeys = {"plan",  "episodes", "seed",  "options",
                                  "video", "compare",  "until", "shard_episodes"};

// Reads the options, keyed by their names in run.json.
void ReadRunOptions(const YamlValue& value, Plan* plan) {
  runner::RunOptions* const options = &plan->options;
  std::vector<std::string> known;
  ForEachOption(*options, [&](const auto& row, const auto&) {
    if (!row.help.empty() && IsOption(row.key)) known.emplace_back(row.key);
  });
  for (const YamlValue& entry : value.Entries()) {
    if (std::ranges::find(known, entry.key()) == known.end()) {
      if (std::ranges::find(kPlanKeys, entry.key()) != kPlanKeys.end())
        entry.Fail("is a key of the plan itself: write it beside 'options', not in it");
      entry.Fail("not an option of runs in a plan" + Suggestion(entry.key(), known));
    }
    plan->rate_is_given |= entry.key() == "control_hz";
    plan->timeout_is_given |= entry.key() == "policy_timeout_s";
    ForEachOption(*options, [&](const auto& row, auto& option) {
      if (entry.key() != row.key) return;
      using Value = std::decay_t<decltype(option)>;
      const NumberRange range{.min = row.range.least, .max = row.range.most};
      if constexpr (std::is_same_v<Value, bool>) {
        option = entry.Bool();
      } else if constexpr (std::is_same_v<Value, double>) {
        option = entry.Number(range);
      } else if constexpr (std::is_same_v<Value, std::string>) {
        option = entry.Text();
      } else if constexpr (std::is_same_v<Value, std::vector<std::string>>) {
        option = entry.Texts();
      } else if constexpr (std::is_same_v<Value, std::vector<fs::path>>) {
        option.clear();
        for (const std::string& path : entry.Texts()) option.emplace_back(path);
      } else {
        entry.Fail("not an option of runs in a plan");
      }
    });
  }
}

// Returns a member of plan.json; throws InputError if it is missing or has the wrong type.
template <class T>
T Get(const nlohmann::json& json, const char* key, const std::string& file) {
  try {
    return json.at(key).get<T>();
  } catch (const nlohmann::json::exception&) {
    throw InputError(
        fmt::format("{}: \"{}\" is missing or has another type; was this made by evalbus?", file, key));
  }
}

constexpr const char* kWhichVideos[] = {"none", "all", "failures", "first"};

// Throws InputError unless the values in plan.json are valid.
void CheckPlan(const Plan& plan, const std::string& file) {
  const auto check = [&](bool good, const std::string& what) {
    if (!good) throw InputError(file + ": " + what);
  };
  std::set<std::string> names, folders;
  for (const PlannedPolicy& policy : plan.policies) {
    const std::string problem = ProblemOfPolicyName(policy.name);
    check(problem.empty(), "\"policies\": " + problem);
    check(names.insert(policy.name).second, "\"policies\": two policies have the name '" + policy.name + "'");
  }
  check(!names.empty(), "\"policies\": expected at least one policy");
  for (const std::string& task : plan.tasks) {
    const std::string folder = FolderOfTask(task);
    check(!folder.empty() && folder != "." && folder != "..",
          "\"tasks\": expected a task, got '" + OneLine(task) + "'");
    check(folders.insert(folder).second, "\"tasks\": '" + OneLine(task) + "' is given twice");
  }
  check(!folders.empty(), "\"tasks\": expected at least one task");
  check(names.contains(plan.baseline),
        "\"baseline\": no policy '" + OneLine(plan.baseline) + "' in this plan");
  const auto check_count = [&](const char* key, int value, int least) {
    check(value >= least && value <= kMaxEpisodes,
          fmt::format("\"{}\" is {}, expected {} to {}", key, value, least, kMaxEpisodes));
  };
  check_count("shard_episodes", plan.shard_episodes, 1);
  if (!plan.until) return;
  check_count("max_episodes", plan.until->max_episodes, plan.options.episodes);
  const auto check_share = [&](const char* key, double value, double most) {
    check(value > 0 && value <= most,
          fmt::format("\"{}\" is {:g}, expected a number above 0 and at most {:g}", key, value, most));
  };
  check_share("alpha", plan.until->alpha, kMaxAlpha);
  if (plan.until->width) check_share("width", *plan.until->width, 1);
}

// Throws InputError if policies would run at different control rates, because their results could not be
// compared.
void CheckRates(const Plan& plan, const YamlValue& policies) {
  std::map<double, std::string> names;
  for (const PlannedPolicy& policy : plan.policies)
    names.emplace(plan.OptionsOf(policy).sim.control_hz, policy.name);
  if (names.size() < 2) return;
  const auto& [low, first] = *names.begin();
  const auto& [high, second] = *std::next(names.begin());
  policies.Fail(
      fmt::format("'{}' would run at {:g} Hz and '{}' at {:g} Hz, so they cannot be compared; set the "
                  "rate of all, for example 'options: {{control_hz: {:g}}}'",
                  first, low, second, high, low));
}

}  // namespace

bool IsPlanFile(const std::string& name) {
  if (!IsTaskFile(name) || !fs::exists(name)) return false;
  try {
    const YamlValue value = ParseYaml(ReadInput(name, "plan"), name);
    return value.is_map() && std::ranges::any_of(value.Entries(), [](const YamlValue& entry) {
             return entry.key() == "policies";
           });
  } catch (const InputError&) {
    // ReadPlan() or the reader of task files reports the error.
    return false;
  }
}

std::string Until::Text() const {
  if (width) return fmt::format("width({:g}, max {})", *width, max_episodes);
  return fmt::format("decided(alpha {:g}, max {}{})", alpha, max_episodes,
                     on_progress ? ", on progress" : "");
}

runner::RunOptions Plan::OptionsOf(const PlannedPolicy& policy) const {
  runner::RunOptions result = options;
  result.policy.policy = policy.policy;
  result.policy.contract = policy.contract;
  if (!policy.latency.empty()) result.policy.latency = policy.latency;
  if (!policy.execution.empty()) result.policy.execution = policy.execution;
  result.policy_name = policy.name;
  if (until) result.until = until->Text();
  runner::FollowContract(rate_is_given, timeout_is_given, &result);
  return result;
}

std::vector<std::string> Plan::Servers() const {
  std::vector<std::string> servers;
  for (const PlannedPolicy& policy : policies) {
    const auto contract = policy::FindContractOf(OptionsOf(policy).policy);
    if (contract && std::ranges::find(servers, contract->url) == servers.end())
      servers.push_back(contract->url);
  }
  return servers;
}

Plan ReadPlan(const fs::path& file) {
  const YamlMap map(ParseYaml(ReadInput(file, "plan"), file.string()), {"policies", "tasks"},
                    {kPlanKeys.begin(), kPlanKeys.end()});
  Plan plan;
  plan.name = file.stem().string();
  if (const YamlValue* name = map.Find("plan")) plan.name = name->Text();
  std::set<std::string> names;
  // All invalid policies and tasks are reported together.
  std::vector<std::string> mistakes;
  const auto collect = [&](const auto& read) {
    try {
      read();
    } catch (const InputError& error) {
      mistakes.emplace_back(error.what());
    }
  };
  for (const YamlValue& value : map["policies"].List()) {
    collect([&] {
      plan.policies.push_back(ReadPolicy(value, file));
      const std::string& name = plan.policies.back().name;
      if (!names.insert(name).second)
        value.Fail("two policies have the name '" + name + "'; give each its own 'name'");
    });
  }
  if (plan.policies.empty() && mistakes.empty()) map["policies"].Fail("expected at least one policy");
  const YamlValue& tasks = map["tasks"];
  plan.tasks_where = tasks.Where();
  std::vector<std::string> asked = tasks.is_list() ? tasks.Texts() : std::vector{tasks.Text()};
  for (std::string& task : asked) task = FromPlan(task, file);
  collect([&] {
    try {
      plan.tasks = runner::ExpandTasks(asked);
    } catch (const InputError& error) {
      tasks.Fail(error.what());
    }
    if (plan.tasks.empty()) tasks.Fail("expected at least one task");
  });
  if (!mistakes.empty()) throw InputError(fmt::format("{}", fmt::join(mistakes, "; ")));
  if (const YamlValue* value = map.Find("episodes")) plan.options.episodes = value->Integer(1, kMaxEpisodes);
  if (const YamlValue* value = map.Find("seed")) plan.options.seed = value->Int64();
  if (const YamlValue* value = map.Find("options")) ReadRunOptions(*value, &plan);
  // Absolute, as in run.json, because a merge compares the two.
  plan.options.sim.assets = AbsoluteAssets(plan.options.sim.assets);
  std::string& limits = plan.options.sim.limits;
  if (const fs::path beside = fs::absolute(file).parent_path() / limits;
      !limits.empty() && fs::exists(beside))
    limits = beside.lexically_normal().string();
  CheckRates(plan, map["policies"]);
  if (const YamlValue* value = map.Find("video")) plan.videos = ReadVideos(*value);
  if (const YamlValue* value = map.Find("shard_episodes"))
    plan.shard_episodes = value->Integer(1, kMaxEpisodes);
  plan.baseline = plan.policies[0].name;
  if (const YamlValue* value = map.Find("compare")) {
    const YamlMap compare(*value, {"baseline"});
    const YamlValue& baseline = compare["baseline"];
    plan.baseline = baseline.Text();
    if (!names.contains(plan.baseline)) {
      baseline.Fail("no policy '" + plan.baseline + "' in this plan" +
                    Suggestion(plan.baseline, {names.begin(), names.end()}));
    }
  }
  if (const YamlValue* value = map.Find("until")) {
    plan.until = ReadUntil(*value, plan.options.episodes);
    if (plan.policies.size() < 2 && !plan.until->width)
      value->Fail("expected at least two policies, because 'until: decided' compares them");
  }
  const std::string engine =
      plan.options.sim.engine.empty() ? "" : runner::FindEngine(plan.options.sim.engine, "engine");
  return OnEngine(std::move(plan), engine);
}

Plan MakePlan(const std::string& name, const std::vector<std::string>& policies,
              const runner::RunOptions& options, bool rate_is_given) {
  Plan plan;
  plan.name = name;
  for (const std::string& policy : policies) {
    const PlannedPolicy planned{DefaultName(policy), policy, "", "", ""};
    if (planned.name.empty()) {
      throw InputError("--policies " + policy +
                       ": a policy server requires a name: list it in a plan file (docs/plans.md)");
    }
    if (const std::string problem = ProblemOfPolicyName(planned.name); !problem.empty())
      throw InputError("--policies " + policy + ": " + problem);
    if (std::ranges::find(plan.policies, planned.name, &PlannedPolicy::name) != plan.policies.end()) {
      throw InputError("--policies: two policies have the name '" + planned.name + "'");
    }
    plan.policies.push_back(planned);
  }
  if (plan.policies.empty()) throw InputError("--policies: expected at least one policy");
  plan.tasks = runner::ExpandTasks(options.tasks);
  plan.options = options;
  plan.rate_is_given = rate_is_given;
  plan.baseline = plan.policies[0].name;
  // These options belong to a single command and are not part of the plan.
  plan.options.workers = 1;
  plan.options.out.clear();
  plan.options.tasks.clear();
  plan.options.resume = false;
  return OnEngine(std::move(plan), "");
}

Plan OnEngine(Plan plan, const std::string& engine) {
  plan.options.sim.engine = engine;
  // In-process runs require no network, are the fastest, and have bit-identical results. Another version of
  // MuJoCo requires a separate process.
  plan.options.in_process = engine.empty();
  plan.options.sim.limits = sim::AbsoluteLimits(plan.options.sim.limits);
  if (!plan.options.sim.robot.empty()) FindRobot(plan.options.sim.robot);  // throws if there is none
  for (const PlannedPolicy& policy : plan.policies)
    runner::CheckRunOptions(plan.OptionsOf(policy), plan.tasks.size());
  return plan;
}

ordered_json PlanJson(const Plan& plan) {
  ordered_json json = {{"plan", plan.name}};
  for (const PlannedPolicy& policy : plan.policies) {
    json["policies"].push_back(
        {{"name", policy.name}, {"policy", policy.policy}, {"contract", policy.contract}});
    if (!policy.latency.empty()) json["policies"].back()["latency"] = policy.latency;
    if (!policy.execution.empty()) json["policies"].back()["execution"] = policy.execution;
  }
  json["tasks"] = plan.tasks;
  json["baseline"] = plan.baseline;
  json["video"] = {{"episodes", kWhichVideos[static_cast<int>(plan.videos.which)]},
                   {"first", plan.videos.first},
                   {"cameras", plan.videos.cameras}};
  json["until"] = nullptr;
  if (plan.until) {
    json["until"] = {{"alpha", plan.until->alpha}, {"max_episodes", plan.until->max_episodes}};
    if (plan.until->on_progress) json["until"]["on_progress"] = true;
    if (plan.until->width) json["until"]["width"] = *plan.until->width;
  }
  json["shard_episodes"] = plan.shard_episodes;
  json["rate_is_given"] = plan.rate_is_given;
  json["timeout_is_given"] = plan.timeout_is_given;
  json["options"] = OptionsJson(plan.options);
  return json;
}

Plan PlanOfJson(const nlohmann::json& json, const std::string& file) {
  Plan plan;
  plan.name = Get<std::string>(json, "plan", file);
  for (const auto& policy : Get<nlohmann::json>(json, "policies", file)) {
    plan.policies.push_back({Get<std::string>(policy, "name", file), Get<std::string>(policy, "policy", file),
                             Get<std::string>(policy, "contract", file),
                             policy.contains("latency") ? Get<std::string>(policy, "latency", file) : "",
                             policy.contains("execution") ? Get<std::string>(policy, "execution", file) : "",
                             file + ": \"policies\": "});
  }
  plan.tasks = Get<std::vector<std::string>>(json, "tasks", file);
  plan.tasks_where = file + ": \"tasks\": ";
  plan.baseline = Get<std::string>(json, "baseline", file);
  const auto videos = Get<nlohmann::json>(json, "video", file);
  const auto which = std::ranges::find(kWhichVideos, Get<std::string>(videos, "episodes", file));
  if (which == std::end(kWhichVideos))
    throw InputError(file + ": \"video\": expected \"episodes\" of none, all, failures or first");
  plan.videos = {static_cast<PlannedVideos::Which>(which - std::begin(kWhichVideos)),
                 Get<int>(videos, "first", file), Get<std::vector<std::string>>(videos, "cameras", file),
                 file + ": \"video\": "};
  if (const auto until = Get<nlohmann::json>(json, "until", file); !until.is_null()) {
    plan.until = {.alpha = Get<double>(until, "alpha", file),
                  .max_episodes = Get<int>(until, "max_episodes", file),
                  .on_progress = until.contains("on_progress") && Get<bool>(until, "on_progress", file)};
    if (until.contains("width")) plan.until->width = Get<double>(until, "width", file);
  }
  plan.shard_episodes = Get<int>(json, "shard_episodes", file);
  plan.rate_is_given = Get<bool>(json, "rate_is_given", file);
  plan.timeout_is_given = Get<bool>(json, "timeout_is_given", file);
  runner::ReadOlderOptions(Get<nlohmann::json>(json, "options", file), file, &plan.options);
  CheckPlan(plan, file);
  return plan;
}

std::string VideosText(const PlannedVideos& videos) {
  using Which = PlannedVideos::Which;
  const std::string which = videos.which == Which::kNone  ? "none"
                            : videos.which == Which::kAll ? "all episodes"
                            : videos.which == Which::kFailures
                                ? "failures"
                                : fmt::format("the first {} of each run", videos.first);
  return videos.cameras.empty() ? which : fmt::format("{}, from {}", which, fmt::join(videos.cameras, ", "));
}

}  // namespace evalbus::plans
