// evalbus collect: successes only, the same however they are made, also after an interruption.
#include <algorithm>
#include <csignal>

#include "base/random.h"
#include "tests/integration/harness.h"

namespace evalbus::collect_test {

namespace fs = std::filesystem;

class Collect : public testing::Test {
 protected:
  // So noisy that some starts fail.
  std::vector<std::string> Command(const fs::path& out, const std::vector<std::string>& options) const {
    std::vector<std::string> command = {"evalbus",  "collect", "lift_pot/position", "--episodes", "3",
                                        "--policy", "expert",  "--noise",           "0.15",       "--out",
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

int CountOf(const std::string& part, const std::string& text) {
  int count = 0;
  for (size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

TEST_F(Collect, KeepsSuccessesAndIsTheSameHoweverItIsMade) {
  const Result reference = RunProgram(Command(reference_, {"--in-process"}));
  ASSERT_EQ(reference.code, 0) << reference.err;
  EXPECT_NE(reference.out.find("kept 3 of 3 wanted, of 4 tried: yield 75.0 %"), std::string::npos)
      << reference.out;
  // Each episode is told once; a rate of starts that were chosen is none.
  EXPECT_EQ(CountOf("  success  ", reference.out), 3) << reference.out;
  EXPECT_EQ(CountOf("\nnot kept        ", reference.out), 1) << reference.out;
  EXPECT_EQ(CountOf("Success in ", reference.out), 0) << reference.out;
  ASSERT_EQ(Lines(reference_), 3);
  for (const auto& episode : Episodes(reference_)) EXPECT_EQ(episode["metrics"]["success"], 1.0);
  const fs::directory_iterator kept(reference_ / "episodes");
  EXPECT_EQ(std::distance(begin(kept), end(kept)), 3);

  // No run starts where these did.
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
  // Only what replays them.
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
    EXPECT_NE(interrupted.err().find(" --resume goes on"), std::string::npos) << interrupted.err();
  }
  const Result rest = RunProgram(Command(resumed, {"--in-process", "--resume"}));
  EXPECT_EQ(rest.code, 0) << rest.err;
  ExpectEqual(resumed);

  const Result again = RunProgram(Command(resumed, {"--in-process", "--resume"}));
  EXPECT_EQ(again.code, 1);
  EXPECT_EQ(again.err, "error: --resume: " + resumed.string() + ": is complete\n");
  ExpectEqual(resumed);
}

}  // namespace evalbus::collect_test
