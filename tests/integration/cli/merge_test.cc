// Tests evalbus merge: the shards of a plan become the runs of the plan, or nothing is changed.
#include <cerrno>
#include <csignal>
#include <ctime>
#include <regex>
#include <sstream>

#include "base/this_process.h"
#include "bus/event_log.h"
#include "tests/integration/harness.h"

namespace evalbus::merge_test {

namespace fs = std::filesystem;

// Returns all files below a folder, with their contents.
std::map<std::string, std::string> Contents(const fs::path& folder) {
  std::map<std::string, std::string> contents;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    contents[fs::relative(entry.path(), folder)] = entry.is_regular_file() ? ReadText(entry.path()) : "";
  }
  return contents;
}

void Replace(const fs::path& file, const std::string& what, const std::string& with) {
  std::string text = ReadText(file);
  const size_t at = text.find(what);
  ASSERT_NE(at, std::string::npos) << file << ": " << what;
  WriteText(file, text.replace(at, what.size(), with));
}

// Returns the name of a process of this machine that has ended.
std::string DeadProcess() {
  Program program({"/bin/true"});
  EXPECT_EQ(program.Wait(), 0);
  const std::string self = ThisProcess();
  return self.substr(0, self.rfind('-') + 1) + std::to_string(program.pid());
}

// A plan of two policies and four episodes, evaluated in shards of two episodes.
class Merge : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    made_ = new TemporaryFolder;
    const fs::path plan = made_->path() / "plan.yaml";
    WriteText(plan, "policies: [{name: rnd, policy: random}, {name: hold, policy: hold}]\ntasks: " +
                        ShortTask(made_->path(), 0.2) +
                        "/position\nepisodes: 4\nseed: 5\nshard_episodes: 2\n");
    const Result result =
        RunProgram({"evalbus", "run", plan, "--out", made_->path() / "results", "--part", "1/1"});
    ASSERT_EQ(result.code, 0) << result.out << result.err;
  }
  static void TearDownTestSuite() {
    delete made_;
    made_ = nullptr;
  }
  void SetUp() override {
    ASSERT_TRUE(fs::exists(made_->path() / "results/plan.json"));
    fs::copy(made_->path() / "results", results_, fs::copy_options::recursive);
  }

  fs::path Part(const std::string& policy, const std::string& episodes) const {
    for (const auto& entry : fs::directory_iterator(results_ / "parts")) {
      const std::string name = entry.path().filename();
      if (name.starts_with(policy + "+") && name.ends_with("+" + episodes)) return entry.path();
    }
    ADD_FAILURE() << "no part of " << policy << ", " << episodes;
    return {};
  }
  fs::path Run(const std::string& policy) const { return OnlyRun(results_ / policy); }
  Result MergePlan() const { return RunProgram({"evalbus", "merge", results_}); }
  size_t NumParts() const {
    return static_cast<size_t>(std::distance(fs::directory_iterator(results_ / "parts"), {}));
  }
  // Expects a refusal in one line and all files unchanged.
  void ExpectRefused(const std::string& reason) const {
    const auto before = Contents(results_);
    const Result result = MergePlan();
    EXPECT_EQ(result.code, 1) << result.out;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_NE(result.err.find(reason), std::string::npos) << result.err;
    EXPECT_TRUE(before == Contents(results_));
  }
  void ExpectMerged() const {
    for (const char* policy : {"rnd", "hold"}) {
      EXPECT_EQ(Episodes(Run(policy)).size(), 4u);
      for (int episode = 0; episode < 4; ++episode)
        EXPECT_TRUE(fs::exists(evalbus::LogFile(Run(policy), episode)));
      const Result rescored = RunProgram({"evalbus", "rescore", Run(policy)});
      EXPECT_EQ(rescored.code, 0) << rescored.out << rescored.err;
    }
    EXPECT_EQ(NumParts(), 0u);
  }

  static TemporaryFolder* made_;
  TemporaryFolder folder_;
  const fs::path results_ = folder_.path() / "results";
};
TemporaryFolder* Merge::made_ = nullptr;

