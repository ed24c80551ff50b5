#include "plans/plan.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <numeric>

#include "base/errors.h"
#include "metrics/statistics/confidence_sequence.h"
#include "models/task_description.h"
#include "plans/latency.h"
#include "plans/plan_check.h"
#include "plans/plan_folder.h"
#include "plans/slurm.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::plans::plan_test {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::StrEq;
using testing::ThrowsMessage;

class PlanTest : public testing::Test {
 protected:
  Plan Read(const std::string& text) {
    std::ofstream(file_) << text;
    return ReadPlan(file_);
  }
  // Returns the part of the error after the file's name.
  std::string ErrorOf(const std::string& text) {
    try {
      Read(text);
    } catch (const InputError& error) {
      const std::string what = error.what();
      const std::string name = file_.string();
      return what.starts_with(name) ? what.substr(name.size()) : what;
    }
    return "(no error)";
  }

  TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_.path() / "my_plan.yaml";
};

constexpr char kSmall[] = "policies: [expert]\ntasks: lift_pot\n";

TEST(PlanFolder, HiddenNamesContainTheirShard) {
  const Shard shard{"pi0.5", "lift_pot/all", 0, 19};
  using Pair = std::pair<std::string, std::string>;
  EXPECT_EQ(ParseHidden("." + shard.name() + ".node7.lab-4711.coming"),
            Pair(shard.name(), "node7.lab-4711.coming"));
  EXPECT_EQ(ParseHidden("." + shard.name() + ".failed"), Pair(shard.name(), "failed"));
  EXPECT_EQ(ParseHidden(shard.name()), Pair());
  EXPECT_EQ(ParseHidden(".nfs0001"), Pair());
}

TEST_F(PlanTest, PrintsWhatWillBeRun) {
  const Plan plan = Read(R"(plan: checkpoints
policies:
  - expert
  - {name: shaky, policy: noisy_expert}
  - {name: pi0, policy: "ws://127.0.0.1:8000", contract: roboeval}
tasks: [lift_pot/position, LiftPotOrientation]
episodes: 30
seed: 4
options: {after_success_s: 1, control_hz: 20}
video: {episodes: first 3, cameras: [overview, head]}
compare: {baseline: shaky}
until: decided(alpha 0.01, max 200)
)");
  EXPECT_EQ(plan.name, "checkpoints");
  EXPECT_THAT(plan.tasks, ElementsAre("lift_pot/position", "lift_pot/orientation"));
  ASSERT_EQ(plan.policies.size(), 3u);
  EXPECT_EQ(plan.policies[0].name, "expert");
  EXPECT_EQ(plan.policies[1].policy, "noisy_expert");
  EXPECT_EQ(plan.num_runs(), 6);
  EXPECT_EQ(plan.baseline, "shaky");
  EXPECT_EQ(plan.options.episodes, 30);
  EXPECT_EQ(plan.options.seed, 4);
  EXPECT_EQ(plan.options.sim.after_success_s, 1);
  EXPECT_TRUE(plan.options.in_process);
  EXPECT_EQ(VideosText(plan.videos), "the first 3 of each run, from overview, head");
  ASSERT_TRUE(plan.until);
  EXPECT_EQ(plan.until->alpha, 0.01);
  EXPECT_EQ(plan.until->max_episodes, 200);
  for (const PlannedPolicy& policy : plan.policies) EXPECT_EQ(plan.OptionsOf(policy).sim.control_hz, 20);
  EXPECT_EQ(plan.OptionsOf(plan.policies[2]).policy_name, "pi0");
}

