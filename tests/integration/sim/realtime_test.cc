// Real-time runs report their timing, and observers do not delay them.
#include <signal.h>

#include "bus/channels.h"
#include "evalbus/episode_end_t.hpp"
#include "evalbus/state_t.hpp"
#include "tests/integration/harness.h"

namespace evalbus::realtime_test {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

TEST(Realtime, ReportsItsPacing) {
  TemporaryFolder folder;
  const fs::path run = folder.path() / "run";
  const Result result = RunProgram({"evalbus", "run", ShortTask(folder.path(), 0.5), "--policy", "hold",
                                    "--realtime", "--episodes", "2", "--in-process", "--out", run});
  EXPECT_EQ(result.code, 0) << result.err;
  const auto episodes = Episodes(run);
  ASSERT_EQ(episodes.size(), 2u);
  const auto summary = ordered_json::parse(ReadText(run / "summary.json"));
  for (int i = 0; i < 2; ++i) {
    const ordered_json& pacing = episodes[static_cast<size_t>(i)]["pacing"];
    EXPECT_EQ(pacing["ticks"], 25);
    EXPECT_EQ(pacing["deadline_misses"], episodes[static_cast<size_t>(i)]["extended"]["deadline_misses"]);
    // A STATE is never published early.
    EXPECT_GE(pacing["error"]["p50_s"], 0);
    for (const char* key : {"error", "action_latency", "partial_latency"}) {
      const ordered_json& times = pacing[key];
      EXPECT_LE(times["p50_s"], times["p99_s"]) << key;
      EXPECT_LE(times["p99_s"], times["p999_s"]) << key;
      EXPECT_LE(times["p999_s"], times["max_s"]) << key;
      EXPECT_GE(summary["pacing"][key]["max_s"], times["max_s"]) << key;
    }
    EXPECT_EQ(pacing["error"]["count"], 25);
    EXPECT_GT(pacing["action_latency"]["count"], 0);
    EXPECT_LE(pacing["partial_latency"]["count"], 26);
    const auto end = ReadLog(LogFile(run, i)).Messages(channels::kEpisodeEnd).at(0);
    EXPECT_EQ(end.pacing_error.max_s, pacing["error"]["max_s"]);
    EXPECT_EQ(end.late_ticks, pacing["late_ticks"]);
  }
  EXPECT_EQ(summary["pacing"]["ticks"], 50);
  for (const char* words :
       {"\nreal time: ", "real-time priority o", "Real time. Of 50 ticks, ", "STATE to ACTION"})
    EXPECT_NE(result.out.find(words), std::string::npos) << result.out;
}

TEST(Realtime, LockstepRunsPrintNoPacing) {
  TemporaryFolder folder;
  Evaluate({ShortTask(folder.path(), 0.2), "--policy", "hold", "--episodes", "1", "--in-process"},
           folder.path() / "run");
  EXPECT_FALSE(Episodes(folder.path() / "run")[0].contains("pacing"));
  EXPECT_FALSE(ordered_json::parse(ReadText(folder.path() / "run/summary.json")).contains("pacing"));
}

// A stopped process reads nothing, so its queue fills while the run continues.
TEST(Realtime, StoppedListenersDoNotHoldItUp) {
  EVALBUS_NEEDS_BUS();
  TemporaryFolder folder;
  const fs::path run = folder.path() / "run";
  const std::string url = UniqueUrl();
  Program viz({"evalbus-viz", "--url", url});
  Program launcher({"evalbus", "run", ShortTask(folder.path(), 4), "--policy", "hold", "--realtime",
                    "--episodes", "1", "--url", url, "--out", run});
  int64_t tick = -1;
  Bus bus(url);
  bus.Subscribe(channels::kState, [&](const state_t& state) { tick = state.header.tick; });
  const auto reaches = [&](int64_t wanted) {
    return WaitFor([&] {
      while (bus.Handle()) {
      }
      return tick >= wanted;
    });
  };
  ASSERT_TRUE(reaches(25)) << launcher.err() << viz.err();
  const auto recorder = ChildrenOf(launcher.pid(), "evalbus-recorder");
  ASSERT_EQ(recorder.size(), 1u);
  kill(recorder[0], SIGSTOP);
  viz.Signal(SIGSTOP);
  // Waits for tick 175 of 200. A run that waited for the recorder would not reach it.
  ASSERT_TRUE(reaches(175));
  kill(recorder[0], SIGCONT);
  EXPECT_EQ(launcher.Wait(), 0) << launcher.err() << launcher.out();
  const auto episodes = Episodes(run);
  ASSERT_EQ(episodes.size(), 1u);
  EXPECT_EQ(episodes[0]["complete"], true);
  EXPECT_EQ(episodes[0]["pacing"]["ticks"], 200);
  EXPECT_EQ(launcher.out().find("retrying"), std::string::npos) << launcher.out();
}

}  // namespace evalbus::realtime_test