TEST_F(Merge, IsThePlanWithoutParts) {
  const Result merged = MergePlan();
  ASSERT_EQ(merged.code, 0) << merged.out << merged.err;
  ExpectMerged();
  const fs::path whole = folder_.path() / "whole";
  ASSERT_EQ(RunProgram({"evalbus", "run", made_->path() / "plan.yaml", "--out", whole}).code, 0);
  for (const char* policy : {"rnd", "hold"}) {
    ExpectSameScores(Run(policy), whole / policy / Run(policy).filename());
  }
  // A second merge changes nothing.
  const auto before = Contents(results_);
  ASSERT_EQ(MergePlan().code, 0);
  EXPECT_EQ(Contents(results_).size(), before.size());
}

// A merge removes the shards, so it must first copy notes, verdicts and points of no return.
TEST_F(Merge, KeepsNotesVerdictsAndPointsOfNoReturn) {
  for (const int first : {0, 2}) {
    const fs::path part = Part("rnd", first == 0 ? "0000-0001" : "0002-0003");
    const std::string episode = std::to_string(first);
    WriteText(part / "notes.json", "{\"" + episode + "\": \"odd start\"}\n");
    WriteText(
        part / "verdicts.jsonl",
        "{\"episode\": " + episode +
            ", \"operator\": \"ann\", \"verdict\": \"failure\", \"stages_reached\": null, \"rubric\": 3, "
            "\"time_utc\": \"2026-11-26T23:15:07Z\", \"place\": 0, \"order_seed\": null}\n");
    WriteText(
        part / "no_return.json",
        "{\"" + episode + "\": {\"kind\": \"lost\", \"tick\": 5, \"time_s\": 0.1, \"monotone\": true}}\n");
  }
  const Result merged = MergePlan();
  ASSERT_EQ(merged.code, 0) << merged.out << merged.err;
  ExpectMerged();
  EXPECT_EQ(nlohmann::json::parse(ReadText(Run("rnd") / "notes.json")).size(), 2u);
  EXPECT_EQ(nlohmann::json::parse(ReadText(Run("rnd") / "no_return.json")).size(), 2u);
  std::istringstream verdicts(ReadText(Run("rnd") / "verdicts.jsonl"));
  std::vector<int> judged;
  for (std::string line; std::getline(verdicts, line);)
    judged.push_back(nlohmann::json::parse(line)["episode"].get<int>());
  EXPECT_EQ(judged, (std::vector<int>{0, 2}));
}

TEST_F(Merge, RefusesAPartThatLacksEpisodes) {
  const fs::path lines = Part("rnd", "0000-0001") / "episodes.jsonl";
  const std::string text = ReadText(lines);
  WriteText(lines, text.substr(text.find('\n') + 1));
  ExpectRefused(lines.string() + ": 1 of 2 episodes, the first missing one is episode 0; remove ");
  WriteText(lines, text.substr(0, text.size() - 50));
  ExpectRefused(lines.string() +
                ": 1 of 2 episodes, the first missing one is episode 1 (line 2 is truncated)");
  fs::remove(lines);
  ExpectRefused(lines.string() + ": 0 of 2 episodes");
  WriteText(lines, text);
  ASSERT_EQ(MergePlan().code, 0);
  ExpectMerged();
}

// Machines of a cluster may have different versions of MuJoCo.
TEST_F(Merge, RefusesRunsOfTwoEngines) {
  for (const char* episodes : {"0000-0001", "0002-0003"}) {
    const fs::path file = Part("hold", episodes) / "run.json";
    auto info = nlohmann::ordered_json::parse(ReadText(file));
    info["mujoco_version"] = "9.9.9";
    WriteText(file, info.dump());
  }
  ExpectRefused(Part("hold", "0000-0001").string() + ": simulated by MuJoCo 9.9.9, but " +
                Part("rnd", "0000-0001").string() + " by MuJoCo ");
}

