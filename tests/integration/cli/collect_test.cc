// Tests that evalbus collect keeps only successes, and that its result depends neither on the number of
// processes nor on interruptions.
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>

#include "base/random.h"
#include "tests/integration/harness.h"

namespace evalbus::collect_test {

namespace fs = std::filesystem;

class Collect : public testing::Test {
 protected:
  // The noise is so strong that some episodes fail.
  std::vector<std::string> Command(const fs::path& out, const std::vector<std::string>& options) const {
    std::vector<std::string> command = {"evalbus",  "collect", "lift_pot/position", "--episodes", "3",
                                        "--policy", "expert",  "--noise",           "0.17",       "--out",
                                        out};
    command.insert(command.end(), options.begin(), options.end());
    return command;
  }
  static auto Lines(const fs::path& run) {
    const std::string text = fs::exists(run / "episodes.jsonl") ? ReadText(run / "episodes.jsonl") : "";
    return std::count(text.begin(), text.end(), '\n');
  }
  void ExpectEqual(const fs::path& run) const {
    for (const char* file : {"episodes.jsonl", "summary.json", "collect.json"}) {
      EXPECT_EQ(ReadText(run / file), ReadText(reference_ / file)) << file;
    }
  }

  const TemporaryFolder folder_;
  const fs::path reference_ = folder_.path() / "reference", run_ = folder_.path() / "run";
};

constexpr int kNumTried = 7;
constexpr char kYield[] = "kept 3 of 3 requested, 7 attempted: yield 42.9 %";

int CountOf(const std::string& part, const std::string& text) {
  int count = 0;
  for (size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

TEST_F(Collect, KeepsSuccessesAndIsTheSameHoweverItIsMade) {
  const Result reference = RunProgram(Command(reference_, {"--in-process"}));
  ASSERT_EQ(reference.code, 0) << reference.err;
  EXPECT_NE(reference.out.find(kYield), std::string::npos) << reference.out;
  // Each episode is printed once. No success rate is printed, because a collection contains only successes.
  EXPECT_EQ(CountOf("  success  ", reference.out), 3) << reference.out;
  EXPECT_EQ(CountOf("\nnot kept        ", reference.out), 1) << reference.out;
  EXPECT_EQ(CountOf("Success in ", reference.out), 0) << reference.out;
  ASSERT_EQ(Lines(reference_), 3);
  for (const auto& episode : Episodes(reference_)) EXPECT_EQ(episode["metrics"]["success"], 1.0);
  const fs::directory_iterator kept(reference_ / "episodes");
  EXPECT_EQ(std::distance(begin(kept), end(kept)), 3);

  // A merged run has no collect.json, so its successes would look like the rate of a policy.
  const fs::path merged = folder_.path() / "merged";
  const Result refused = RunProgram({"evalbus", "merge", merged, reference_});
  EXPECT_EQ(refused.code, 1);
  EXPECT_EQ(refused.err,
            "error: " + reference_.string() +
                ": collected demonstrations: only successes were kept, so they cannot be merged\n");
  EXPECT_FALSE(fs::exists(merged));
  // The seeds come from the seed stream of collections, which no run uses.
  EXPECT_EQ(SchemaError("collect", reference_ / "collect.json"), "");
  const auto summary = nlohmann::json::parse(ReadText(reference_ / "collect.json"));
  EXPECT_EQ(summary["seed"], 0);
  EXPECT_EQ(summary["seed_stream"], kCollectSeeds);
  std::string numbers;
  for (const auto& episode : Episodes(reference_)) {
    const int number = episode["episode"];
    numbers += (numbers.empty() ? "" : ",") + std::to_string(number);
    EXPECT_EQ(episode["seed"], (SeedSource{0, kCollectSeeds, "lift_pot", "position"}.OfEpisode(number)));
    EXPECT_NE(episode["seed"], (SeedSource{0, kRunSeeds, "lift_pot", "position"}.OfEpisode(number)));
  }
  // Only a replay of the collected episodes uses their seeds.
  const fs::path replayed = folder_.path() / "replayed";
  Evaluate({"lift_pot/position", "--policy", "replay:" + reference_.string(), "--episodes", "24", "--only",
            numbers, "--in-process"},
           replayed);
  EXPECT_EQ(ReadText(replayed / "episodes.jsonl"), ReadText(reference_ / "episodes.jsonl"));
  EXPECT_EQ(RunProgram({"evalbus", "rescore", reference_}).code, 0);

  const Result workers = RunProgram(Command(run_, {"--workers", "2"}));
  EXPECT_EQ(workers.code, 0) << workers.err;
  ExpectEqual(run_);

  const fs::path resumed = folder_.path() / "resumed";
  {
    Program interrupted(Command(resumed, {"--in-process"}));
    ASSERT_TRUE(WaitFor([&] { return Lines(resumed) > 0; }));
    interrupted.Signal(SIGINT);
    EXPECT_EQ(interrupted.Wait(), 2);
    EXPECT_NE(interrupted.err().find("to resume, run the same command with --out " + resumed.string() +
                                     " --resume"),
              std::string::npos)
        << interrupted.err();
  }
  const Result rest = RunProgram(Command(resumed, {"--in-process", "--resume"}));
  EXPECT_EQ(rest.code, 0) << rest.err;
  ExpectEqual(resumed);

  // Resuming a complete collection succeeds, which ends a shell loop that repeats the command until it
  // succeeds.
  const Result again = RunProgram(Command(resumed, {"--in-process", "--resume"}));
  EXPECT_EQ(again.code, 0) << again.err;
  EXPECT_NE(again.out.find(kYield), std::string::npos) << again.out;
  ExpectEqual(resumed);
  // Resuming with different options is refused.
  const Result of_other_seed = RunProgram(Command(resumed, {"--in-process", "--resume", "--seed", "1"}));
  EXPECT_EQ(of_other_seed.code, 1);
  EXPECT_NE(of_other_seed.err.find("the run was made with seed 0, not 1"), std::string::npos)
      << of_other_seed.err;
  std::vector<std::string> more = Command(resumed, {"--in-process", "--resume"});
  *(std::ranges::find(more, "--episodes") + 1) = "4";
  const Result of_more = RunProgram(more);
  EXPECT_EQ(of_more.code, 1);
  EXPECT_NE(of_more.err.find("was collected with --episodes 3, not 4"), std::string::npos) << of_more.err;
  ExpectEqual(resumed);
}

TEST_F(Collect, TakesOneTaskWithOneVariation) {
  for (const std::string tasks : {"lift_pot/all", "all", "lift_pot/position,stack_two_blocks/position"}) {
    const fs::path out = folder_.path() / "several";
    const Result result = RunProgram({"evalbus", "collect", tasks, "--episodes", "1", "--out", out});
    EXPECT_EQ(result.code, 1);
    EXPECT_EQ(result.err,
              "error: collect: expected one task with one variation, such as lift_pot/position, not '" +
                  tasks + "'\n");
  }
}

TEST_F(Collect, KilledAtItsEndIsCompletedByResume) {
  if (kIsSanitized) GTEST_SKIP() << "a sanitizer must be the first library of a process";
  const auto collect = [&](const fs::path& out, const std::string& call) {
    return RunProgram(Command(out, {"--in-process", "--resume"}),
                      {{}, [&] {
                         setenv("LD_PRELOAD", FAILING_CALLS, 1);
                         setenv("FAILING_CALL", call.c_str(), 1);
                         setenv("FAILING_BELOW", folder_.path().c_str(), 1);
                         setenv("COUNTED_CALLS", (folder_.path() / "calls").c_str(), 1);
                       }});
  };
  ASSERT_EQ(collect(reference_, "rename:0:kill").code, 0);
  int renames = 0;
  ASSERT_EQ(std::sscanf(ReadText(folder_.path() / "calls").c_str(), "rename %d", &renames), 1);
  // The last six renames happen at the end: episodes.jsonl three times, summary.json twice, collect.json
  // once.
  const fs::path at_the_end = folder_.path() / "at_the_end";
  ASSERT_EQ(collect(at_the_end, "rename:" + std::to_string(renames - 5) + ":kill").code, 128 + SIGKILL);
  EXPECT_EQ(Lines(at_the_end), kNumTried);
  int kills = 0;
  for (bool is_killed = true; is_killed; kills += is_killed) {
    SCOPED_TRACE(kills);
    const fs::path run = folder_.path() / std::to_string(kills);
    fs::copy(at_the_end, run, fs::copy_options::recursive);
    const int code = collect(run, "rename:" + std::to_string(kills + 1) + ":kill").code;
    is_killed = code == 128 + SIGKILL;
    ASSERT_TRUE(is_killed || code == 0);
    const Result rest = collect(run, "rename:0:kill");
    EXPECT_EQ(rest.code, 0) << rest.err;
    EXPECT_NE(rest.out.find(kYield), std::string::npos) << rest.out;
    ExpectEqual(run);
    const fs::directory_iterator kept(run / "episodes");
    EXPECT_EQ(std::distance(begin(kept), end(kept)), 3);
  }
  EXPECT_GE(kills, 6);
}

TEST_F(Collect, UsesTheBusOfTheEnvironmentInAllRounds) {
  EVALBUS_NEEDS_BUS();
  const std::string url = UniqueUrl();
  const Result result =
      RunProgram({"evalbus", "collect", ShortTask(folder_.path(), 0.2), "--policy", "hold", "--episodes", "1",
                  "--out", run_},
                 {.working_folder = {}, .before = [&] { setenv("EVALBUS_URL", url.c_str(), 1); }});
  EXPECT_EQ(result.code, 2);
  EXPECT_EQ(CountOf(", attempt 8 of 8\n", result.out), 1) << result.out << result.err;
  // A round prints its bus only if the user did not select one.
  EXPECT_EQ(CountOf("bus udpm://", result.out), 0) << result.out;
}

}  // namespace evalbus::collect_test
