// Tests that logs are compared with the results next to them: rescoring reports modified results, and
// replaying reports what it cannot play.
#include <signal.h>

#include <algorithm>

#include "bus/event_log.h"
#include "tests/integration/harness.h"

namespace evalbus::kept_results_test {

namespace fs = std::filesystem;

#define EXPECT_SAYS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

class Kept : public testing::Test {
 protected:
  void SetUp() override {
    Evaluate({ShortTask(folder_.path(), 0.4), "--policy", "random", "--episodes", "3", "--in-process"}, run_);
  }
  Result Rescore(const fs::path& what) { return RunProgram({"evalbus", "rescore", what}); }
  void ReplaceInLines(const std::string& what, const std::string& with) {
    std::string lines = ReadText(run_ / "episodes.jsonl");
    const size_t at = lines.find(what);
    ASSERT_NE(at, std::string::npos);
    WriteText(run_ / "episodes.jsonl", lines.replace(at, what.size(), with));
  }

  TemporaryFolder folder_;
  const fs::path run_ = folder_.path() / "run";
};

TEST_F(Kept, WhatIsAsItWasIsEqual) {
  const Result result = Rescore(run_);
  EXPECT_EQ(result.code, 0) << result.out << result.err;
  EXPECT_EQ(result.out.find("episodes.jsonl"), std::string::npos) << result.out;
}

TEST_F(Kept, AnEditedResultIsReported) {
  const std::string lines = ReadText(run_ / "episodes.jsonl");
  const size_t end = lines.find('\n');
  auto line = nlohmann::ordered_json::parse(lines.substr(0, end));
  const std::string reason = line["failure_reason"];
  ASSERT_NE(reason, "");
  line["failure_reason"] = "";
  line["metrics"]["success"] = 1.0;
  WriteText(run_ / "episodes.jsonl", line.dump() + lines.substr(end));
  const Result result = Rescore(run_);
  EXPECT_EQ(result.code, 2) << result.out;
  EXPECT_SAYS(result.out, "         episodes.jsonl differs: failure_reason \"\" -> \"" + reason +
                              "\", metrics.success 1.0 -> 0.0\n");
  EXPECT_SAYS(result.out, "1 of 3 episodes differ between episodes.jsonl and their logs");
  EXPECT_SAYS(result.out, "3 of 3 episodes have scores bit-identical to the recorded ones");
}

TEST_F(Kept, AMissingLineIsReported) {
  const std::string lines = ReadText(run_ / "episodes.jsonl");
  WriteText(run_ / "episodes.jsonl", lines.substr(lines.find('\n') + 1));
  const Result result = Rescore(run_);
  EXPECT_EQ(result.code, 2) << result.out;
  EXPECT_SAYS(result.out, "         episodes.jsonl has no line for this episode");
}

TEST_F(Kept, AMissingLogIsReported) {
  fs::remove(LogFile(run_, 1));
  const Result result = Rescore(run_);
  EXPECT_EQ(result.code, 2) << result.out;
  EXPECT_SAYS(result.out, LogFile(run_, 1).string() + ": this log is missing; episodes.jsonl has its score");
  EXPECT_SAYS(result.out, "1 of 3 logs are missing");
}

TEST_F(Kept, ALogAloneIsComparedWithNothingElse) {
  ReplaceInLines("\"success\":0", "\"success\":1");
  EXPECT_EQ(Rescore(LogFile(run_, 0)).code, 0);
}

// In the middle of the log, the timestamps jump by an hour, as if a realtime machine had been suspended or
// its clock set.
TEST_F(Kept, AClockThatJumpedIsNotWaitedFor) {
  EVALBUS_NEEDS_BUS();
  const fs::path jumped = folder_.path() / "jumped.lcmlog";
  {
    EventLogWriter writer(jumped);
    const auto events = ReadLog(LogFile(run_, 0)).events;
    for (size_t i = 0; i < events.size(); ++i) {
      const int64_t hour_us = i < events.size() / 2 ? 0 : 3600 * int64_t{1000000};
      writer.Write(events[i].channel, events[i].data, events[i].time_us + hour_us);
    }
    writer.Close();
  }
  const Result refused = RunProgram({"evalbus", "replay", jumped});
  EXPECT_EQ(refused.code, 1) << refused.out;
  EXPECT_EQ(
      refused.err,
      "error: " + jumped.string() +
          ": its clock jumps ahead, for which LCM's player would wait 3600 s at --speed 1; use a higher "
          "--speed, or 'evalbus rescore', which does not wait\n");
  const Result fast = RunProgram({"evalbus", "replay", jumped, "--speed", "10000"});
  EXPECT_SAYS(fast.out, "1 of 1 episodes have scores bit-identical") << fast.err;
}

TEST_F(Kept, AReplayThatIsKilledLeavesNothing) {
  EVALBUS_NEEDS_BUS();
  const fs::path scratch = folder_.path() / "scratch";
  fs::create_directory(scratch);
  Program replay({"evalbus", "replay", run_, "--speed", "0.01"},
                 {{}, [&] { setenv("TMPDIR", scratch.c_str(), 1); }});
  ASSERT_TRUE(WaitFor([&] { return !ChildrenOf(replay.pid(), "lcm-logplayer").empty(); })) << replay.err();
  replay.Signal(SIGKILL);
  replay.Wait();
  EXPECT_TRUE(fs::is_empty(scratch));
}

// A bad log does not affect the others.
TEST_F(Kept, EveryLogThatCanBeRenderedIs) {
  WriteText(LogFile(run_, 1), "no log");
  const Result result = RunProgram({"evalbus", "render", run_, "--size", "64x48", "--camera", "front"});
  EXPECT_EQ(result.code, 1);
  EXPECT_SAYS(result.err, "warning: no video: " + LogFile(run_, 1).string() +
                              ": no complete MODEL message in this log\n");
  EXPECT_TRUE(result.err.ends_with("\nerror: no video could be made of 1 of 3 logs\n")) << result.err;
  for (const int episode : {0, 2}) {
    EXPECT_TRUE(fs::exists(LogFile(run_, episode).parent_path() / "front.mp4")) << episode;
  }
}

}  // namespace evalbus::kept_results_test