TEST_F(Merge, RefusesAPartWhoseLogsAreNotWhole) {
  const fs::path log = evalbus::LogFile(Part("hold", "0002-0003"), 3);
  const std::string text = ReadText(log);
  fs::remove(log);
  ExpectRefused(log.string() + ": cannot read the log: No such file");
  for (const size_t size : {size_t{0}, text.size() / 2, text.size() - 1}) {
    WriteText(log, text.substr(0, size));
    ExpectRefused(log.string() + ": ");
  }
  // The log lacks whole events, at its end or in its middle, so every remaining byte is intact.
  std::vector<size_t> begins = {0};
  EventLogReader reader(made_->path() / "results" / fs::relative(log, results_));
  for (LogEvent event; reader.Next(&event);) {
    begins.push_back(begins.back() + 28 + event.channel.size() + event.data.size());
  }
  const size_t middle = begins.size() / 2;
  WriteText(log, text.substr(0, begins[middle]));
  ExpectRefused(log.string() + ": no EPISODE_SUMMARY of episode 3");
  WriteText(log, text.substr(0, begins[middle]) + text.substr(begins[middle + 1]));
  ExpectRefused(log.string() + ": event " + std::to_string(middle) + " is missing");
  // The log is complete but belongs to another episode or another policy.
  WriteText(log, ReadText(evalbus::LogFile(Part("hold", "0002-0003"), 2)));
  ExpectRefused(log.string() + ": no EPISODE_SUMMARY of episode 3");
  WriteText(log, ReadText(evalbus::LogFile(Part("rnd", "0002-0003"), 3)));
  ExpectRefused(log.string() + ": does not match line 2 of episodes.jsonl: ");
  WriteText(log, text);
  const fs::path lines = Part("hold", "0002-0003") / "episodes.jsonl";
  const std::string original = ReadText(lines);
  // Changes the parameter of both lines.
  WriteText(lines, std::regex_replace(original, std::regex("\"pot_x_m\":0"), "\"pot_x_m\":9"));
  ExpectRefused(": does not match line 1 of episodes.jsonl: parameters.pot_x_m ");
  WriteText(lines, original);
  ASSERT_EQ(MergePlan().code, 0);
  ExpectMerged();
}

TEST_F(Merge, RefusesPartsOfAnotherPolicy) {
  for (const char* episodes : {"0000-0001", "0002-0003"}) {
    const fs::path part = Part("hold", episodes);
    fs::remove_all(part);
    fs::copy(Part("rnd", episodes), part, fs::copy_options::recursive);
  }
  ExpectRefused("/run.json: \"policy\" is \"random\", but \"hold\" in plan.json");
}

TEST_F(Merge, RefusesPartsOfOtherEpisodes) {
  const fs::path part = Part("hold", "0002-0003");
  fs::remove_all(part);
  fs::copy(Part("hold", "0000-0001"), part, fs::copy_options::recursive);
  ExpectRefused("episode 0 does not belong to this shard, which has 2 to 3");
}

TEST_F(Merge, RefusesPartsOfAnotherPlan) {
  Replace(results_ / "plan.json", "\"seed\": 5", "\"seed\": 6");
  ExpectRefused("/run.json: \"seed\" is 5, but 6 in plan.json");
  Replace(results_ / "plan.json", "\"seed\": 6", "\"seed\": 5");
  Replace(results_ / "plan.json", "\"control_hz\": 50.0", "\"control_hz\": 100.0");
  ExpectRefused("/run.json: \"control_hz\" is 50.0, expected 100 as in plan.json");
  Replace(results_ / "plan.json", "\"control_hz\": 100.0", "\"control_hz\": 50.0");
  Replace(results_ / "plan.json", "\"after_success_s\": 0.0", "\"after_success_s\": 1.0");
  ExpectRefused("/run.json: \"after_success_s\" is 0.0, but 1.0 in plan.json");
  Replace(results_ / "plan.json", "\"after_success_s\": 1.0", "\"after_success_s\": 0.0");
  ASSERT_EQ(MergePlan().code, 0);
  // Merged runs of another plan are also refused.
  Replace(results_ / "plan.json", "\"seed\": 5", "\"seed\": 6");
  ExpectRefused("/run.json: \"seed\" is 5, but 6 in plan.json");
}

