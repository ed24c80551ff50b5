// A seed has one result, whatever processes the run has and whatever load is on the machine.
#include <signal.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <atomic>

#include "bus/channels.h"
#include "evalbus/episode_summary_t.hpp"
#include "evalbus/run_summary_t.hpp"
#include "tests/integration/harness.h"

namespace evalbus::reproducible_test {

namespace fs = std::filesystem;

// Keeps one core busy.
class Spinner {
 public:
  Spinner() : pid_(fork()) {
    if (pid_ != 0) return;
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    for (std::atomic<unsigned> i = 0;; ++i) {
    }
  }
  ~Spinner() { kill(pid_, SIGKILL); }
  Spinner(const Spinner&) = delete;
  Spinner& operator=(const Spinner&) = delete;

 private:
  pid_t pid_;
};

class Reproducible : public testing::TestWithParam<const char*> {
 protected:
  static constexpr int kEpisodes = 2;

  void SetUp() override { Run("reference", {"--in-process"}); }

  std::vector<std::string> Arguments(const std::vector<std::string>& more) const {
    std::vector<std::string> arguments = {
        task_, "--policy", "noisy_expert", "--episodes", std::to_string(kEpisodes), "--seed", "4"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }
  void Run(const std::string& name, const std::vector<std::string>& more) {
    Evaluate(Arguments(more), folder_.path() / name);
  }
  void ExpectAsReference(const std::string& name) {
    SCOPED_TRACE(name);
    ExpectSameScores(folder_.path() / name, reference_);
    for (int i = 0; i < kEpisodes; ++i) {
      ExpectSameTicks(ReadLog(LogFile(folder_.path() / name, i)), ReadLog(LogFile(reference_, i)));
    }
  }

  run_summary_t RunSummaryOf(const std::string& name, int episode) {
    return ReadLog(LogFile(folder_.path() / name, episode)).Messages(channels::kRunSummary).at(0);
  }

  TemporaryFolder folder_;
  const std::string task_ = ShortTask(folder_.path(), 2, GetParam());
  const fs::path reference_ = folder_.path() / "reference";
};

TEST_P(Reproducible, OneProcessWithVideosOrWithWorkers) {
  Run("with_video", {"--in-process", "--video", "front"});
  ExpectAsReference("with_video");
  Run("workers", {"--in-process", "--workers", "2"});
  ExpectAsReference("workers");
  // The RUN_SUMMARY of each worker covers the worker's own episodes and lists them.
  for (int i = 0; i < kEpisodes; ++i) {
    EXPECT_FALSE(RunSummaryOf("reference", i).is_part);
    EXPECT_EQ(RunSummaryOf("reference", i).num_episodes, i + 1);
    EXPECT_TRUE(RunSummaryOf("workers", i).is_part);
    EXPECT_EQ(RunSummaryOf("workers", i).num_episodes, 1);
  }
}

TEST_P(Reproducible, ProcessesOnAnIdleOrABusyMachine) {
  EVALBUS_NEEDS_BUS();
  Run("idle", {});
  ExpectAsReference("idle");
  Run("workers", {"--workers", "2"});
  ExpectAsReference("workers");
  const Spinner spinners[4];
  Run("busy", {});
  ExpectAsReference("busy");
}

TEST_P(Reproducible, AnEpisodeAloneAndTheOthersLater) {
  const fs::path run = folder_.path() / "alone";
  Run("alone", {"--in-process", "--only", "1"});
  const auto alone = Episodes(run);
  ASSERT_EQ(alone.size(), 1u);
  EXPECT_EQ(alone[0].dump(), Episodes(reference_)[1].dump());
  ExpectSameTicks(ReadLog(LogFile(run, 1)), ReadLog(LogFile(reference_, 1)));
  Run("alone", {"--in-process", "--resume"});
  ExpectAsReference("alone");
  EXPECT_TRUE(RunSummaryOf("alone", 0).is_part);
}

TEST_P(Reproducible, WithoutRecorder) {
  EVALBUS_NEEDS_BUS();
  const std::string url = UniqueUrl();
  std::vector<std::vector<uint8_t>> states;
  int episodes = 0;
  Bus bus(url);
  bus.SubscribeRaw(channels::kState.name, [&](std::string_view, std::span<const uint8_t> data, int64_t) {
    if (episodes == 0) states.emplace_back(data.begin(), data.end());
  });
  bus.Subscribe(channels::kEpisodeSummary, [&](const episode_summary_t&) { ++episodes; });
  Program collision({"evalbus-collision", "--url", url}), metrics({"evalbus-metrics", "--url", url}),
      policy({"evalbus-policy", "--policy", "noisy_expert", "--url", url});
  Program sim({"evalbus-sim", task_, "--out", folder_.path() / "sim", "--url", url, "--episodes", "1",
               "--seed", "4"});
  ASSERT_TRUE(WaitFor([&] {
    while (bus.Handle()) {
    }
    return episodes > 0;
  }));
  EXPECT_EQ(states, ReadLog(LogFile(reference_, 0)).Payloads(channels::kState));
}

INSTANTIATE_TEST_SUITE_P(Tasks, Reproducible, testing::Values("lift_pot", "stack_two_blocks"),
                         [](const auto& test) { return std::string(test.param); });

TEST(RecordedActions, DoTheSameInTheirWorldAndAreRefusedInAnother) {
  TemporaryFolder folder;
  const std::string task = ShortTask(folder.path(), 1);
  const fs::path recorded = folder.path() / "recorded", again = folder.path() / "again",
                 other = folder.path() / "other";
  Evaluate({task + "/position", "--policy", "noisy_expert", "--episodes", "2", "--in-process"}, recorded);
  const std::string actions = ":" + recorded.string();
  Evaluate({task + "/position", "--policy", "replay" + actions, "--episodes", "2", "--in-process"}, again);
  ExpectSameScores(again, recorded);
  for (int i = 0; i < 2; ++i) ExpectSameTicks(ReadLog(LogFile(again, i)), ReadLog(LogFile(recorded, i)));

  const Result refused = RunProgram({"evalbus", "run", task + "/base", "--policy", "replay" + actions,
                                     "--episodes", "2", "--in-process", "--out", other});
  EXPECT_EQ(refused.code, 1);
  EXPECT_NE(refused.err.find("was recorded with variation position, not base;"), std::string::npos)
      << refused.err;
  EXPECT_FALSE(fs::exists(other));
  Evaluate({task + "/base", "--policy", "replay_anyway" + actions, "--episodes", "2", "--in-process"}, other);
}

TEST(Only, RefusesAnEpisodeThatTheRunDoesNotHave) {
  TemporaryFolder folder;
  const Result result =
      RunProgram({"evalbus", "run", "lift_pot", "--only", "0,10", "--out", folder.path() / "run"});
  EXPECT_EQ(result.code, 1);
  EXPECT_EQ(result.err, "error: --only 10: expected 0 to 9, since --episodes is 10\n");
}

}  // namespace evalbus::reproducible_test
