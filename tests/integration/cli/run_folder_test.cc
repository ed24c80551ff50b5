// Tests the contents of a run folder: the logs are complete and agree with the results.
#include <regex>
#include <set>

#include "base/random.h"
#include "base/sha256.h"
#include "bus/channels.h"
#include "evalbus/action_t.hpp"
#include "evalbus/contacts_t.hpp"
#include "evalbus/episode_begin_t.hpp"
#include "evalbus/episode_end_t.hpp"
#include "evalbus/episode_summary_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "evalbus/partial_metrics_t.hpp"
#include "evalbus/run_summary_t.hpp"
#include "evalbus/state_t.hpp"
#include "metrics/episode/result_json.h"
#include "models/scene.h"
#include "tests/integration/harness.h"

namespace evalbus::run_folder_test {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

std::set<std::string> Entries(const fs::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.insert(entry.path().filename());
  return names;
}

std::vector<std::string> Keys(const ordered_json& json) {
  std::vector<std::string> keys;
  for (const auto& [key, unused] : json.items()) keys.push_back(key);
  return keys;
}

using Names = std::set<std::string>;

// Runs in one process and in several.
class RunFolderTest : public testing::TestWithParam<bool> {
 protected:
  void SetUp() override {
    if (!GetParam()) EVALBUS_NEEDS_BUS();
    std::vector<std::string> arguments = {"LiftPotPosition", "--episodes", "2", "--seed", "3"};
    if (GetParam()) arguments.push_back("--in-process");
    Evaluate(arguments, run_);
  }
  TemporaryFolder folder_;
  const fs::path run_ = folder_.path() / "run";
};

TEST_P(RunFolderTest, HoldsWhatItShould) {
  EXPECT_EQ(Entries(folder_.path()), Names{"run"});
  EXPECT_EQ(Entries(run_),
            (Names{"episodes", "episodes.jsonl", "logs", "model", "run.json", "summary.json"}));
  EXPECT_EQ(Entries(run_ / "model"), (Names{"physics.mjb", "scene.xml", "visual.mjb"}));
  EXPECT_EQ(Entries(run_ / "episodes"), (Names{"0000", "0001"}));
  for (const char* episode : {"0000", "0001"})
    EXPECT_EQ(Entries(run_ / "episodes" / episode), (Names{"events.lcmlog", "summary.json"}));
  EXPECT_EQ(Entries(run_ / "logs"),
            (Names{"collision.log", "metrics.log", "policy.log", "recorder.log", "run.log", "sim.log"}));

  const auto run = ordered_json::parse(ReadText(run_ / "run.json"));
  EXPECT_EQ(run["schema_version"], 1);
  EXPECT_EQ(run["task"], "lift_pot");
  EXPECT_EQ(run["variation"], "position");
  EXPECT_EQ(run["seed"], 3);
  EXPECT_EQ(run["episodes"], 2);
  EXPECT_EQ(run["control_hz"], 50);
  EXPECT_EQ(run["realtime"], false);
  for (const char* key :
       {"policy", "robot", "evalbus_version", "git_commit", "git_dirty", "mujoco_version", "url"})
    EXPECT_TRUE(run.contains(key)) << key;
}

TEST_P(RunFolderTest, ResultsHaveRoboEvalsKeys) {
  const auto episodes = Episodes(run_);
  ASSERT_EQ(episodes.size(), 2u);
  for (int i = 0; i < 2; ++i) {
    const ordered_json& episode = episodes[static_cast<size_t>(i)];
    EXPECT_EQ(episode, ordered_json::parse(
                           ReadText(run_ / "episodes" / ("000" + std::to_string(i)) / "summary.json")));
    EXPECT_EQ(Keys(episode),
              (std::vector<std::string>{"task", "variation", "episode", "seed", "parameters", "end_reason",
                                        "end_detail", "failure_reason", "complete", "stage_names", "metrics",
                                        "extended", "final_poses", "explanation", "cause"}));
    // The final poses are from the last STATE, at which the task succeeded.
    const state_t last = ReadLog(LogFile(run_, i)).Messages(channels::kState).back();
    EXPECT_EQ(Keys(episode["final_poses"]), (std::vector<std::string>{"left_wrist", "right_wrist", "pot"}));
    EXPECT_EQ(episode["final_poses"]["right_wrist"]["x_m"], last.arm[1].wrist_position_m[0]);
    // The parameters equal the drawn values in EPISODE_BEGIN.
    const auto begin = ReadLog(LogFile(run_, i)).Messages(channels::kEpisodeBegin).at(0);
    EXPECT_EQ(Keys(episode["parameters"]), begin.parameter_name);
    for (size_t k = 0; k < begin.parameter_name.size(); ++k)
      EXPECT_EQ(episode["parameters"][begin.parameter_name[k]], begin.parameter_value_mixed[k]);
    EXPECT_EQ(episode["episode"], i);
    EXPECT_EQ(episode["end_reason"], "success");
    EXPECT_EQ(episode["complete"], true);
    EXPECT_EQ(Keys(episode["metrics"]), (std::vector<std::string>{"success",
                                                                  "completion_time",
                                                                  "task_stage_reached",
                                                                  "subtask_progress",
                                                                  "target_distance",
                                                                  "object_pose_error",
                                                                  "slip_count",
                                                                  "slip_count_per_object",
                                                                  "env_collision_count",
                                                                  "self_collision_count",
                                                                  "bimanual_arm_velocity_difference",
                                                                  "bimanual_gripper_vertical_difference",
                                                                  "cartesian_path_length",
                                                                  "total_cartesian_path_length",
                                                                  "avg_cartesian_path_length",
                                                                  "joint_path_length",
                                                                  "total_joint_path_length",
                                                                  "avg_joint_path_length",
                                                                  "orientation_path_length",
                                                                  "total_orientation_path_length",
                                                                  "avg_orientation_path_length",
                                                                  "avg_cartesian_jerk",
                                                                  "rms_cartesian_jerk",
                                                                  "overall_avg_cartesian_jerk",
                                                                  "overall_rms_cartesian_jerk",
                                                                  "avg_joint_jerk",
                                                                  "rms_joint_jerk",
                                                                  "overall_avg_joint_jerk",
                                                                  "overall_rms_joint_jerk"}));
    EXPECT_EQ(Keys(episode["metrics"]["joint_path_length"]), (std::vector<std::string>{"left", "right"}));
    EXPECT_EQ(Keys(episode["metrics"]["task_stage_reached"]), (std::vector<std::string>{"1", "2", "3", "4"}));
  }
  const auto summary = ordered_json::parse(ReadText(run_ / "summary.json"));
  EXPECT_EQ(summary["episodes"], 2);
  EXPECT_EQ(summary["successes"], 2);
  const auto time = [&](size_t i) { return episodes[i]["metrics"]["completion_time"].get<double>(); };
  EXPECT_DOUBLE_EQ(summary["metrics"]["completion_time"]["mean"], (time(0) + time(1)) / 2);
}

TEST_P(RunFolderTest, LogsAreWholeAndAgreeWithTheResults) {
  const auto episodes = Episodes(run_);
  ASSERT_EQ(episodes.size(), 2u);
  for (int i = 0; i < 2; ++i) {
    SCOPED_TRACE(i);
    const RecordedLog log = ReadLog(LogFile(run_, i));
    EXPECT_EQ(log.damaged_bytes, 0);
    EXPECT_EQ(log.events.front().channel, channels::kModel);
    EXPECT_EQ(log.events.back().channel, channels::kRunSummary);
    for (size_t k = 1; k < log.events.size(); ++k)
      ASSERT_GE(log.events[k].time_us, log.events[k - 1].time_us) << k;

    const auto model = log.Messages(channels::kModel).at(0);
    EXPECT_EQ(model.run_id, "run");
    EXPECT_EQ(model.physics_file, run_ / "model/physics.mjb");
    EXPECT_EQ(model.physics_sha256, Sha256File(model.physics_file));
    EXPECT_EQ(model.visual_sha256, Sha256File(model.visual_file));

    const auto states = log.Messages(channels::kState);
    const auto contacts = log.Messages(channels::kContacts);
    const auto actions = log.Messages(channels::kAction);
    const auto partials = log.Messages(channels::kPartial);
    ASSERT_GT(states.size(), 100u);
    ASSERT_EQ(contacts.size(), states.size());
    ASSERT_EQ(partials.size(), states.size());
    // The last state ends the episode, so the action that answers it may arrive too late for the log.
    ASSERT_GE(actions.size() + 1, states.size());
    ASSERT_LE(actions.size(), states.size());
    for (size_t tick = 0; tick < states.size(); ++tick) {
      const auto expect_tick = [&](const header_t& header) {
        EXPECT_EQ(header.episode, i);
        EXPECT_EQ(header.tick, static_cast<int64_t>(tick));
        EXPECT_EQ(header.sim_time_us, static_cast<int64_t>(tick) * 20000);
      };
      expect_tick(states[tick].header);
      expect_tick(contacts[tick].header);
      expect_tick(partials[tick].header);
      if (tick < actions.size()) expect_tick(actions[tick].header);
      const bool last = tick + 1 == states.size();
      EXPECT_EQ(partials[tick].verdict, last ? partial_metrics_t::SUCCESS : partial_metrics_t::UNDECIDED);
    }

    const auto end = log.Messages(channels::kEpisodeEnd);
    ASSERT_EQ(end.size(), 1u);
    EXPECT_EQ(end[0].header.tick, states.back().header.tick);
    const auto summaries = log.Messages(channels::kEpisodeSummary);
    ASSERT_EQ(summaries.size(), 1u);
    EXPECT_EQ(summaries[0].seed, log.Messages(channels::kEpisodeBegin).at(0).seed);
    // The last live values are the values in the results.
    const ordered_json& episode = episodes[static_cast<size_t>(i)];
    EXPECT_EQ(metrics::ResultJson(summaries[0].metrics), episode["metrics"]);
    EXPECT_EQ(metrics::ResultJson(partials.back().metrics), episode["metrics"]);
    // The metrics that need the whole episode are in the summary only.
    ordered_json live = metrics::ExtendedJson(partials.back().extended, partials.back().metrics);
    EXPECT_TRUE(live["spectral_arc_length"]["left"].is_null());
    for (const char* name :
         {"spectral_arc_length", "p95_object_force_N", "p95_scene_force_N", "p95_self_force_N"}) {
      live[name] = episode["extended"][name];
    }
    EXPECT_EQ(live, episode["extended"]);
    EXPECT_TRUE(episode["extended"]["spectral_arc_length"]["left"].is_number());
    EXPECT_EQ(metrics::ExplanationJson(summaries[0].explanation), episode["explanation"]);
  }
}

INSTANTIATE_TEST_SUITE_P(Hosting, RunFolderTest, testing::Bool(), [](const auto& test) {
  return std::string(test.param ? "InProcess" : "Processes");
});

// Returns columns, rows, units and outcomes without digits. Digits depend on the processor's floating-point
// arithmetic.
std::string Layout(const std::string& text) {
  const size_t begin = text.find("lift_pot/position  policy expert  seed 7"),
               end = text.find(" episodes in ");
  if (begin == std::string::npos || end < begin || end == std::string::npos) return "";
  const std::string table = text.substr(begin, end - begin);
  return std::regex_replace(std::regex_replace(table, std::regex("[0-9.]+"), "#"), std::regex(" +"), " ");
}

TEST(CommandsPage, ShowsTheTableThatItsCommandPrints) {
  const TemporaryFolder folder;
  const Result run = RunProgram({"evalbus", "run", "lift_pot/position", "--episodes", "10", "--seed", "7",
                                 "--in-process", "--out", folder.path() / "run"});
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_GT(Layout(run.out).size(), 500u);
  EXPECT_EQ(Layout(ReadText(fs::path(EVALBUS_SOURCE_DIR) / "docs/commands.md")), Layout(run.out));
}

// The test makes run.json look like one of a version that did not have these options.
TEST(Like, RunsAnOlderRunAgain) {
  const TemporaryFolder folder;
  const fs::path run = folder.path() / "run", again = folder.path() / "again";
  Evaluate({"lift_pot/position", "--policy", "hold", "--episodes", "1", "--seed", "3", "--in-process"}, run);
  const auto like = [&](const std::vector<std::string>& dropped, std::vector<std::string> more) {
    ordered_json info = ordered_json::parse(ReadText(run / "run.json"));
    for (const std::string& key : dropped) EXPECT_EQ(info.erase(key), 1u) << key;
    fs::create_directories(folder.path() / "old");
    WriteText(folder.path() / "old/run.json", info.dump());
    more.insert(more.begin(), {"evalbus", "run", "--like", folder.path() / "old"});
    return RunProgram(more);
  };
  const auto older =
      like({"log", "after_success_s", "physics_sha256", "visual_sha256", "scene_warnings"}, {"--out", again});
  EXPECT_EQ(older.code, 0) << older.err;
  EXPECT_NE(older.out.find("made by an older version without these options, which get their default values: "
                           "--after-success-s 0.0, --log \"plain\"\n"),
            std::string::npos)
      << older.out;
  EXPECT_EQ(ReadText(again / "episodes.jsonl"), ReadText(run / "episodes.jsonl"));
  const auto oldest = like({"seed_stream"}, {"--out", folder.path() / "oldest"});
  EXPECT_NE(oldest.out.find("their default values: --seed-stream \"\"\n"), std::string::npos) << oldest.out;
  // These options have no default value.
  for (const char* key : {"task_path", "policy", "episodes", "seed", "control_hz"}) {
    const auto refused = like({key}, {"--out", folder.path() / "refused"});
    EXPECT_EQ(refused.code, 1);
    EXPECT_EQ(refused.err, "error: " + (folder.path() / "old/run.json").string() + ": " + key +
                               ": required key is missing\n");
  }
  // A new number of episodes replaces the selection of the old run.
  ordered_json selection = ordered_json::parse(ReadText(run / "run.json"));
  selection["episodes"] = 5;
  selection["only"] = {4};
  fs::create_directories(folder.path() / "selection");
  WriteText(folder.path() / "selection/run.json", selection.dump());
  Evaluate({"--like", folder.path() / "selection", "--episodes", "1"}, folder.path() / "first");
  EXPECT_EQ(ReadText(folder.path() / "first/episodes.jsonl"), ReadText(run / "episodes.jsonl"));
  EXPECT_EQ(RunProgram({"evalbus", "run", "--like", run, "--policy", "replay:" + run.string(), "--episodes",
                        "2", "--out", folder.path() / "refused"})
                .err,
            "error: --policy: " + run.string() + " contains no episode 1 to replay\n");
  // The name of the old run's policy does not apply to a different policy.
  ordered_json named = ordered_json::parse(ReadText(run / "run.json"));
  named["policy_name"] = "ckpt-1";
  fs::create_directories(folder.path() / "named");
  WriteText(folder.path() / "named/run.json", named.dump());
  Evaluate({"--like", folder.path() / "named"}, folder.path() / "same_policy");
  EXPECT_EQ(ordered_json::parse(ReadText(folder.path() / "same_policy/run.json"))["policy_name"], "ckpt-1");
  Evaluate({"--like", folder.path() / "named", "--policy", "random"}, folder.path() / "other_policy");
  EXPECT_EQ(ordered_json::parse(ReadText(folder.path() / "other_policy/run.json"))["policy_name"], "");
  // The old run's contract does not apply either, unless the new policy is also a server.
  ordered_json served = ordered_json::parse(ReadText(run / "run.json"));
  served["policy"] = "ws://127.0.0.1:1";
  served["contract"] = "plain";
  fs::create_directories(folder.path() / "served");
  WriteText(folder.path() / "served/run.json", served.dump());
  Evaluate({"--like", folder.path() / "served", "--policy", "hold"}, folder.path() / "not_served");
  EXPECT_EQ(ordered_json::parse(ReadText(folder.path() / "not_served/run.json"))["contract"], "");
  const auto moved = RunProgram({"evalbus", "run", "--like", folder.path() / "served", "--policy",
                                 "ws://127.0.0.1:2", "--out", folder.path() / "moved"});
  EXPECT_NE(moved.err.find("rate_hz: the policy acts at 20 Hz, but the run has 50 Hz"), std::string::npos)
      << moved.err;
  // A run with a policy would wait for the source of a watched run.
  named["watch"] = true;
  WriteText(folder.path() / "named/run.json", named.dump());
  const auto watched = RunProgram({"evalbus", "run", "--like", folder.path() / "named", "--policy", "hold",
                                   "--out", folder.path() / "w"});
  EXPECT_EQ(watched.code, 1);
  EXPECT_EQ(watched.err,
            "error: --like " + (folder.path() / "named").string() +
                ": a run of 'evalbus watch', whose robot was moved by a source, not by a policy\n");
  // An older run cannot be resumed, because the hashes of its files are unknown.
  ordered_json info = ordered_json::parse(ReadText(again / "run.json"));
  info.erase("physics_sha256");
  WriteText(again / "run.json", info.dump());
  const auto resumed = RunProgram({"evalbus", "run", "--like", run, "--out", again, "--resume"});
  EXPECT_EQ(resumed.code, 1);
  EXPECT_NE(resumed.err.find("made with another physics model (physics_sha256)"), std::string::npos)
      << resumed.err;
  EXPECT_EQ(std::count(resumed.err.begin(), resumed.err.end(), '\n'), 1) << resumed.err;
}

// Readers of a run count the planned episodes that are missing.
TEST(ResumedSelection, DoesNotReplaceThePlannedEpisodes) {
  const TemporaryFolder folder;
  const fs::path run = folder.path() / "run";
  const auto planned = [&](const std::string& only, bool resume) {
    std::vector<std::string> command = {"evalbus",    "run", "lift_pot/position", "--policy", "hold",
                                        "--episodes", "4",   "--in-process",      "--out",    run};
    if (!only.empty()) command.insert(command.end(), {"--only", only});
    if (resume) command.push_back("--resume");
    const Result result = RunProgram(command);
    EXPECT_EQ(result.code, 0) << result.err;
    return ordered_json::parse(ReadText(run / "run.json"))["only"];
  };
  EXPECT_EQ(planned("2,0,2", false), ordered_json({0, 2}));
  EXPECT_EQ(planned("1", true), ordered_json({0, 1, 2}));
  EXPECT_EQ(planned("", true), ordered_json::array());
  // Episode 3 is missing, as after an interruption, and another one is repeated.
  std::string lines = ReadText(run / "episodes.jsonl");
  lines.erase(lines.rfind('\n', lines.size() - 2) + 1);
  lines.erase(lines.rfind('\n', lines.size() - 2) + 1);
  WriteText(run / "episodes.jsonl", lines);
  EXPECT_EQ(planned("2", true), ordered_json::array());
  const Result table = RunProgram({"evalbus", "export", run, "--csv", folder.path() / "table.csv"});
  EXPECT_NE(table.out.find("3 of 4 episodes have finished"), std::string::npos) << table.out << table.err;
}

// Episodes 1 to 3 are missing, as after an interruption, and only episode 2 is requested.
TEST(ResumedSelection, IsTheSameWithWorkers) {
  const TemporaryFolder folder;
  const fs::path run = folder.path() / "run";
  Evaluate({"lift_pot/position", "--policy", "hold", "--episodes", "4", "--in-process"}, run);
  const std::string lines = ReadText(run / "episodes.jsonl");
  WriteText(run / "episodes.jsonl", lines.substr(0, lines.find('\n') + 1));
  const Result resumed =
      RunProgram({"evalbus", "run", "lift_pot/position", "--policy", "hold", "--episodes", "4",
                  "--in-process", "--only", "2", "--workers", "2", "--out", run, "--resume"});
  ASSERT_EQ(resumed.code, 0) << resumed.err;
  ASSERT_EQ(Episodes(run).size(), 2u);
  EXPECT_EQ(Episodes(run)[0]["episode"], 0);
  EXPECT_EQ(Episodes(run)[1]["episode"], 2);
}

// Without seed_stream in run.json, the seeds of episodes depend on the run's seed and the index alone.
TEST(SeedStream, ARunThatIsOlderThanItKeepsItsSeeds) {
  const TemporaryFolder folder;
  const fs::path old = folder.path() / "old", again = folder.path() / "again",
                 replayed = folder.path() / "replayed";
  const std::vector<std::string> run = {
      "lift_pot/position", "--policy", "noisy_expert", "--episodes", "2", "--seed", "3", "--in-process"};
  const auto forget = [](const fs::path& run_json) {
    ordered_json info = ordered_json::parse(ReadText(run_json));
    EXPECT_EQ(info.erase("seed_stream"), 1u);
    WriteText(run_json, info.dump());
  };
  Evaluate(run, folder.path() / "new");
  fs::create_directories(old);
  fs::copy(folder.path() / "new/run.json", old / "run.json");
  forget(old / "run.json");
  Evaluate({"--like", old}, again);
  forget(again / "run.json");
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(Episodes(again)[static_cast<size_t>(i)]["seed"],
              (SeedSource{3, kSharedSeeds, {}, {}}.OfEpisode(i)));
    EXPECT_EQ(Episodes(folder.path() / "new")[static_cast<size_t>(i)]["seed"],
              (SeedSource{3, kRunSeeds, "lift_pot", "position"}.OfEpisode(i)));
  }
  const Result rescored = RunProgram({"evalbus", "rescore", again});
  EXPECT_EQ(rescored.code, 0) << rescored.out << rescored.err;
  for (const fs::path& recording : {again, LogFile(again, 1)}) {
    std::vector<std::string> replay = run;
    replay[2] = "replay:" + recording.string();
    replay.insert(replay.end(), {"--only", "1"});
    fs::remove_all(replayed);
    Evaluate(replay, replayed);
    EXPECT_EQ(Episodes(replayed).at(0), Episodes(again).at(1));
  }
  ordered_json info = ordered_json::parse(ReadText(again / "run.json"));
  info["seed_stream"] = "run/99";
  WriteText(again / "run.json", info.dump());
  const Result newer = RunProgram({"evalbus", "rescore", again});
  EXPECT_EQ(newer.code, 1);
  EXPECT_EQ(newer.err,
            "error: " + (again / "run.json").string() +
                ": \"seed_stream\" is \"run/99\", which this version of evalbus does not support\n");
}