// If the merged run has a different evaluation of a shard's episodes, the merge is refused and the shard is
// kept.
TEST_F(Merge, RemovesOnlyWhatItCounted) {
  const fs::path part = Part("rnd", "0000-0001"), copy = folder_.path() / "copy";
  fs::copy(part, copy, fs::copy_options::recursive);
  ASSERT_EQ(MergePlan().code, 0);
  fs::copy(copy, part, fs::copy_options::recursive);
  Replace(part / "episodes.jsonl", "\"end_detail\":\"\"", "\"end_detail\":\"by another run\"");
  ExpectRefused("its episode 0 is different");
  fs::remove_all(part);
  // A shard that equals the merged episodes may be removed.
  fs::copy(copy, part, fs::copy_options::recursive);
  ASSERT_EQ(MergePlan().code, 0);
  ExpectMerged();
}

// An interrupted 'evalbus run PLAN' also leaves a summary.
TEST_F(Merge, ARunThatLacksEpisodesIsNotWhole) {
  ASSERT_EQ(MergePlan().code, 0);
  const fs::path lines = Run("rnd") / "episodes.jsonl";
  const std::string text = ReadText(lines);
  WriteText(lines, text.substr(0, text.find('\n') + 1));
  const std::string reason = ": 1 of 4 episodes, of a run without --part that was interrupted";
  ExpectRefused(reason);
  for (const std::vector<std::string>& options :
       std::vector<std::vector<std::string>>{{"--part", "1/1"}, {"--slurm-dry-run", "--array-size", "1"}}) {
    std::vector<std::string> command = {"evalbus", "run", made_->path() / "plan.yaml", "--out", results_};
    command.insert(command.end(), options.begin(), options.end());
    const Result result = RunProgram(command);
    EXPECT_EQ(result.code, 1) << result.out;
    EXPECT_NE(result.err.find(reason), std::string::npos) << result.err;
  }
  const std::string status = RunProgram({"evalbus", "status", results_}).out;
  EXPECT_NE(status.find("5 of 8 episodes done"), std::string::npos) << status;
}

// The disk is full for one of the shards, which is not a reason to stop the others.
TEST_F(Merge, AShardThatWaitsForRoomDelaysNoOther) {
  if (kIsSanitized) GTEST_SKIP() << "a sanitizer must be the first library of a process";
  const std::string waiting = Part("rnd", "0000-0001").filename();
  const fs::path out = folder_.path() / "again", parts = out / "parts";
  const std::vector<std::string> command = {
      "evalbus", "run", made_->path() / "plan.yaml", "--out", out, "--part", "1/1", "--workers", "2"};
  Program part(command, {{}, [&] {
                           setenv("LD_PRELOAD", FAILING_CALLS, 1);
                           setenv("FAILING_CALL", ("rename:1:" + std::to_string(ENOSPC) + "+").c_str(), 1);
                           setenv("FAILING_BELOW", (parts / waiting).c_str(), 1);
                         }});
  EXPECT_TRUE(WaitFor([&] {
    return fs::exists(parts / Part("rnd", "0002-0003").filename()) &&
           fs::exists(parts / Part("hold", "0000-0001").filename()) &&
           fs::exists(parts / Part("hold", "0002-0003").filename());
  })) << part.out();
  EXPECT_FALSE(fs::exists(parts / waiting));
  part.Signal(SIGINT);
  EXPECT_EQ(part.Wait(), 2);
  EXPECT_NE(part.out().find(waiting + ": "), std::string::npos) << part.out();
  EXPECT_NE(part.out().find(": retrying"), std::string::npos) << part.out();
  EXPECT_EQ(part.err(), "error: stopped; run the same command again to resume\n");
  const Result resumed = RunProgram(command);
  EXPECT_EQ(resumed.code, 0) << resumed.err;
  EXPECT_TRUE(fs::exists(parts / waiting));
}

