// Resumed runs and runs of several workers have the same bytes as one uninterrupted run.
#include <gmock/gmock.h>
#include <signal.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <sstream>

#include "tests/integration/harness.h"

namespace evalbus::resume_test {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

const std::string kTask = "lift_pot/position_and_orientation";

std::vector<std::string> RunCommand(const fs::path& out, const std::vector<std::string>& more = {},
                                    const std::string& episodes = "5") {
  std::vector<std::string> command = {"evalbus", "run",    kTask, "--out",        out,  "--episodes",
                                      episodes,  "--seed", "1",   "--control-hz", "200"};
  command.insert(command.end(), more.begin(), more.end());
  return command;
}

// The reference is one uninterrupted run in one process. All others must equal it.
class Resume : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    made_ = new TemporaryFolder;
    ASSERT_EQ(RunProgram(RunCommand(made_->path() / "run", {"--in-process"})).code, 0);
  }
  static void TearDownTestSuite() {
    delete made_;
    made_ = nullptr;
  }

  void ExpectAsReference(const fs::path& run) {
    EXPECT_EQ(ReadText(run / "episodes.jsonl"), ReadText(reference_ / "episodes.jsonl"));
    EXPECT_EQ(ReadText(run / "summary.json"), ReadText(reference_ / "summary.json"));
    for (int i = 0; i < 5; ++i) ExpectSameTicks(ReadLog(LogFile(run, i)), ReadLog(LogFile(reference_, i)));
    for (const auto& entry : fs::recursive_directory_iterator(run)) {
      EXPECT_NE(entry.path().extension(), ".partial") << entry.path();
      EXPECT_NE(entry.path().extension(), ".tmp") << entry.path();
    }
  }
  // Returns whether the run is in the middle of its second episode.
  static bool InSecondEpisode(const fs::path& run) {
    std::error_code error;
    return fs::file_size(run / "episodes/0001.partial/events.lcmlog", error) > 100'000 && !error;
  }

  static TemporaryFolder* made_;
  const fs::path reference_ = made_->path() / "run";
  TemporaryFolder folder_;
  const fs::path run_ = folder_.path() / "run";
};
TemporaryFolder* Resume::made_ = nullptr;

TEST_F(Resume, AfterTheLauncherWasKilledTheRestIsDone) {
  EVALBUS_NEEDS_BUS();
  {
    Program launcher(RunCommand(run_));
    ASSERT_TRUE(WaitFor([&] { return InSecondEpisode(run_); })) << launcher.err();
    launcher.Signal(SIGKILL);
    EXPECT_EQ(launcher.Wait(), 128 + SIGKILL);
  }
  const size_t before = Episodes(run_).size();
  ASSERT_LT(before, 5u);
  // Simulates a kill: the next line is cut off, and a file is half-written.
  std::ofstream(run_ / "episodes.jsonl", std::ios::app) << R"({"task":"lift_p)";
  WriteText(run_ / "model/physics.mjb.12.tmp", "half");
  const auto resumed = RunProgram(RunCommand(run_, {"--resume"}));
  EXPECT_EQ(resumed.code, 0) << resumed.err;
  EXPECT_NE(resumed.out.find(std::to_string(before) + " finished earlier"), std::string::npos) << resumed.out;
  ExpectAsReference(run_);
}

TEST_F(Resume, AfterCtrlCTheRestIsDone) {
  Program launcher(RunCommand(run_, {"--in-process"}));
  ASSERT_TRUE(WaitFor([&] { return InSecondEpisode(run_); })) << launcher.err();
  launcher.Signal(SIGINT);
  EXPECT_EQ(launcher.Wait(), 2);
  EXPECT_NE(launcher.err().find("to resume, run the same command with --out " + run_.string() + " --resume"),
            std::string::npos)
      << launcher.err();
  EXPECT_EQ(RunProgram(RunCommand(run_, {"--in-process", "--resume"})).code, 0);
  ExpectAsReference(run_);
  // Nothing remains to be done.
  EXPECT_EQ(RunProgram(RunCommand(run_, {"--in-process", "--resume"})).code, 0);
  ExpectAsReference(run_);
}

TEST_F(Resume, RefusesAnotherRun) {
  ASSERT_EQ(RunProgram(RunCommand(run_, {"--in-process"}, "1")).code, 0);
  const std::string before = ReadText(run_ / "episodes.jsonl");
  const auto other = RunProgram(RunCommand(run_, {"--in-process", "--resume", "--policy", "hold"}));
  EXPECT_EQ(other.code, 1);
  EXPECT_NE(other.err.find("the run was made with policy \"expert\", not \"hold\""), std::string::npos)
      << other.err;
  const auto fresh = RunProgram(RunCommand(run_, {"--in-process"}));
  EXPECT_EQ(fresh.code, 1);
  EXPECT_NE(fresh.err.find("add --resume"), std::string::npos) << fresh.err;
  fs::create_directory(folder_.path() / "foreign");
  WriteText(folder_.path() / "foreign/file", "");
  const auto foreign = RunProgram(RunCommand(folder_.path() / "foreign", {"--in-process", "--resume"}));
  EXPECT_EQ(foreign.code, 1);
  EXPECT_NE(foreign.err.find("it has no run.json"), std::string::npos) << foreign.err;
  EXPECT_EQ(ReadText(run_ / "episodes.jsonl"), before);
}