// RoboEval's own environment has these values after reset(seed=0).
TEST(SeedStream, OfRoboEvalStartsAsItsEnvironmentDoes) {
  const TemporaryFolder folder;
  const std::vector<std::string> run = {"lift_pot/position", "--policy", "hold",          "--in-process",
                                        "--control-hz",      "20",       "--seed-stream", "roboeval/1"};
  const auto with = [&](std::vector<std::string> options) {
    options.insert(options.begin(), run.begin(), run.end());
    return options;
  };
  Evaluate(with({"--episodes", "2", "--seed", "0"}), folder.path() / "a");
  Evaluate(with({"--episodes", "1", "--seed", "1"}), folder.path() / "b");
  const auto episodes = Episodes(folder.path() / "a");
  EXPECT_EQ(episodes[0]["seed"], 0);
  EXPECT_NEAR(episodes[0]["parameters"]["pot_x_m"], 0.7325034884505077, 1e-12);
  EXPECT_NEAR(episodes[0]["parameters"]["pot_y_m"], 0.11753190023462401, 1e-12);
  EXPECT_EQ(episodes[1]["seed"], 1);
  EXPECT_EQ(episodes[1]["parameters"], Episodes(folder.path() / "b")[0]["parameters"]);
  const std::string out = folder.path() / "refused";
  const auto error_of = [&](const std::string& stream, const std::string& seed) {
    const Result refused = RunProgram(
        {"evalbus", "run", "lift_pot/position", "--seed-stream", stream, "--seed", seed, "--out", out});
    EXPECT_EQ(refused.code, 1);
    EXPECT_FALSE(fs::exists(out));
    return refused.err;
  };
  EXPECT_EQ(
      error_of("roboeval/1", "4294967296"),
      "error: --seed-stream roboeval/1: expected seeds from 0 to 4294967295, got --seed 4294967296 and 10 "
      "episodes\n");
  EXPECT_EQ(error_of("roboeval/2", "0"),
            "error: --seed-stream: expected run/2, collect/2 or roboeval/1, got 'roboeval/2'\n");
}