TEST_F(Merge, WhatAKilledMergeLeftIsGoneAfterTheNext) {
  if (kIsSanitized) GTEST_SKIP() << "a sanitizer must be the first library of a process";
  const auto kill_at = [&](const std::string& call, int number) {
    return RunProgram({"evalbus", "merge", results_},
                      {{}, [&] {
                         setenv("LD_PRELOAD", FAILING_CALLS, 1);
                         setenv("FAILING_CALL", (call + ":" + std::to_string(number) + ":kill").c_str(), 1);
                         setenv("FAILING_BELOW", results_.c_str(), 1);
                       }});
  };
  // Kills the merge while it links logs of the second run, and before suite.json has its final name.
  for (const auto& [call, number] : {std::pair("link", 5), std::pair("link", 10), std::pair("rename", 5)}) {
    EXPECT_EQ(kill_at(call, number).code, 128 + SIGKILL) << call << number;
  }
  const auto count = [&] {
    int left = 0;
    for (const auto& [name, text] : Contents(results_)) {
      const std::string file = fs::path(name).filename();
      left += file.ends_with(".tmp") || file.starts_with(".");
    }
    return left;
  };
  ASSERT_GE(count(), 1);
  const Result merged = MergePlan();
  ASSERT_EQ(merged.code, 0) << merged.out << merged.err;
  EXPECT_EQ(count(), 0);
  ExpectMerged();
}

// Machines share the folder, so files that another machine may be using are kept.
TEST_F(Merge, LeavesWhatALivingMergeMayNeed) {
  ASSERT_FALSE(Part("rnd", "0000-0001").empty());
  const std::string name = Part("rnd", "0000-0001").filename();
  const std::string of_run =
      "." + name.substr(name.find('+') + 1, name.rfind('+') - name.find('+') - 1) + ".";
  // Without this shard the merge fails and creates no run. An existing run would show that other merges of it
  // have ended.
  fs::remove_all(Part("rnd", "0002-0003"));
  const fs::path policy = results_ / "rnd";
  fs::create_directories(policy);
  const std::string alive = ThisProcess(), dead = DeadProcess(), other = "node7.lab-1";
  for (const std::string& process : {alive, dead, other, std::string("node8-1")})
    fs::create_directories(policy / (of_run + process) / "episodes");
  const auto long_ago = fs::file_time_type::clock::now() - std::chrono::hours(25);
  fs::last_write_time(policy / (of_run + "node8-1"), long_ago);
  WriteText(policy / "suite.json.node7_lab-1.tmp", "half");
  WriteText(policy / "suite.json.node8-1.tmp", "half");
  fs::last_write_time(policy / "suite.json.node8-1.tmp", long_ago);
  WriteText(policy / ("summary.json." + dead + ".tmp"), "half");
  WriteText(policy / "notes.tmp", "mine");
  EXPECT_EQ(MergePlan().code, 2);
  std::set<std::string> left;
  for (const auto& entry : fs::directory_iterator(policy)) left.insert(entry.path().filename());
  EXPECT_EQ(left, (std::set<std::string>{of_run + alive, of_run + other, "suite.json.node7_lab-1.tmp",
                                         "notes.tmp"}));
}

TEST_F(Merge, MergesAtTheSameTimeAreAsOne) {
  for (int i = 0; i < 2; ++i) {
    std::vector<std::unique_ptr<Program>> merges;
    for (int k = 0; k < 3; ++k)
      merges.push_back(std::make_unique<Program>(std::vector<std::string>{"evalbus", "merge", results_}));
    for (const auto& merge : merges) EXPECT_EQ(merge->Wait(), 0) << merge->err();
    ExpectMerged();
    fs::remove_all(results_);
    SetUp();
  }
}