TEST_F(PlanTest, TheSeedMayHave64Bits) {
  EXPECT_EQ(Read(std::string(kSmall) + "seed: 5000000000\n").options.seed, 5'000'000'000);
  EXPECT_EQ(ErrorOf(std::string(kSmall) + "seed: 9223372036854775808\n"),
            ":3: key 'seed': expected a whole number of at most 64 bits, got '9223372036854775808'");
}

TEST_F(PlanTest, ARateThatThePlanNamesGoesBeforeTheContracts) {
  const Plan plan = Read(
      "policies: [{name: a, policy: 'ws://127.0.0.1:1', contract: roboeval}]\n"
      "tasks: lift_pot\noptions: {control_hz: 50}\n");
  EXPECT_EQ(plan.OptionsOf(plan.policies[0]).sim.control_hz, 50);
}

TEST_F(PlanTest, DifferentRatesAreRefused) {
  const std::string pi0 = "{name: pi0, policy: 'ws://127.0.0.1:1', contract: roboeval}";
  const Plan plan = Read("policies: [" + pi0 + "]\ntasks: lift_pot\n");
  EXPECT_EQ(plan.OptionsOf(plan.policies[0]).sim.control_hz, 20);
  EXPECT_THAT(
      ErrorOf("policies: [expert, " + pi0 + "]\ntasks: lift_pot\n"),
      HasSubstr(":1: key 'policies': 'pi0' would run at 20 Hz and 'expert' at 50 Hz, so they cannot be "
                "compared; set the rate of all, for example 'options: {control_hz: 20}'"));
}

// Another version of MuJoCo requires its own process. A version that is not built is reported before anything
// runs.
TEST_F(PlanTest, RunsOfAnotherEngineAreProcesses) {
  EXPECT_TRUE(Read(kSmall).options.in_process);
  const Plan plan = OnEngine(Read(kSmall), "9.3.9");
  EXPECT_FALSE(plan.options.in_process);
  EXPECT_EQ(plan.OptionsOf(plan.policies[0]).sim.engine, "9.3.9");
  EXPECT_THAT(ErrorOf(std::string(kSmall) + "options: {engine: 7.7.7}\n"),
              HasSubstr("engine 7.7.7: not built; 'scripts/engine 7.7.7' builds it"));
}

TEST_F(PlanTest, MadeFromOptionsHasTheirPolicies) {
  runner::RunOptions options;
  options.tasks = {"lift_pot/position"};
  options.workers = 4;
  options.episodes = 3;
  const Plan plan = MakePlan("certify", {"expert", "noisy_expert:0.1"}, options, false);
  EXPECT_THAT(plan.tasks, ElementsAre("lift_pot/position"));
  EXPECT_EQ(plan.policies[1].name, "noisy_expert-0.1");
  EXPECT_EQ(plan.policies[1].policy, "noisy_expert:0.1");
  EXPECT_EQ(plan.options.episodes, 3);
  // The number of workers may differ when the plan is resumed.
  EXPECT_EQ(plan.options.workers, 1);
  const auto make = [&](const std::vector<std::string>& policies) {
    return MakePlan("certify", policies, options, false);
  };
  EXPECT_THROW(make({}), InputError);
  EXPECT_THROW(make({"expert", "expert"}), InputError);
  EXPECT_THROW(make({"ws://127.0.0.1:8000"}), InputError);
  EXPECT_THROW(make({"nonsense"}), InputError);
  options.sim.robot = "nonsense";
  EXPECT_THROW(make({"expert"}), InputError);
}

TEST_F(PlanTest, StopsAtAWidthOrByProgress) {
  const Plan narrow = Read(std::string(kSmall) + "until: width(0.1, max 2000)\n");
  EXPECT_EQ(narrow.until->width, 0.1);
  EXPECT_EQ(narrow.until->max_episodes, 2000);
  EXPECT_EQ(narrow.until->Text(), "width(0.1, max 2000)");
  // Without a maximum, the number is what the width requires at a success rate of one half.
  const Plan sure = Read(std::string(kSmall) + "until: width(0.1)\n");
  EXPECT_EQ(sure.until->width, 0.1);
  EXPECT_EQ(sure.until->max_episodes, metrics::TrialsForWidth(0.1, 10'000));
  for (const std::string width : {"1e-5", "1e-9", "1e-300"}) {
    EXPECT_THAT(ErrorOf(std::string(kSmall) + "until: width(" + width + ")\n"),
                HasSubstr("expected a larger width"));
  }
  const Plan progress =
      Read("policies: [expert, hold]\ntasks: lift_pot\nuntil: decided(alpha 0.05, max 90, on progress)\n");
  EXPECT_TRUE(progress.until->on_progress);
  EXPECT_EQ(progress.until->Text(), "decided(alpha 0.05, max 90, on progress)");
  EXPECT_THAT(ErrorOf(std::string(kSmall) + "until: width(10, max 2000)\n"), HasSubstr("expected a width"));
}

TEST_F(PlanTest, PoliciesMayDifferInTheirDelay) {
  const Plan plan = Read(
      "policies:\n  - expert\n  - {name: late, policy: expert, latency: 200, execution: asynchronous}\n"
      "tasks: lift_pot\n");
  EXPECT_EQ(plan.OptionsOf(plan.policies[0]).policy.latency, "none");
  EXPECT_EQ(plan.OptionsOf(plan.policies[1]).policy.latency, "200");
  EXPECT_EQ(plan.OptionsOf(plan.policies[1]).policy.execution, "asynchronous");
  EXPECT_THAT(ErrorOf("policies: [{policy: expert, latency: long}]\ntasks: lift_pot\n"),
              HasSubstr("expected none, measured or milliseconds"));
}

TEST_F(PlanTest, OfALatencyCurveHasAnEntryForEachDelay) {
  runner::RunOptions options;
  options.tasks = {"lift_pot/position"};
  options.workers = 2;
  const Plan plan = LatencyPlan(options, {"0", "100"}, {"synchronous", "rtc"}, false);
  ASSERT_EQ(plan.policies.size(), 4u);
  // A plan that is resumed with a different number of workers is the same plan.
  EXPECT_EQ(plan.options.workers, 1);
  EXPECT_EQ(plan.policies[3].name, "rtc-100ms");
  EXPECT_EQ(plan.OptionsOf(plan.policies[3]).policy.latency, "100");
  EXPECT_EQ(plan.OptionsOf(plan.policies[3]).policy.execution, "rtc");
  for (const char* wrong : {"none", "x", "-1", "60001"}) {
    EXPECT_THAT(
        [&] {
          LatencyPlan(options, {"0", wrong}, {"rtc"}, false);
        },
        ThrowsMessage<InputError>(
            StrEq("--delays: expected milliseconds (0 to 60000), got '" + std::string(wrong) + "'")));
  }
  EXPECT_THROW(LatencyPlan(options, {"0", "0.0"}, {"rtc"}, false), InputError);
  // A scripted policy has equal results with rtc and asynchronous.
  const Plan scripted = LatencyPlan(options, {"0"}, {"rtc", "asynchronous"}, false);
  ASSERT_EQ(scripted.policies.size(), 1u);
  EXPECT_EQ(scripted.policies[0].name, "asynchronous-0ms");
  // At 20 Hz, 120 ms is rounded up to 150 ms, which is three ticks.
  options.sim.control_hz = 20;
  const Plan rounded = LatencyPlan(options, {"100", "120", "150"}, {"synchronous", "rtc"}, true);
  ASSERT_EQ(rounded.policies.size(), 4u);
  EXPECT_EQ(rounded.policies[1].name, "synchronous-120ms");
  EXPECT_EQ(rounded.policies[2].name, "rtc-100ms");
  // 60 Hz are rounded to 8 physics steps of 2 ms: 17 and 33 ms are two and three ticks.
  options.sim.control_hz = 60;
  EXPECT_EQ(LatencyPlan(options, {"17", "33"}, {"synchronous"}, true).policies.size(), 2u);
  options.tasks = {"lift_pot/all"};
  EXPECT_THROW(LatencyPlan(options, {"0"}, {"rtc"}, false), InputError);
}

TEST_F(PlanTest, IsKeptAsJsonAndReadBack) {
  for (const char* text : {kSmall,
                           "policies: [expert, hold]\ntasks: lift_pot/all\nvideo: failures\n"
                           "until: decided(alpha 0.05, max 90)\nshard_episodes: 7\n",
                           "policies: [expert, hold]\ntasks: lift_pot/all\n"
                           "until: decided(alpha 0.05, max 90, on progress)\n",
                           "policies: [{policy: expert, latency: 100, execution: rtc}]\ntasks: lift_pot\n"
                           "until: width(0.1, max 90)\n"}) {
    const Plan plan = Read(text);
    const auto json = PlanJson(plan);
    EXPECT_EQ(PlanJson(PlanOfJson(nlohmann::json::parse(json.dump()), "plan.json")), json);
  }
}

TEST_F(PlanTest, PlanJsonThatCannotBeOfAPlanIsRefused) {
  const nlohmann::json good = nlohmann::json::parse(
      PlanJson(Read("policies: [expert, hold]\ntasks: lift_pot\nuntil: width(0.1, max 90)\n")).dump());
  const auto error_of = [&](const char* pointer, const nlohmann::json& value) -> std::string {
    nlohmann::json changed = good;
    changed[nlohmann::json::json_pointer(pointer)] = value;
    try {
      PlanOfJson(changed, "plan.json");
    } catch (const InputError& error) {
      return error.what();
    }
    return "(no error)";
  };
  // A shard without episodes would never complete the plan.
  for (const int size : {0, -1}) {
    EXPECT_EQ(error_of("/shard_episodes", size),
              fmt::format("plan.json: \"shard_episodes\" is {}, expected 1 to 10000000", size));
  }
  EXPECT_THAT(error_of("/baseline", "unknown"), HasSubstr("plan.json: \"baseline\": no policy 'unknown'"));
  EXPECT_THAT(error_of("/policies", nlohmann::json::array()), HasSubstr("expected at least one policy"));
  EXPECT_THAT(error_of("/policies/1/name", "../../x"),
              HasSubstr("expected a name that is valid for a folder"));
  EXPECT_THAT(error_of("/policies/1/name", "expert"), HasSubstr("two policies have the name 'expert'"));
  EXPECT_THAT(error_of("/policies/1/latency", 100), HasSubstr("\"latency\" is missing or has another type"));
  EXPECT_THAT(error_of("/tasks", nlohmann::json::array()), HasSubstr("expected at least one task"));
  EXPECT_THAT(error_of("/tasks/0", ".."), HasSubstr("\"tasks\": expected a task, got '..'"));
  EXPECT_THAT(error_of("/video/episodes", "some"), HasSubstr("of none, all, failures or first"));
  EXPECT_THAT(error_of("/until/max_episodes", -5), HasSubstr("\"max_episodes\" is -5, expected "));
  EXPECT_THAT(error_of("/until/alpha", 0), HasSubstr("\"alpha\" is 0, expected "));
  EXPECT_THAT(error_of("/until/width", 7), HasSubstr("\"width\" is 7, expected "));
}

TEST_F(PlanTest, PathsAreRelativeToThePlan) {
  const auto copy = folder_.path() / "my_pot.yaml";
  std::filesystem::copy_file(ModelsFolder() / "tasks/lift_pot.yaml", copy);
  const Plan plan = Read("policies: [expert]\ntasks: [my_pot.yaml, my_pot.yaml/position]\n");
  EXPECT_THAT(plan.tasks, ElementsAre(copy.string(), (copy / "position").string()));
}

TEST_F(PlanTest, ForceLimitsAreRelativeToThePlanAndAbsolute) {
  const std::string with_limits = std::string(kSmall) + "options: {limits: my_limits.yaml}\n";
  EXPECT_EQ(Read(with_limits).options.sim.limits, std::filesystem::absolute("my_limits.yaml"));
  const auto limits = folder_.path() / "my_limits.yaml";
  std::ofstream(limits) << "limits: {pot: {bodies: [pot], grip_force_N: 1}}\n";
  EXPECT_EQ(Read(with_limits).options.sim.limits, limits);
  runner::RunOptions options;
  options.tasks = {"lift_pot/position"};
  options.sim.limits = "my_limits.yaml";
  EXPECT_EQ(MakePlan("certify", {"hold"}, options, false).options.sim.limits,
            std::filesystem::absolute("my_limits.yaml"));
}

TEST_F(PlanTest, AssetsAreFoldersWithAbsolutePaths) {
  const auto folder = folder_.path() / "checkout";
  const std::string with_assets =
      std::string(kSmall) + "options: {assets: [\"roboeval=" + folder.string() + "/\"]}\n";
  EXPECT_THAT(ErrorOf(with_assets), HasSubstr("is not a folder"));
  std::filesystem::create_directories(folder);
  EXPECT_THAT(Read(with_assets).options.sim.assets, ElementsAre("roboeval=" + folder.string() + "/"));
  const std::string beside = std::string(kSmall) + "options: {assets: [roboeval=.]}\n";
  EXPECT_THAT(Read(beside).options.sim.assets,
              ElementsAre("roboeval=" + std::filesystem::absolute(".").lexically_normal().string()));
}

TEST_F(PlanTest, APolicyIsNotNamedAsAFileOfThePlan) {
  for (const char* name : {"plan.json", "parts", "slurm", "stops.json", "report.html", "manifest.json"}) {
    EXPECT_THAT(ErrorOf(fmt::format("policies: [{{name: {}, policy: hold}}]\ntasks: lift_pot\n", name)),
                HasSubstr(fmt::format("a policy cannot be named '{}'", name)));
  }
}

TEST_F(PlanTest, AFolderIsNotChangedByALook) {
  const Plan plan = Read(kSmall);
  const auto out = folder_.path() / "out";
  const PlanFolder folder(plan, out);
  std::filesystem::remove(out / "parts");
  EXPECT_EQ(PlanFolder(plan, out, false).path(), folder.path());
  EXPECT_FALSE(std::filesystem::exists(out / "parts"));
}

TEST_F(PlanTest, SlurmScriptsHaveNoValueOfTwoLines) {
  const PlanFolder folder(Read(kSmall), folder_.path() / "two\nlines", false);
  try {
    WriteSlurmScripts(folder, {}, 1);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("--slurm: expected names without line breaks, got '"));
  }
}

TEST_F(PlanTest, IsDistinguishedFromATaskByItsPolicies) {
  Read(kSmall);
  EXPECT_TRUE(IsPlanFile(file_.string()));
  std::ofstream(file_) << "name: my_task\n";
  EXPECT_FALSE(IsPlanFile(file_.string()));
  EXPECT_FALSE(IsPlanFile("lift_pot"));
  EXPECT_FALSE(IsPlanFile((folder_.path() / "none.yaml").string()));
}

TEST_F(PlanTest, CamerasAndPoliciesAreCheckedInEachTask) {
  const Plan good = Read("policies: [hold, expert]\ntasks: lift_pot/position\nvideo: all\n");
  EXPECT_THAT(ProblemsOf(good), ElementsAre());
  EXPECT_NO_THROW(CheckScenes(good));

  const auto copy = folder_.path() / "my_pot.yaml";
  std::ifstream original(ModelsFolder() / "tasks/lift_pot.yaml");
  std::ofstream changed(copy);
  for (std::string line; std::getline(original, line);) {
    if (line == "name: lift_pot") line = "name: my_pot";
    if (const size_t above = line.find("../"); above != std::string::npos)
      line.replace(above, 2, ModelsFolder().string());
    changed << line << "\n";
  }
  changed.close();
  const Plan wrong = Read(
      "policies: [hold, expert]\ntasks: [lift_pot/position, my_pot.yaml/position]\n"
      "video: {episodes: all, cameras: [overviw]}\n");
  EXPECT_THAT(
      ProblemsOf(wrong),
      ElementsAre(file_.string() + ":3: key 'cameras': lift_pot/position and all other tasks: no camera "
                                   "'overviw'; did you mean 'overview'?",
                  testing::StartsWith(file_.string() + ":1: key 'policies[1]': expert on " +
                                      (copy / "position").string() +
                                      ": policy \"expert\": task \"my_pot\" has no expert; ")));
  EXPECT_THAT([&] { CheckScenes(wrong); }, ThrowsMessage<InputError>(HasSubstr("has no expert")));
}

TEST_F(PlanTest, NotesNameSettingsOfContractsWithoutEffect) {
  const auto contract = folder_.path() / "mine.yaml";
  std::filesystem::copy_file(ModelsFolder() / "policies/groot_bimanual_panda.yaml", contract);
  std::ofstream(contract, std::ios::app)
      << "prompts: {lift_pot: up, lift_tray: up, lift_pt: up, lift_pot/position: up}\n";
  const std::string start = "mine: " + contract.string() + ": ";
  EXPECT_THAT(
      NotesOf(Read("policies: [mine.yaml]\ntasks: lift_pot/position\n")),
      ElementsAre(
          start +
              "batch_size has no effect in a plan, whose runs each have their own connection to the server",
          start + "prompts: there is no task 'lift_pot/position'",
          start + "prompts: there is no task 'lift_pt'; did you mean 'lift_pot'?"));
  EXPECT_THAT(NotesOf(Read(kSmall)), ElementsAre());
}

TEST_F(PlanTest, MistakesAreReportedAtTheirLocation) {
  EXPECT_THAT(ErrorOf("policies: [expert]\ntask: lift_pot\n"),
              HasSubstr(":2: key 'task': unknown key here; did you mean 'tasks'?"));
  EXPECT_THAT(ErrorOf("policies: [expert]\ntasks: [lift_pots]\n"), HasSubstr(":2: key 'tasks': "));
  EXPECT_THAT(ErrorOf("policies: [expret]\ntasks: lift_pot\n"), HasSubstr(":1: "));
  EXPECT_THAT(ErrorOf("policies: [expret]\ntasks: lift_pot\n"), HasSubstr("expert"));
  // All errors are reported together.
  EXPECT_THAT(ErrorOf("policies:\n  - expret\n  - flawed_expert:slipp\ntasks: [lift_pots]\n"),
              testing::AllOf(HasSubstr(":2: "), HasSubstr("; did you mean 'expert'?; "), HasSubstr(":3: "),
                             HasSubstr("did you mean 'slip'?; "), HasSubstr(":4: key 'tasks': ")));
  EXPECT_THAT(ErrorOf("policies: [expert\ntasks: lift_pot\n"), HasSubstr("a '[' is not closed"));
  EXPECT_THAT(ErrorOf("policies: [expert, expert]\ntasks: lift_pot\n"),
              HasSubstr("two policies have the name 'expert'; give each its own 'name'"));
  EXPECT_THAT(ErrorOf("policies: ['ws://127.0.0.1:1']\ntasks: lift_pot\n"), HasSubstr(":1: "));
  EXPECT_THAT(ErrorOf("policies: [{name: ../a, policy: hold}]\ntasks: lift_pot\n"),
              HasSubstr("expected a name that is valid for a folder, got '../a'"));
  EXPECT_THAT(ErrorOf("policies: [lcm]\ntasks: lift_pot\n"), HasSubstr("your own policy process"));
  const std::string small = kSmall;
  EXPECT_THAT(ErrorOf(small + "episodes: 0\n"), HasSubstr(":3: key 'episodes': "));
  EXPECT_THAT(
      ErrorOf(small + "options: {control_hertz: 20}\n"),
      HasSubstr(":3: key 'control_hertz': not an option of runs in a plan; did you mean 'control_hz'?"));
  EXPECT_THAT(ErrorOf(small + "options: {seed: 5}\n"),
              HasSubstr(":3: key 'seed': is a key of the plan itself: write it beside 'options', not in it"));
  EXPECT_THAT(ErrorOf(small + "options: {workers: 2}\n"), HasSubstr("not an option of runs in a plan"));
  EXPECT_THAT(ErrorOf(small + "options: {control_hz: 5000}\n"), HasSubstr(":3: key 'control_hz': "));
  EXPECT_THAT(ErrorOf(small + "options: {realtime: maybe}\n"), HasSubstr(":3: key 'realtime': "));
  EXPECT_THAT(ErrorOf(small + "video: some\n"),
              HasSubstr("expected none, all, failures or 'first N', got 'some'"));
  EXPECT_THAT(ErrorOf(small + "compare: {baseline: hold}\n"), HasSubstr("no policy 'hold' in this plan"));
  for (const char* wrong : {"soon", "decided(alpha 0.05, max 4294967396)"}) {
    EXPECT_THAT(ErrorOf(small + "until: " + wrong + "\n"), HasSubstr("expected decided(alpha A, max N)"));
  }
  EXPECT_THAT(ErrorOf(small + "until: decided(alpha 0.05, max 200)\n"),
              HasSubstr("expected at least two policies"));
  EXPECT_THAT(
      ErrorOf(
          "policies: [expert, hold]\ntasks: lift_pot\nepisodes: 50\nuntil: decided(alpha 0.05, max 20)\n"),
      HasSubstr(":4: key 'until': expected max 50 to "));
}

TEST_F(PlanTest, ShardsAreEachEpisodeOnce) {
  const Plan plan = Read(
      "policies: [expert, hold]\ntasks: [lift_pot, stack_two_blocks]\nepisodes: 10\nshard_episodes: 4\n");
  const std::vector<Shard> shards = ShardsOf(plan);
  ASSERT_EQ(shards.size(), 12u);
  EXPECT_EQ(shards[0].name(), "expert+lift_pot-base+0000-0003");
  EXPECT_EQ(shards[2].name(), "expert+lift_pot-base+0008-0009");
  EXPECT_EQ(shards[2].size(), 2);
  EXPECT_EQ(
      std::accumulate(shards.begin(), shards.end(), 0, [](int n, const Shard& c) { return n + c.size(); }),
      40);
  std::vector<std::string> of_parts;
  for (int part = 1; part <= 5; ++part) {
    for (const Shard& shard : ShardsOfPart(shards, part, 5)) of_parts.push_back(shard.name());
  }
  std::vector<std::string> all;
  for (const Shard& shard : shards) all.push_back(shard.name());
  EXPECT_THAT(of_parts, testing::UnorderedElementsAreArray(all));
}

TEST_F(PlanTest, AFolderIsOfOnePlan) {
  const Plan plan = Read(kSmall);
  const auto out = folder_.path() / "out";
  const PlanFolder first(plan, out);
  const PlanFolder again(plan, out);
  EXPECT_EQ(PlanJson(PlanFolder(out).plan()), PlanJson(plan));
  try {
    PlanFolder(Read(std::string(kSmall) + "episodes: 7\n"), out);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(),
                HasSubstr("the plan in this folder differs: \"episodes\" is 10 there, not 7; choose another "
                          "folder, or undo the change"));
  }
  const auto of_server = [&](const std::string& port) {
    return Read("policies: [expert, {name: served, policy: 'ws://127.0.0.1:" + port +
                "', contract: roboeval}]\ntasks: lift_pot\noptions: {control_hz: 50}\n");
  };
  EXPECT_EQ(of_server("1").Servers(), std::vector<std::string>{"ws://127.0.0.1:1"});
  const PlanFolder served(of_server("1"), folder_.path() / "served");
  EXPECT_THAT([&] { PlanFolder(of_server("2"), folder_.path() / "served"); },
              ThrowsMessage<InputError>(HasSubstr("differs: \"policy\" of policy 'served' is "
                                                  "\"ws://127.0.0.1:1\" there, not \"ws://127.0.0.1:2\"; ")));
  const auto read_in = [&](const std::string& name) {
    const auto beside = folder_.path() / name;
    std::filesystem::create_directories(beside);
    std::filesystem::copy_file(ModelsFolder() / "tasks/lift_pot.yaml", beside / "my_pot.yaml");
    std::ofstream(beside / "plan.yaml") << "policies: [expert]\ntasks: [my_pot.yaml/position]\n";
    return ReadPlan(beside / "plan.yaml");
  };
  const auto before = folder_.path() / "before";
  const PlanFolder of_file(read_in("before"), folder_.path() / "of_file");
  const Plan moved = read_in("after");
  EXPECT_THAT(
      [&] { PlanFolder(moved, folder_.path() / "of_file"); },
      ThrowsMessage<InputError>(HasSubstr("; a task file is identified by its path: put 'my_pot.yaml' into " +
                                          before.string() + ", or evaluate the plan in another folder")));
  const auto taken = folder_.path() / "taken";
  std::filesystem::create_directories(taken / "thesis");
  EXPECT_THROW(PlanFolder(plan, taken), InputError);
  EXPECT_THROW(PlanFolder{taken}, InputError);
}

TEST_F(PlanTest, AShardThatIsPutTwiceIsThereOnce) {
  const PlanFolder folder(Read(kSmall), folder_.path() / "out");
  const Shard shard = ShardsOf(folder.plan())[0];
  const auto made = folder_.path() / "made";
  std::filesystem::create_directories(made / "episodes");
  std::ofstream(made / "run.json") << "first";
  EXPECT_FALSE(folder.has(shard));
  folder.Put(shard, made);
  EXPECT_TRUE(folder.has(shard));
  std::ofstream(made / "run.json") << "second";
  folder.Put(shard, made);
  std::ifstream stream(folder.shard_folder(shard) / "run.json");
  std::string text;
  stream >> text;
  EXPECT_EQ(text, "first");
  // No half-written file remains next to it.
  int entries = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder.path() / kPartsFolder))
    ++entries;
  EXPECT_EQ(entries, 1);
}

}  // namespace evalbus::plans::plan_test