TEST(PolicyName, IsWhatResultsCallThePolicy) {
  TemporaryFolder folder;
  const std::string task = ShortTask(folder.path(), 0.2);
  const std::vector<std::string> run = {"evalbus", "run",           task,         "--policy",
                                        "random",  "--policy-name", "ckpt-12000", "--episodes",
                                        "2",       "--in-process"};
  std::vector<std::string> first = run;
  first.insert(first.end(), {"--out", folder.path() / "a"});
  const Result result = RunProgram(first);
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_NE(result.out.find("policy ckpt-12000  "), std::string::npos) << result.out;
  const auto json = nlohmann::json::parse(ReadText(folder.path() / "a/run.json"));
  EXPECT_EQ(json["policy"], "random");
  EXPECT_EQ(json["policy_name"], "ckpt-12000");
  Evaluate({task, "--policy", "hold", "--episodes", "2", "--in-process"}, folder.path() / "b");
  const Result compared = RunProgram({"evalbus", "compare", folder.path() / "a", folder.path() / "b"});
  EXPECT_NE(compared.out.find("b (hold) against a (ckpt-12000)"), std::string::npos)
      << compared.out << compared.err;
  // The default run folder is also named after the policy.
  const Result unnamed = RunProgram(run, {folder.path(), nullptr});
  EXPECT_NE(unnamed.out.find("-ckpt-12000-20"), std::string::npos) << unnamed.out;
  // A run has only one policy.
  first.back() = folder.path() / "b";
  first.push_back("--resume");
  EXPECT_NE(RunProgram(first).err.find("the run was made with policy"), std::string::npos);
}

}  // namespace evalbus::run_folder_test