TEST_F(Merge, ByHandChecksTheLogs) {
  const fs::path a = Part("rnd", "0000-0001"), b = Part("rnd", "0002-0003"), out = folder_.path() / "whole";
  const fs::path log = evalbus::LogFile(b, 2);
  const std::string text = ReadText(log);
  WriteText(log, text.substr(0, text.size() / 2));
  const Result refused = RunProgram({"evalbus", "merge", out, a, b});
  EXPECT_EQ(refused.code, 1);
  EXPECT_NE(refused.err.find(log.string() + ": "), std::string::npos) << refused.err;
  EXPECT_FALSE(fs::exists(out));
  WriteText(log, text);
  EXPECT_EQ(RunProgram({"evalbus", "merge", out, a, b}).code, 0);
  EXPECT_EQ(Episodes(out).size(), 4u);
}

// A contract may have named its training sets only for one of the parts.
TEST_F(Merge, RefusesAPartWithAnotherKeyInAnyOrder) {
  const fs::path a = Part("rnd", "0000-0001"), b = Part("rnd", "0002-0003"), out = folder_.path() / "whole";
  auto info = nlohmann::ordered_json::parse(ReadText(b / "run.json"));
  info["trained_on"] = {{"sets", {"demos"}}};
  WriteText(b / "run.json", info.dump());
  for (const auto& [first, second] : {std::pair(a, b), std::pair(b, a)}) {
    const Result refused = RunProgram({"evalbus", "merge", out, first, second});
    EXPECT_EQ(refused.code, 1);
    EXPECT_TRUE(refused.err.starts_with("error: " + (second / "run.json").string() + ": \"trained_on\" is "))
        << refused.err;
    EXPECT_FALSE(fs::exists(out));
  }
}

TEST_F(Merge, RefusesPartsWithOtherForceLimits) {
  const fs::path task = ShortTask(folder_.path(), 0.2), limits = folder_.path() / "limits.yaml",
                 a = folder_.path() / "a", b = folder_.path() / "b", out = folder_.path() / "whole";
  const auto evaluate = [&](const fs::path& run, const std::string& only, const std::string& force_N) {
    WriteText(limits, "limits: {pot: {bodies: [pot], grip_force_N: " + force_N + "}}\n");
    Evaluate(
        {task, "--policy", "hold", "--episodes", "2", "--only", only, "--in-process", "--limits", limits},
        run);
  };
  evaluate(a, "0", "20");
  evaluate(b, "1", "30");
  const Result refused = RunProgram({"evalbus", "merge", out, a, b});
  EXPECT_EQ(refused.code, 1);
  EXPECT_TRUE(refused.err.starts_with("error: " + (b / "run.json").string() + ": \"limits_sha256\" is "))
      << refused.err;
  EXPECT_EQ(std::count(refused.err.begin(), refused.err.end(), '\n'), 1) << refused.err;
  EXPECT_FALSE(fs::exists(out));
  // The logs also contain the limits.
  auto info = nlohmann::ordered_json::parse(ReadText(b / "run.json"));
  info["limits_sha256"] = nlohmann::json::parse(ReadText(a / "run.json"))["limits_sha256"];
  WriteText(b / "run.json", info.dump());
  const Result forged = RunProgram({"evalbus", "merge", out, a, b});
  EXPECT_EQ(forged.code, 1);
  EXPECT_NE(forged.err.find("run.json: limits_sha256 is "), std::string::npos) << forged.err;
  evaluate(folder_.path() / "c", "1", "20");
  const Result merged = RunProgram({"evalbus", "merge", out, a, folder_.path() / "c"});
  EXPECT_EQ(merged.code, 0) << merged.err;
}

}  // namespace evalbus::merge_test