// Returns every file of a folder: its relative path and its content.
std::map<std::string, std::string> Contents(const fs::path& folder) {
  std::map<std::string, std::string> contents;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) contents[entry.path().lexically_relative(folder)] = ReadText(entry.path());
  }
  return contents;
}

void Replace(const fs::path& file, const std::string& what, const std::string& with) {
  std::string text = ReadText(file);
  const size_t at = text.find(what);
  ASSERT_NE(at, std::string::npos) << file << " has no " << what;
  WriteText(file, text.replace(at, what.size(), with));
}

// An interrupted run with the user's own models. A refused --resume prints the reason and changes nothing.
class ResumeRefuses : public testing::Test {
 protected:
  void SetUp() override {
    fs::copy(fs::path(EVALBUS_SOURCE_DIR) / "models", models_, fs::copy_options::recursive);
    ASSERT_EQ(Run(kSeed, {"--episodes", "2"}).code, 0);
    // These are the leftovers of a killed run and a file of the user.
    fs::create_directories(run_ / "episodes/0002.partial");
    WriteText(run_ / "episodes/0002.partial/events.lcmlog", "half");
    WriteText(run_ / "run.json.12.tmp", "half");
    WriteText(run_ / "notes.tmp", "mine");
  }
  Result Run(const std::string& seed, const std::vector<std::string>& more) {
    std::vector<std::string> command = {"evalbus",      "run",    "lift_pot", "--policy", "hold",
                                        "--in-process", "--seed", seed,       "--out",    run_};
    command.insert(command.end(), more.begin(), more.end());
    return RunProgram(command, {{}, [this] { setenv("EVALBUS_MODELS", models_.c_str(), 1); }});
  }
  void Expect(const std::string& words, const std::string& seed = kSeed) {
    SCOPED_TRACE(words);
    const auto before = Contents(run_);
    const Result resumed = Run(seed, {"--episodes", "4", "--resume"});
    EXPECT_EQ(resumed.code, 1);
    EXPECT_TRUE(resumed.err.starts_with("error: ")) << resumed.err;
    EXPECT_EQ(std::count(resumed.err.begin(), resumed.err.end(), '\n'), 1) << resumed.err;
    EXPECT_NE(resumed.err.find(words), std::string::npos) << resumed.err;
    EXPECT_EQ(Contents(run_), before);
  }
  std::string Lines() const { return ReadText(run_ / "episodes.jsonl"); }

  static constexpr char kSeed[] = "3";
  TemporaryFolder folder_;
  const fs::path models_ = folder_.path() / "models", run_ = folder_.path() / "run";
};

TEST_F(ResumeRefuses, OtherFiles) {
  const fs::path pot = models_ / "props/pot/pot.xml", task = models_ / "tasks/lift_pot.yaml",
                 robot = models_ / "robots/bimanual_panda.yaml";
  const auto expect = [&](const fs::path& file, const std::string& what, const std::string& with,
                          const std::string& words) {
    const std::string text = ReadText(file);
    Replace(file, what, with);
    Expect(words);
    WriteText(file, text);
  };
  expect(pot, "mass=\"3.363", "mass=\"9.363",
         "the run was made with another physics model (physics_sha256); restore the changed file");
  expect(pot, "handles.obj\"", "handles.obj\" scale=\"1.1 1.1 1.1\"",
         "the run was made with another ");  // also applies to visual models
  expect(robot, "home_rad: &home [0, ", "home_rad: &home [0.1, ",
         "the run was made with another robot description");
  expect(task, "time_limit_s: ", "time_limit_s: 1", "the run was made with another task description");
  Expect("the run was made with seed 3, not 4", "4");
  // With the original files the run resumes.
  const Result resumed = Run(kSeed, {"--episodes", "4", "--resume"});
  EXPECT_EQ(resumed.code, 0) << resumed.err;
  EXPECT_EQ(Episodes(run_).size(), 4u);
  EXPECT_FALSE(fs::exists(run_ / "run.json.12.tmp"));
  EXPECT_EQ(ReadText(run_ / "notes.tmp"), "mine");
}

TEST_F(ResumeRefuses, LinesThatNoReaderTakes) {
  const std::string lines = Lines();
  const size_t end = lines.find('\n') + 1;
  const auto expect = [&](const std::string& text, const std::string& words) {
    WriteText(run_ / "episodes.jsonl", text);
    Expect(words);
    // Programs that read the run print the same error.
    const Result exported = RunProgram({"evalbus", "export", run_, "--csv", folder_.path() / "table.csv"});
    EXPECT_EQ(exported.code, 1);
    EXPECT_NE(exported.err.find(words), std::string::npos) << exported.err;
  };
  const auto with = [&](const std::string& key, const nlohmann::ordered_json& value) {
    auto line = nlohmann::ordered_json::parse(lines.substr(0, end));
    line[key] = value;
    return line.dump() + "\n" + lines.substr(end);
  };
  expect(lines + lines.substr(0, end), "episodes.jsonl:3: episode 0 is repeated, first in line 1");
  expect(with("seed", 1), "episodes.jsonl:1: seed 1 is not the seed of episode 0");
  expect(with("task", "stack_two_blocks"), "episodes.jsonl:1: an episode of stack_two_blocks/base");
  expect(with("end_detail", 1), "episodes.jsonl:1: \"end_detail\" is 1, expected a string");
  expect(with("explanation", nullptr), "episodes.jsonl:1: \"explanation\" is null, expected an object");
  expect(std::string(300'000, '[') + "\n", "episodes.jsonl:1: expected JSON nested at most 64 levels deep");
  WriteText(run_ / "episodes.jsonl", lines);
  WriteText(run_ / "run.json", std::string(300'000, '['));
  Expect("run.json: expected JSON nested at most 64 levels deep");
}

TEST(ForceLimits, OfAResumedRunAreThoseOfItsBegin) {
  TemporaryFolder folder;
  const fs::path task = ShortTask(folder.path(), 0.2), run = folder.path() / "run",
                 limits = folder.path() / "limits.yaml";
  const auto evaluate = [&](const std::string& episodes, const std::vector<std::string>& more) {
    std::vector<std::string> command = {"evalbus",    "run",    task,           "--policy", "hold",
                                        "--episodes", episodes, "--in-process", "--out",    run};
    command.insert(command.end(), more.begin(), more.end());
    return RunProgram(command);
  };
  const std::string text = "limits: {pot: {bodies: [pot], grip_force_N: 20}}\n";
  WriteText(limits, text);
  // run.json has an absolute path, so that every process of the run reads the same file.
  const std::string relative = fs::relative(limits);
  ASSERT_EQ(evaluate("1", {"--limits", relative}).code, 0);
  EXPECT_EQ(nlohmann::json::parse(ReadText(run / "run.json"))["limits"],
            fs::absolute(relative).lexically_normal().string());
  Replace(limits, "20", "30");
  const auto before = Contents(run);
  const Result other = evaluate("2", {"--limits", relative, "--resume"});
  EXPECT_EQ(other.code, 1);
  EXPECT_EQ(other.err, "error: --resume: " + (run / "run.json").string() +
                           ": the run was made with other force limits (limits_sha256); restore the changed "
                           "file, or start another run\n");
  const Result none = evaluate("2", {"--resume"});
  EXPECT_EQ(none.code, 1);
  EXPECT_EQ(std::count(none.err.begin(), none.err.end(), '\n'), 1) << none.err;
  EXPECT_EQ(Contents(run), before);
  WriteText(limits, text);
  const Result resumed = evaluate("2", {"--limits", limits, "--resume"});
  EXPECT_EQ(resumed.code, 0) << resumed.err;
  EXPECT_EQ(Episodes(run).size(), 2u);
}

// A restarted sim reads its files again, so a file that changed during the run is an error.
TEST(Restart, WithOtherFilesIsRefusedAndTheRunContinuesWithItsOwn) {
  EVALBUS_NEEDS_BUS();
  TemporaryFolder folder;
  const fs::path task = ShortTask(folder.path(), 2), run = folder.path() / "run",
                 reference = folder.path() / "reference";
  const auto command = [&](const fs::path& out, const std::vector<std::string>& more) {
    std::vector<std::string> words = {"evalbus",    "run", task,    "--policy", "hold",
                                      "--episodes", "16",  "--out", out};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  };
  ASSERT_EQ(RunProgram(command(reference, {"--in-process"})).code, 0);
  const std::string before = ReadText(task);
  Program launcher(command(run, {}));
  ASSERT_TRUE(WaitFor([&] { return fs::exists(run / "episodes.jsonl"); })) << launcher.err();
  launcher.Signal(SIGSTOP);
  const auto sims = ChildrenOf(launcher.pid(), "evalbus-sim");
  ASSERT_EQ(sims.size(), 1u);
  Replace(task, "min_m: 1.096", "min_m: 9.096");
  kill(sims[0], SIGKILL);
  launcher.Signal(SIGCONT);
  EXPECT_EQ(launcher.Wait(), 1);
  EXPECT_EQ(launcher.err(), "error: " + task.string() +
                                " changed during the run; restore it and use --resume, or start a new run\n");
  const size_t finished = Episodes(run).size();
  EXPECT_LT(finished, 16u);
  EXPECT_EQ(RunProgram(command(run, {"--resume"})).code, 1);
  EXPECT_EQ(Episodes(run).size(), finished);
  WriteText(task, before);
  const Result resumed = RunProgram(command(run, {"--resume"}));
  EXPECT_EQ(resumed.code, 0) << resumed.err;
  ExpectSameScores(run, reference);
}

// The run was stopped, or the disk became full, while the last line was written.
TEST_F(Resume, ALineThatIsCutOffIsLeftOutAndMadeAgain) {
  ASSERT_EQ(RunProgram(RunCommand(run_, {"--in-process"})).code, 0);
  const std::string lines = ReadText(run_ / "episodes.jsonl");
  WriteText(run_ / "episodes.jsonl", lines.substr(0, lines.size() - 100));
  const fs::path table = folder_.path() / "table.csv";
  const Result exported = RunProgram({"evalbus", "export", run_, "--csv", table});
  EXPECT_EQ(exported.code, 0) << exported.err;
  EXPECT_NE(exported.out.find("line 5 of episodes.jsonl is truncated and ignored"), std::string::npos)
      << exported.out;
  const std::string rows = ReadText(table);
  EXPECT_EQ(std::count(rows.begin(), rows.end(), '\n'), 5);  // with the header
  EXPECT_EQ(RunProgram(RunCommand(run_, {"--in-process", "--resume"})).code, 0);
  ExpectAsReference(run_);
}

TEST_F(Resume, AnEpisodeWithAVerdictIsNotMadeAgain) {
  fs::copy(reference_, run_, fs::copy_options::recursive);
  const std::string lines = ReadText(run_ / "episodes.jsonl");
  WriteText(run_ / "episodes.jsonl", lines.substr(0, lines.rfind('\n', lines.size() - 2) + 1));
  WriteText(run_ / "verdicts.jsonl",
            R"({"episode":4,"operator":"ann","verdict":"success","stages_reached":null,"rubric":null,)"
            R"("time_utc":"2026-11-29T03:00:00Z","place":0,"order_seed":null})"
            "\n");
  const Result refused = RunProgram(RunCommand(run_, {"--in-process", "--resume"}));
  EXPECT_EQ(refused.code, 1);
  EXPECT_EQ(refused.err, "error: --resume: " + (run_ / "verdicts.jsonl").string() +
                             " has a verdict of ann on episode 4, which would run again; remove the line, "
                             "or start another run\n");
  EXPECT_TRUE(fs::exists(LogFile(run_, 4)));
  fs::remove(run_ / "verdicts.jsonl");
  ASSERT_EQ(RunProgram(RunCommand(run_, {"--in-process", "--resume"})).code, 0);
  ExpectAsReference(run_);
}

TEST_F(Resume, NoOldSummaryExistsDuringARun) {
  ASSERT_EQ(RunProgram(RunCommand(run_, {"--in-process"}, "2")).code, 0);
  ASSERT_TRUE(fs::exists(run_ / "summary.json"));
  {
    Program launcher(RunCommand(run_, {"--in-process", "--resume"}));
    ASSERT_TRUE(WaitFor([&] { return Episodes(run_).size() > 2; })) << launcher.err();
    launcher.Signal(SIGKILL);
    launcher.Wait();
  }
  const bool had_finished = Episodes(run_).size() == 5;
  EXPECT_TRUE(had_finished || !fs::exists(run_ / "summary.json"));
  EXPECT_EQ(RunProgram(RunCommand(run_, {"--in-process", "--resume"})).code, 0);
  ExpectAsReference(run_);
}

TEST_F(Resume, RefusesAFolderInWhichARunIsAtWork) {
  Program launcher(RunCommand(run_, {"--in-process"}));
  ASSERT_TRUE(WaitFor([&] { return InSecondEpisode(run_); })) << launcher.err();
  // While the first launcher is stopped, it cannot finish before the second one starts.
  launcher.Signal(SIGSTOP);
  const auto second = RunProgram(RunCommand(run_, {"--in-process", "--resume"}));
  EXPECT_EQ(second.code, 1);
  EXPECT_NE(second.err.find("another command is using this folder"), std::string::npos) << second.err;
  launcher.Signal(SIGCONT);
  EXPECT_EQ(launcher.Wait(), 0) << launcher.err();
  ExpectAsReference(run_);
}

TEST_F(Resume, WorkersGiveTheSameBytes) {
  const auto run = RunProgram(RunCommand(run_, {"--in-process", "--workers", "2"}));
  EXPECT_EQ(run.code, 0) << run.err;
  ExpectAsReference(run_);
}

TEST_F(Resume, WorkersOnBusesOfTheirOwnGiveTheSameBytes) {
  EVALBUS_NEEDS_BUS();
  const auto run = RunProgram(RunCommand(run_, {"--workers", "2"}));
  EXPECT_EQ(run.code, 0) << run.err;
  ExpectAsReference(run_);
}

TEST_F(Resume, AKilledWorkerIsRestarted) {
  Program launcher(RunCommand(run_, {"--in-process", "--workers", "2"}));
  ASSERT_TRUE(WaitFor([&] { return InSecondEpisode(run_); })) << launcher.err();
  const auto workers = ChildrenOf(launcher.pid(), "evalbus");
  ASSERT_EQ(workers.size(), 2u);
  for (const pid_t worker : workers) kill(worker, SIGKILL);
  EXPECT_EQ(launcher.Wait(), 0) << launcher.err();
  for (const char* name : {"worker-0", "worker-1"}) {
    EXPECT_NE(launcher.out().find("\nretrying: " + std::string(name) + " was ended by signal Killed\n"),
              std::string::npos)
        << launcher.out();
  }
  ExpectAsReference(run_);
}

TEST_F(Resume, WhatGoesWrongInAWorkerIsShown) {
  EVALBUS_NEEDS_BUS();
  Program launcher(RunCommand(run_, {"--workers", "2"}));
  ASSERT_TRUE(WaitFor([&] { return InSecondEpisode(run_); })) << launcher.err();
  const auto workers = ChildrenOf(launcher.pid(), "evalbus");
  ASSERT_EQ(workers.size(), 2u);
  const auto sims = ChildrenOf(workers[1], "evalbus-sim");
  ASSERT_EQ(sims.size(), 1u);
  kill(sims[0], SIGKILL);
  EXPECT_EQ(launcher.Wait(), 0) << launcher.err();
  EXPECT_NE(launcher.out().find("  retrying: sim was ended by signal Killed"), std::string::npos)
      << launcher.out();
  ExpectAsReference(run_);
}

class HangOf : public Resume, public testing::WithParamInterface<const char*> {};

TEST_P(HangOf, AComponentIsNoticedAndChangesNoScore) {
  EVALBUS_NEEDS_BUS();
  Program launcher(RunCommand(run_));
  ASSERT_TRUE(WaitFor([&] { return InSecondEpisode(run_); })) << launcher.err();
  const auto children = ChildrenOf(launcher.pid(), std::string("evalbus-") + GetParam());
  ASSERT_EQ(children.size(), 1u);
  kill(children[0], SIGSTOP);
  EXPECT_EQ(launcher.Wait(), 0) << launcher.err();
  EXPECT_NE(launcher.out().find("retrying: " + std::string(GetParam()) + " hangs"), std::string::npos)
      << launcher.out();
  ExpectAsReference(run_);
}

INSTANTIATE_TEST_SUITE_P(Each, HangOf, testing::Values("sim", "collision", "metrics", "policy", "recorder"),
                         [](const auto& test) { return std::string(test.param); });

TEST(Suite, RunsEachTaskInAFolderOfItsOwn) {
  TemporaryFolder folder;
  const fs::path suite = folder.path() / "suite";
  const std::vector<std::string> command = {"evalbus",   "run", "lift_pot/all", "--episodes", "1",
                                            "--workers", "2",   "--in-process", "--out",      suite};
  const auto run = RunProgram(command);
  EXPECT_EQ(run.code, 0) << run.err;
  const auto json = nlohmann::json::parse(ReadText(suite / "suite.json"));
  EXPECT_EQ(json["runs"], nlohmann::json({"lift_pot-base", "lift_pot-position", "lift_pot-orientation",
                                          "lift_pot-position_and_orientation"}));
  for (const std::string name : json["runs"]) EXPECT_EQ(Episodes(suite / name).size(), 1u) << name;
  const auto summary = nlohmann::json::parse(ReadText(suite / "summary.json"));
  EXPECT_EQ(summary["all"]["episodes"], 4);
  nlohmann::json all = summary["all"];
  EXPECT_EQ(all.erase("mean_success_rate_of_tasks"), 1u);
  EXPECT_EQ(summary["by_task"]["lift_pot"], all);
  EXPECT_EQ(summary["by_variation"]["lift_pot/position"]["episodes"], 1);
  EXPECT_NE(run.out.find("4 of 4"), std::string::npos) << run.out;

  // A missing run is evaluated again; the others are kept.
  fs::remove_all(suite / "lift_pot-position");
  const auto before = fs::last_write_time(suite / "lift_pot-base/episodes/0000/events.lcmlog");
  auto again = command;
  again.push_back("--resume");
  EXPECT_EQ(RunProgram(again).code, 0);
  EXPECT_EQ(Episodes(suite / "lift_pot-position").size(), 1u);
  EXPECT_EQ(fs::last_write_time(suite / "lift_pot-base/episodes/0000/events.lcmlog"), before);

  const auto twice =
      RunProgram({"evalbus", "run", "lift_pot", "lift_pot/base", "--out", folder.path() / "twice"});
  EXPECT_EQ(twice.code, 1);
  EXPECT_EQ(twice.err, "error: task 'lift_pot/base' is given twice\n");
  EXPECT_FALSE(fs::exists(folder.path() / "twice"));
}

// Returns the events that `evalbus run --json` printed, whose lines must match their schema.
std::vector<nlohmann::json> EventsOf(const Result& run, const fs::path& folder) {
  WriteText(folder / "events.jsonl", run.out);
  EXPECT_EQ(SchemaError("event", folder / "events.jsonl"), "");
  std::istringstream lines(run.out);
  std::vector<nlohmann::json> events;
  for (std::string line; std::getline(lines, line);) events.push_back(nlohmann::json::parse(line));
  return events;
}

TEST(Suite, EventsAreLinesOfJson) {
  TemporaryFolder folder;
  const fs::path suite = folder.path() / "suite";
  const auto run = RunProgram({"evalbus", "run", "lift_pot/base", "lift_pot/position", "--policy", "hold",
                               "--episodes", "1", "--in-process", "--json", "--quiet", "--out", suite});
  EXPECT_EQ(run.code, 0);
  EXPECT_EQ(run.err, "");
  const std::vector<nlohmann::json> events = EventsOf(run, folder.path());
  std::vector<std::string> kinds;
  for (const auto& event : events) kinds.push_back(event["event"]);
  const std::vector<std::string> of_a_run = {"begin", "episode_begin", "episode", "summary"};
  std::vector<std::string> expected = {"suite_begin"};
  for (int i = 0; i < 2; ++i) expected.insert(expected.end(), of_a_run.begin(), of_a_run.end());
  expected.emplace_back("suite_summary");
  ASSERT_EQ(kinds, expected) << run.out;
  EXPECT_EQ(events[0]["tasks"], nlohmann::json({"lift_pot/base", "lift_pot/position"}));
  for (size_t i = 1; i < 9; ++i) {
    const auto& event = events[i];
    EXPECT_EQ(event["policy"], "hold");
    EXPECT_EQ(event["task"], "lift_pot");
    EXPECT_EQ(event["variation"], i < 5 ? "base" : "position");
    const fs::path folder_of_run = event["run"].get<std::string>();
    EXPECT_EQ(folder_of_run, suite / (i < 5 ? "lift_pot-base" : "lift_pot-position"));
    if (event["event"] == "episode") {
      EXPECT_EQ(event["result"], nlohmann::json(Episodes(folder_of_run)[0]));
    } else if (event["event"] == "summary") {
      EXPECT_EQ(event["summary"], nlohmann::json::parse(ReadText(folder_of_run / "summary.json")));
    }
  }
  EXPECT_EQ(events[9]["summary"], nlohmann::json::parse(ReadText(suite / "summary.json")));
  EXPECT_EQ(SchemaError("suite", suite / "suite.json"), "");
  EXPECT_EQ(SchemaError("suite_summary", suite / "summary.json"), "");
}

TEST(Suite, StatesTheNumberOfSelectedEpisodes) {
  TemporaryFolder folder;
  const auto run =
      RunProgram({"evalbus", "run", "lift_pot/base", "lift_pot/position", "--policy", "hold", "--episodes",
                  "9", "--only", "4,4", "--in-process", "--json", "--out", folder.path() / "suite"});
  EXPECT_EQ(run.code, 0);
  EXPECT_NE(run.err.find("2 runs of 1 episode  policy hold"), std::string::npos) << run.err;
  EXPECT_EQ(EventsOf(run, folder.path()).at(0)["episodes"], 1);
}

// A plan that adds episodes until its intervals are narrow resumes its runs; events report each episode once.
TEST(Plan, EventsAreLinesOfJson) {
  TemporaryFolder folder;
  const fs::path out = folder.path() / "out", plan = folder.path() / "plan.yaml";
  const std::string task = ShortTask(folder.path(), 0.4) + "/position";
  WriteText(plan, "policies: [random, {name: still, policy: hold}]\ntasks: [" + task +
                      "]\nepisodes: 2\nuntil: width(0.1, max 4)\n");
  const auto run = RunProgram(
      {"evalbus", "run", plan, "--out", out, "--workers", "2", "--json", "--partial-hz", "10", "--quiet"});
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_EQ(run.err, "");
  const std::vector<nlohmann::json> events = EventsOf(run, folder.path());
  ASSERT_GT(events.size(), 2u);
  EXPECT_EQ(events.front()["event"], "plan_begin");
  EXPECT_EQ(events.front()["policies"], nlohmann::json({"random", "still"}));
  EXPECT_EQ(events.back()["event"], "plan_summary");
  EXPECT_EQ(events.back()["comparison"]["comparisons"][0]["name"], "still");
  std::map<std::string, std::vector<nlohmann::json>> episodes;
  std::map<std::pair<std::string, int>, std::vector<double>> partial_times;
  std::map<std::string, int> begins;
  std::map<std::string, fs::path> folder_of;
  for (size_t i = 1; i + 1 < events.size(); ++i) {
    const auto& event = events[i];
    const std::string policy = event["policy"], kind = event["event"];
    EXPECT_EQ(event["variation"], "position");
    if (kind == "begin") ++begins[policy];
    folder_of[policy] = event["run"].get<std::string>();
    if (kind == "episode") episodes[policy].push_back(event["result"]);
    if (kind == "partial") partial_times[{policy, event["episode"]}].push_back(event["time_s"]);
  }
  for (const std::string policy : {"random", "still"}) {
    SCOPED_TRACE(policy);
    EXPECT_EQ(begins[policy], 2);
    const auto recorded = Episodes(folder_of[policy]);
    ASSERT_EQ(recorded.size(), 4u);
    ASSERT_EQ(episodes[policy].size(), 4u);
    for (size_t i = 0; i < 4; ++i) {
      EXPECT_EQ(episodes[policy][i], nlohmann::json(recorded[i])) << i;
      // Partial metrics are reported ten times per second: at 50 Hz and 0.4 s, at ticks 0, 5, 10, 15 and 20.
      EXPECT_EQ(partial_times[std::pair(policy, static_cast<int>(i))],
                (std::vector<double>{0, 0.1, 0.2, 0.3, 0.4}));
    }
  }
  // The plan's `episodes` is only the number before the first look, so the maximum is shown.
  const Result status = RunProgram({"evalbus", "status", out});
  EXPECT_EQ(status.out,
            "8 of at most 8 episodes done; the plan has ended\n         4  random\n         4  still\n");
  const auto refused = RunProgram({"evalbus", "run", plan, "--out", out, "--part", "1/2", "--json"});
  EXPECT_EQ(refused.code, 1);
}

// A plan without parts does not announce its runs. The status of a plan that was stopped two hours ago must
// not claim that it will end soon.
TEST(Plan, StatusTellsTheAgeOfTheNewestResult) {
  TemporaryFolder folder;
  const fs::path out = folder.path() / "out", plan = folder.path() / "plan.yaml";
  WriteText(plan, "policies: [random, hold]\ntasks: [" + ShortTask(folder.path(), 0.1) +
                      "/position]\nepisodes: 2\n");
  ASSERT_EQ(RunProgram({"evalbus", "run", plan, "--out", out}).code, 0);
  EXPECT_THAT(RunProgram({"evalbus", "status", out}).out,
              AllOf(StartsWith("4 of 4 episodes done (100 %), "), Not(HasSubstr("newest"))));
  int files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(out)) {
    if (entry.path().filename() != "episodes.jsonl") continue;
    const std::string text = ReadText(entry.path());
    if (++files == 1) WriteText(entry.path(), text.substr(0, text.find('\n') + 1));
    fs::remove(entry.path().parent_path() / "summary.json");
    for (const fs::path& file : {entry.path(), entry.path().parent_path()})
      fs::last_write_time(file, fs::file_time_type::clock::now() - std::chrono::hours(2));
  }
  EXPECT_EQ(files, 2);
  const std::string status = RunProgram({"evalbus", "status", out}).out;
  EXPECT_THAT(status, StartsWith("3 of 4 episodes done (75 %), 0 in running shards, 0 shards failed\n"
                                 "newest result 2:0"));
  EXPECT_THAT(status, Not(HasSubstr("left")));
}

// The first shard was begun at an unknown time before it arrived, so its episodes are not part of the rate.
TEST(Plan, StatusShowsTheRateSinceTheFirstShard) {
  TemporaryFolder folder;
  const fs::path out = folder.path() / "out", plan = folder.path() / "plan.yaml";
  WriteText(plan, "policies: [random, hold, expert]\ntasks: [" + ShortTask(folder.path(), 0.1) +
                      "/position]\nepisodes: 4\n");
  const auto run = [&](const char* part) {
    ASSERT_EQ(RunProgram({"evalbus", "run", plan, "--out", out, "--part", part}).code, 0);
  };
  run("1/3");
  EXPECT_THAT(RunProgram({"evalbus", "status", out}).out, Not(HasSubstr("episodes/s")));
  for (const auto& entry : fs::directory_iterator(out / "parts")) {
    if (!fs::exists(entry.path() / "run.json")) continue;
    fs::last_write_time(entry.path() / "run.json",
                        fs::file_time_type::clock::now() - std::chrono::seconds(500));
  }
  run("2/3");
  // Without an active process, the remaining time is unknown.
  EXPECT_THAT(RunProgram({"evalbus", "status", out}).out,
              AllOf(HasSubstr("8 of 12 episodes done"), Not(HasSubstr("episodes/s"))));
  std::string marker;
  for (const auto& entry : fs::directory_iterator(out / "parts")) {
    const std::string name = entry.path().filename();
    if (name.starts_with("hold+")) marker = ".expert" + name.substr(4) + ".host-1";
  }
  ASSERT_NE(marker, "");
  WriteText(out / "parts" / marker, "");
  EXPECT_THAT(RunProgram({"evalbus", "status", out}).out,
              testing::ContainsRegex("; 0\\.00(8|7[0-9]*) episodes/s, about [89]:[0-9][0-9] min left"));
}

// Options that would have no effect are refused, because a user who passes them expects other results.
TEST(Plan, RefusesOptionsThatItSetsItself) {
  TemporaryFolder folder;
  const fs::path out = folder.path() / "out", plan = folder.path() / "plan.yaml";
  WriteText(plan, "policies: [random]\ntasks: [" + ShortTask(folder.path(), 0.1) +
                      "/position]\nepisodes: 1\noptions: {after_success_s: 0}\n");
  const auto expect = [&](const std::vector<std::string>& options, const std::string& error) {
    std::vector<std::string> command = {"evalbus", "run", plan, "--out", out};
    command.insert(command.end(), options.begin(), options.end());
    const Result result = RunProgram(command);
    EXPECT_EQ(result.code, 1);
    EXPECT_EQ(result.err, "error: " + error + "\n");
    EXPECT_FALSE(fs::exists(out));
  };
  const std::string not_with_plan =
      ": cannot be combined with a plan, whose file has the options of its runs (docs/plans.md)";
  expect({"--episodes", "5", "--video", "head"}, "--episodes, --video" + not_with_plan);
  expect({"--seed", "7"}, "--seed" + not_with_plan);
  expect({"--policy", "hold"}, "--policy" + not_with_plan);
  expect({"--web"}, "--web" + not_with_plan);
  expect({"--in-process"},
         "--in-process: not needed with a plan, which evaluates each episode in one process unless its file "
         "has the option 'engine'");
  expect({"lift_pot/position"},
         plan.string() + ": a plan cannot be combined with other tasks; its file lists its tasks");
  expect({"--partition", "cpu"}, "--partition, --time and --array-size require --slurm or --slurm-dry-run");
  EXPECT_EQ(
      RunProgram({"evalbus", "run", "lift_pot/position", "--partition", "cpu"}).err,
      "error: --part and the options of Slurm: expected a plan ('evalbus run plan.yaml', docs/plans.md)\n");
  expect({"--part", "1/2", "--slurm"},
         "--part cannot be combined with --slurm or --slurm-dry-run, which submit all parts");
  EXPECT_EQ(RunProgram({"evalbus", "run", plan, "--out", out, "--workers", "2", "--log-level", "warn"}).code,
            0);
}

TEST(Plan, ResumeStatesThatTheFolderHasNoPlan) {
  const TemporaryFolder folder;
  const fs::path out = folder.path() / "out", plan = folder.path() / "plan.yaml";
  WriteText(plan, "policies: [random]\ntasks: [" + ShortTask(folder.path(), 0.1) + "/base]\nepisodes: 1\n");
  const std::string note = out.string() + " has no run to resume: starting a new one\n";
  const Result first = RunProgram({"evalbus", "run", plan, "--out", out, "--resume"});
  EXPECT_EQ(first.code, 0) << first.err;
  EXPECT_TRUE(first.out.starts_with(note)) << first.out;
  const Result resumed = RunProgram({"evalbus", "run", plan, "--out", out, "--resume"});
  EXPECT_EQ(resumed.code, 0) << resumed.err;
  EXPECT_EQ(resumed.out.find("has no run to resume"), std::string::npos) << resumed.out;
  const Result nowhere = RunProgram({"evalbus", "run", plan, "--resume"});
  EXPECT_EQ(nowhere.code, 1);
  EXPECT_EQ(nowhere.err, "error: --resume requires --out: the folder of the plan to continue\n");
}

// A plan that cannot be completed ends before its first episode, as in `plan check` and `plan show`.
TEST(Plan, IsCheckedInTheScenesOfItsTasks) {
  TemporaryFolder folder;
  const fs::path out = folder.path() / "out", plan = folder.path() / "plan.yaml";
  WriteText(plan,
            "policies: [hold]\ntasks: [lift_pot/position]\nepisodes: 1\n"
            "video: {episodes: all, cameras: [frontt]}\n");
  const std::string problem =
      plan.string() + ":4: key 'cameras': lift_pot/position: no camera 'frontt'; did you mean 'front'?\n";
  for (const std::vector<std::string>& command :
       std::vector<std::vector<std::string>>{{"evalbus", "plan", "check", plan},
                                             {"evalbus", "run", plan, "--out", out},
                                             {"evalbus", "run", plan, "--out", out, "--part", "1/2"}}) {
    const Result result = RunProgram(command);
    EXPECT_EQ(result.code, 1);
    EXPECT_EQ(result.err, "error: " + problem);
    EXPECT_FALSE(fs::exists(out));
  }
  const Result shown = RunProgram({"evalbus", "plan", "show", plan});
  EXPECT_EQ(shown.code, 1);
  EXPECT_THAT(shown.out, testing::EndsWith("problem   " + problem));
}

TEST(Suite, ResumeRefusesToForgetRuns) {
  TemporaryFolder folder;
  const fs::path suite = folder.path() / "suite";
  const auto run = [&](const std::vector<std::string>& tasks, const std::vector<std::string>& more) {
    std::vector<std::string> command = {"evalbus", "run"};
    command.insert(command.end(), tasks.begin(), tasks.end());
    command.insert(command.end(), {"--policy", "hold", "--episodes", "1", "--in-process", "--out", suite});
    command.insert(command.end(), more.begin(), more.end());
    return RunProgram(command);
  };
  ASSERT_EQ(run({"lift_pot/base", "lift_pot/position"}, {}).code, 0);
  const auto before = Contents(suite);
  const Result others = run({"lift_pot/base", "cube_handover/base"}, {"--resume"});
  EXPECT_EQ(others.code, 1);
  EXPECT_EQ(others.err,
            "error: --resume: " + (suite / "suite.json").string() +
                ": the suite has the run lift_pot-position; also pass its task, or start another suite\n");
  const Result seed = run({"lift_pot/base", "lift_pot/position"}, {"--resume", "--seed", "4"});
  EXPECT_EQ(seed.code, 1);
  EXPECT_NE(seed.err.find("the run was made with seed 0, not 4"), std::string::npos) << seed.err;
  EXPECT_EQ(Contents(suite), before);
  // A resumed suite accepts additional tasks.
  const Result more = run({"lift_pot/base", "lift_pot/position", "cube_handover/base"}, {"--resume"});
  EXPECT_EQ(more.code, 0) << more.err;
  EXPECT_EQ(nlohmann::json::parse(ReadText(suite / "summary.json"))["all"]["episodes"], 3);
}

// Ctrl-C in a terminal signals the whole process group of the launcher.
TEST(Suite, CtrlCLeavesNoProcessAndResumeContinues) {
  TemporaryFolder folder;
  const fs::path suite = folder.path() / "suite", reference = folder.path() / "reference";
  const auto command = [](const fs::path& out) {
    return std::vector<std::string>{"evalbus",   "run", "lift_pot/all", "--episodes", "2",     "--seed", "1",
                                    "--workers", "2",   "--control-hz", "200",        "--out", out};
  };
  ASSERT_EQ(RunProgram(command(reference)).code, 0);
  {
    Program launcher(command(suite), {{}, [] { setpgid(0, 0); }});
    ASSERT_TRUE(WaitFor([&] {
      return fs::exists(suite / "lift_pot-position/episodes/0000.partial/events.lcmlog");
    })) << launcher.err();
    std::vector<pid_t> family = ChildrenOf(launcher.pid());
    EXPECT_EQ(family.size(), 2u);
    for (const pid_t run : std::vector<pid_t>(family)) {
      for (const pid_t component : ChildrenOf(run)) family.push_back(component);
    }
    ASSERT_EQ(kill(-launcher.pid(), SIGINT), 0);
    EXPECT_EQ(launcher.Wait(), 2);
    EXPECT_NE(launcher.err().find("error: stopped after "), std::string::npos) << launcher.err();
    for (const pid_t pid : family) EXPECT_EQ(kill(pid, 0), -1) << pid << " is still there";
  }
  auto resume = command(suite);
  resume.push_back("--resume");
  const auto resumed = RunProgram(resume);
  EXPECT_EQ(resumed.code, 0) << resumed.err;
  EXPECT_EQ(ReadText(suite / "summary.json"), ReadText(reference / "summary.json"));
  for (const char* run :
       {"lift_pot-base", "lift_pot-position", "lift_pot-orientation", "lift_pot-position_and_orientation"}) {
    EXPECT_EQ(ReadText(suite / run / "episodes.jsonl"), ReadText(reference / run / "episodes.jsonl")) << run;
    EXPECT_EQ(ReadText(suite / run / "summary.json"), ReadText(reference / run / "summary.json")) << run;
  }
}

}  // namespace evalbus::resume_test
