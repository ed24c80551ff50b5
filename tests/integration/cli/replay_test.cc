// Tests replays of recorded episodes, over a bus with LCM's player and offline.
#include <signal.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "bus/channels.h"
#include "bus/event_log.h"
#include "evalbus/contacts_t.hpp"
#include "evalbus/episode_summary_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "evalbus/state_t.hpp"
#include "lcmtypes/end_reason.h"
#include "tests/integration/harness.h"

namespace evalbus::replay_test {

namespace fs = std::filesystem;

class Recorded : public testing::Test {
 protected:
  void Record(int episodes) {
    Evaluate({"lift_pot/position", "--episodes", std::to_string(episodes), "--in-process"}, run_);
    log_ = LogFile(run_, 0);
  }
  size_t NumStates(int episodes) {
    size_t n = 0;
    for (int i = 0; i < episodes; ++i) n += ReadLog(LogFile(run_, i)).Payloads(channels::kState).size();
    return n;
  }
  // lift_pot with a different lift height for success.
  fs::path TaskWithThreshold(const std::string& meters) {
    std::string text = ReadText(EVALBUS_SOURCE_DIR "/models/tasks/lift_pot.yaml");
    const std::string key = "min_m: 1.096";
    const size_t at = text.find(key);
    EXPECT_NE(at, std::string::npos);
    text.replace(at, key.size(), "min_m: " + meters);
    WriteText(folder_.path() / "edited.yaml", text);
    return folder_.path() / "edited.yaml";
  }
  // Returns a copy of the first episode's log, changed by `edit`.
  fs::path EditedLog(const std::function<void(std::vector<RecordedLog::Event>*)>& edit) {
    std::vector<RecordedLog::Event> events = ReadLog(log_).events;
    edit(&events);
    const fs::path file = folder_.path() / "edited.lcmlog";
    EventLogWriter writer(file);
    for (const RecordedLog::Event& event : events) writer.Write(event.channel, event.data, event.time_us);
    writer.Close();
    return file;
  }
  Result Rescore(const fs::path& what, std::vector<std::string> more = {}) {
    more.insert(more.begin(), {"evalbus", "rescore", what});
    return RunProgram(more);
  }
  Result Replay(const fs::path& what, std::vector<std::string> more = {"--speed", "5"}) {
    more.insert(more.begin(), {"evalbus", "replay", what});
    return RunProgram(more);
  }
  // Returns the scores that rescoring writes.
  nlohmann::json FirstScore(const fs::path& what, std::vector<std::string> more = {}) {
    const fs::path out = folder_.path() / "scores.jsonl";
    fs::remove(out);
    more.insert(more.end(), {"--out", out});
    Rescore(what, more);
    return nlohmann::json::parse(ReadText(out));
  }

  TemporaryFolder folder_;
  fs::path run_ = folder_.path() / "run", log_;
};

#define EXPECT_SAYS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

header_t HeaderOf(const RecordedLog::Event& event) {
  header_t header{};
  EXPECT_GT(header._decodeNoHash(event.data.data(), 8, static_cast<int>(event.data.size()) - 8), 0);
  return header;
}

TEST_F(Recorded, RescoreGivesTheRecordedBits) {
  Record(2);
  const fs::path out = folder_.path() / "scores.jsonl";
  const Result result = Rescore(run_, {"--out", out});
  EXPECT_EQ(result.code, 0) << result.out << result.err;
  EXPECT_EQ(result.err, "");
  EXPECT_SAYS(result.out, "2 of 2 episodes have scores bit-identical to the recorded ones");
  EXPECT_EQ(ReadText(out), ReadText(run_ / "episodes.jsonl"));
}

TEST_F(Recorded, ReplayGivesTheRecordedBits) {
  EVALBUS_NEEDS_BUS();
  Record(2);
  const Result result = Replay(run_);
  EXPECT_EQ(result.code, 0) << result.out << result.err;
  EXPECT_EQ(result.err, "");
  EXPECT_SAYS(result.out, "2 of 2 episodes have scores bit-identical to the recorded ones; 0 of " +
                              std::to_string(NumStates(2)) + " ticks lost");
  const Result one = Replay(run_, {"--speed", "5", "--episode", "1"});
  EXPECT_EQ(one.code, 0) << one.out << one.err;
  EXPECT_SAYS(one.out, "1 of 1 episodes have scores bit-identical");
}

// Both episodes have the number 0, but different seeds.
TEST_F(Recorded, ReplayOfALogWithTwoRunsGivesTheBitsOfBoth) {
  EVALBUS_NEEDS_BUS();
  Record(1);
  const fs::path other = folder_.path() / "other", both = folder_.path() / "both.lcmlog";
  Evaluate({"lift_pot/position", "--episodes", "1", "--seed", "9", "--in-process"}, other);
  WriteText(both, ReadText(log_) + ReadText(LogFile(other, 0)));
  const Result result = Replay(both);
  EXPECT_EQ(result.code, 0) << result.out << result.err;
  EXPECT_SAYS(result.out, "2 of 2 episodes have scores bit-identical to the recorded ones");
}

TEST_F(Recorded, ReplayRefusesAPageOfTheRunThatIsNone) {
  EVALBUS_NEEDS_BUS();
  Record(1);
  WriteText(run_ / "run.json", R"({"policy": 3, "seed": 1})");
  const Result result = Replay(run_);
  EXPECT_EQ(result.code, 1) << result.out;
  EXPECT_EQ(result.err,
            "error: " + (run_ / "run.json").string() + ": no \"task\"; was this made by evalbus?\n");
}

TEST_F(Recorded, SuitesAreReplayedRescoredAndRendered) {
  const fs::path suite = folder_.path() / "suite";
  Evaluate({"lift_pot/base", "stack_two_blocks/base", "--policy", "flawed_expert:error", "--episodes", "1",
            "--in-process"},
           suite);
  const Result rescored = Rescore(suite);
  EXPECT_EQ(rescored.code, 0) << rescored.out << rescored.err;
  EXPECT_SAYS(rescored.out, "lift_pot/base  recorded conditions");
  EXPECT_SAYS(rescored.out, "stack_two_blocks/base  recorded conditions");
  EXPECT_SAYS(rescored.out, "2 of 2 episodes have scores bit-identical to the recorded ones");

  const Result rendered =
      RunProgram({"evalbus", "render", suite, "--camera", "left/hand/wrist", "--size", "160x120"});
  EXPECT_EQ(rendered.code, 0) << rendered.err;
  for (const char* run : {"lift_pot-base", "stack_two_blocks-base"}) {
    EXPECT_TRUE(fs::exists(suite / run / "episodes/0000/left_hand_wrist.mp4")) << rendered.out;
  }

  EVALBUS_NEEDS_BUS();
  const Result replayed = Replay(suite, {"--speed", "5"});
  EXPECT_EQ(replayed.code, 0) << replayed.out << replayed.err;
  EXPECT_SAYS(replayed.out, "lift_pot/base  policy flawed_expert:error");
  EXPECT_SAYS(replayed.out, "stack_two_blocks/base  policy flawed_expert:error");
  EXPECT_SAYS(replayed.out, "2 of 2 episodes have scores bit-identical to the recorded ones; 0 of ");
}

// The reason is the one in the run's table and not the end reason of the sim.
TEST_F(Recorded, RescoreNamesTheReasonOfTheRunsTable) {
  Evaluate({ShortTask(folder_.path(), 0.2), "--policy", "hold", "--episodes", "1", "--in-process"}, run_);
  const auto episode = Episodes(run_).at(0);
  ASSERT_NE(episode["failure_reason"], episode["end_reason"]);
  const Result result = Rescore(run_);
  EXPECT_SAYS(result.out, "      0  " + end_reason::Text(episode["failure_reason"]) + " ");
}

TEST_F(Recorded, ReplayAtSpeedOneTakesAsLongAsTheRobotDid) {
  EVALBUS_NEEDS_BUS();
  Evaluate({ShortTask(folder_.path(), 1), "--policy", "random", "--episodes", "1", "--in-process"}, run_);
  const auto start = std::chrono::steady_clock::now();
  const Result result = Replay(run_, {});
  EXPECT_GE(std::chrono::steady_clock::now() - start, std::chrono::seconds(1));
  EXPECT_EQ(result.code, 0) << result.out << result.err;
  EXPECT_SAYS(result.out, "0 of 51 ticks lost");
}

// Metrics, viz and monitor receive the same messages in a replay as in the run, and no component receives a
// command.
TEST_F(Recorded, ReplaySoundsLikeTheRun) {
  EVALBUS_NEEDS_BUS();
  Record(1);
  const std::string url = UniqueUrl();
  Bus bus(url);
  RecordedLog received;
  bus.SubscribeRaw(".*", [&](std::string_view channel, std::span<const uint8_t> data, int64_t) {
    received.events.push_back({std::string(channel), {data.begin(), data.end()}, 0});
  });
  Program replay({"evalbus", "replay", run_, "--speed", "5", "--url", url});
  EXPECT_TRUE(WaitFor([&] {
    while (bus.Handle()) {
    }
    return !replay.running();
  }));
  EXPECT_EQ(replay.Wait(), 0) << replay.out() << replay.err();
  const RecordedLog recorded = ReadLog(log_);
  for (const char* channel :
       {channels::kModel.name, channels::kState.name, channels::kContacts.name, channels::kPartial.name,
        channels::kEpisodeEnd.name, channels::kEpisodeSummary.name}) {
    EXPECT_FALSE(recorded.Payloads(channel).empty()) << channel;
    EXPECT_TRUE(received.Payloads(channel) == recorded.Payloads(channel)) << channel;
  }
  EXPECT_TRUE(received.Payloads(channels::kCommand).empty());
}

TEST_F(Recorded, AScoreThatDiffersFromTheRecordedOneIsReported) {
  EVALBUS_NEEDS_BUS();
  Record(1);
  const fs::path log = EditedLog([](std::vector<RecordedLog::Event>* events) {
    for (RecordedLog::Event& event : *events) {
      if (event.channel != channels::kEpisodeSummary) continue;
      episode_summary_t summary{};
      ASSERT_TRUE(Decode(event.data, &summary));
      auto& extended = summary.extended;
      const auto work = std::find(extended.name.begin(), extended.name.end(), "mechanical_work_J.right");
      double& value = extended.value_mixed[work - extended.name.begin()];
      value = std::nextafter(value, 1e9);
      summary.encode(event.data.data(), 0, static_cast<int>(event.data.size()));
    }
  });
  for (const Result& result : {Rescore(log), Replay(log)}) {
    EXPECT_EQ(result.code, 2);
    EXPECT_SAYS(result.out, "DIFFERS: extended.mechanical_work_J.right");
    EXPECT_SAYS(result.out, "0 of 1 episodes have scores bit-identical");
  }
}

TEST_F(Recorded, LowerThresholdEndsTheEpisodeAtTheTickThatReachesIt) {
  Record(1);
  const RecordedLog log = ReadLog(log_);
  const auto model = log.Messages(channels::kModel).at(0);
  const auto pot =
      std::find(model.body_name.begin(), model.body_name.end(), "pot/pot") - model.body_name.begin();
  ASSERT_LT(pot, model.num_bodies);
  const auto states = log.Messages(channels::kState);
  // At this tick the pot is level and far above the counter, so success requires no more.
  const auto first = std::find_if(states.begin(), states.end(), [pot](const state_t& state) {
    return state.body[pot].position_m[2] > 1.05;
  });
  ASSERT_NE(first, states.end());
  ASSERT_LT(first->header.tick, states.back().header.tick);

  const Result result = Rescore(run_, {"--task", TaskWithThreshold("1.05")});
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_SAYS(result.out, "completion_time");
  const nlohmann::json score = FirstScore(run_, {"--task", TaskWithThreshold("1.05")});
  EXPECT_DOUBLE_EQ(score["metrics"]["completion_time"].get<double>(),
                   static_cast<double>(first->header.sim_time_us) * 1e-6);
  EXPECT_EQ(score["metrics"]["success"], 1.0);
  EXPECT_EQ(score["end_reason"], "success");
  EXPECT_EQ(score["complete"], true);
}

TEST_F(Recorded, HigherThresholdIsNotDecidedByThisLog) {
  Record(1);
  const fs::path task = TaskWithThreshold("1.3");
  const Result result = Rescore(run_, {"--task", task});
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_SAYS(result.out, "success -> unconfirmed");
  EXPECT_SAYS(result.out, "4/4 -> 2/4");
  EXPECT_SAYS(result.out, " m < 1.3; highest stage 2");
  EXPECT_SAYS(result.out, "1 of 1 verdicts changed: success -> unconfirmed 1\n");
  EXPECT_SAYS(result.out, "successes 1 -> 0");
  const nlohmann::json score = FirstScore(run_, {"--task", task});
  EXPECT_EQ(score["metrics"]["success"], 0.0);
  EXPECT_EQ(score["failure_reason"], "unconfirmed");
  EXPECT_EQ(score["complete"], false);
}

TEST_F(Recorded, StagesAddedAndRemovedAreListed) {
  Record(1);
  std::string text = ReadText(TaskWithThreshold("1.096"));
  const std::string first =
      "  - name: left_gripper_touches_pot\n    when: &left_holds {holding: {gripper: left, object: pot}}\n";
  ASSERT_NE(text.find(first), std::string::npos);
  text.replace(text.find(first), first.size(),
               "  - name: far\n    when: {height_above: {object: pot, min_m: 5}}\n" + first);
  const fs::path task = folder_.path() / "stages.yaml";
  WriteText(task, text);
  Result result = Rescore(run_, {"--task", task});
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_SAYS(result.out, "4/4 -> 4/5  task_stage_reached, subtask_progress, stage_time_s\n");
  EXPECT_SAYS(result.out, "0 of 1 verdicts changed\n");
  EXPECT_EQ(FirstScore(run_, {"--task", task})["metrics"]["subtask_progress"], 0.8);

  const std::string lifted =
      "  - name: pot_lifted\n    when: &lifted {height_above: {object: pot, min_m: 1.096}}\n";
  text = ReadText(TaskWithThreshold("1.096"));
  ASSERT_NE(text.find(lifted), std::string::npos);
  text.replace(text.find(lifted), lifted.size(), "");
  const size_t alias = text.find("*lifted");
  ASSERT_NE(alias, std::string::npos);
  text.replace(alias, 7, "&lifted {height_above: {object: pot, min_m: 1.096}}");
  WriteText(task, text);
  result = Rescore(run_, {"--task", task});
  EXPECT_SAYS(result.out, "4/4 -> 3/3");
  EXPECT_EQ(FirstScore(run_, {"--task", task})["metrics"]["task_stage_reached"].size(), 3u);
}

TEST_F(Recorded, OtherTimeLimit) {
  Record(1);
  const fs::path task = ShortTask(folder_.path(), 1);
  const nlohmann::json shorter = FirstScore(run_, {"--task", task});
  EXPECT_EQ(shorter["end_reason"], "time_limit");
  EXPECT_EQ(shorter["metrics"]["completion_time"], 1.0);
  EXPECT_EQ(shorter["complete"], true);

  const fs::path short_run = folder_.path() / "short";
  Evaluate({task, "--policy", "hold", "--episodes", "1", "--in-process"}, short_run);
  EXPECT_EQ(FirstScore(short_run)["complete"], true);
  const nlohmann::json longer = FirstScore(short_run, {"--task", ShortTask(folder_.path(), 2)});
  EXPECT_EQ(longer["end_reason"], "aborted");
  EXPECT_EQ(longer["complete"], false);
}

TEST_F(Recorded, MissingTicksAreCountedExactly) {
  EVALBUS_NEEDS_BUS();
  Record(1);
  const int64_t last = static_cast<int64_t>(NumStates(1)) - 1;
  // One gap is early; the other is so late that the remaining ticks cannot compensate for it.
  const fs::path log = EditedLog([last](std::vector<RecordedLog::Event>* events) {
    std::erase_if(*events, [last](const RecordedLog::Event& event) {
      if (event.channel == channels::kState) {
        const int64_t tick = HeaderOf(event).tick;
        return tick >= 5 && tick < 9;
      }
      return event.channel == channels::kContacts && HeaderOf(event).tick == last - 10;
    });
  });
  const Result rescored = Rescore(log);
  EXPECT_EQ(rescored.code, 2);
  EXPECT_SAYS(rescored.out, "incomplete: 5 ticks missing\n");
  const nlohmann::json score = FirstScore(log);
  EXPECT_EQ(score["complete"], false);
  EXPECT_EQ(score["extended"]["missing_ticks"], 5);
  const Result replayed = Replay(log);
  EXPECT_EQ(replayed.code, 2);
  EXPECT_SAYS(replayed.out, "the log lacks 5 ticks; DIFFERS: complete true -> false");
  EXPECT_SAYS(replayed.out, "0 of " + std::to_string(NumStates(1) - 5) + " ticks lost");
}

TEST_F(Recorded, CutLogIsScoredAsFarAsItGoes) {
  EVALBUS_NEEDS_BUS();
  Record(1);
  const fs::path log = folder_.path() / "cut.lcmlog";
  fs::copy_file(log_, log);
  fs::resize_file(log, fs::file_size(log) / 2);
  const auto states = ReadLog(log).Messages(channels::kState);
  const Result rescored = Rescore(log);
  EXPECT_EQ(rescored.code, 2);
  EXPECT_SAYS(rescored.out, "no EPISODE_END in the log");
  EXPECT_SAYS(rescored.out, "damaged bytes in 1 place skipped");
  EXPECT_SAYS(rescored.out, "no score was recorded");
  const nlohmann::json score = FirstScore(log);
  EXPECT_EQ(score["end_reason"], "aborted");
  EXPECT_EQ(score["complete"], false);
  const double last = static_cast<double>(states.back().header.sim_time_us) * 1e-6;
  EXPECT_NEAR(score["metrics"]["completion_time"], last, 0.0201);
  const Result replayed = Replay(log, {"--speed", "5"});
  EXPECT_EQ(replayed.code, 2);
  EXPECT_SAYS(replayed.out, "no EPISODE_END in the log; no score was recorded");
  EXPECT_SAYS(replayed.out, "0 of ");
}

TEST_F(Recorded, DamageCostsRescoringOneTickAndThePlayerTheRest) {
  EVALBUS_NEEDS_BUS();
  Record(1);
  const fs::path log = folder_.path() / "damaged.lcmlog";
  std::string bytes = ReadText(log_);
  // Overwrites the STATE of tick 99, whose event begins 28 bytes before the channel's name.
  size_t at = 0;
  for (int i = 0; i < 100; ++i) at = bytes.find("EVALBUS_STATE", at + 1);
  ASSERT_NE(at, std::string::npos);
  std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(at) - 28, 20, '\0');
  WriteText(log, bytes);
  const Result rescored = Rescore(log);
  EXPECT_EQ(rescored.code, 2);
  EXPECT_SAYS(rescored.out, "incomplete: 1 tick missing\n");
  EXPECT_SAYS(rescored.out, "damaged bytes in 1 place skipped");
  const size_t played = 99, scored = NumStates(1) - 1;
  const Result replayed = Replay(log, {"--speed", "5"});
  EXPECT_EQ(replayed.code, 2);
  EXPECT_SAYS(replayed.out, std::to_string(scored - played) + " ticks lost in the replay");
  EXPECT_SAYS(replayed.out, "LCM's player stops at the first damaged event");
}

TEST_F(Recorded, BusWithARunOnItIsRefused) {
  EVALBUS_NEEDS_BUS();
  Record(1);
  const std::string url = UniqueUrl();
  Program metrics({"evalbus-metrics", "--url", url});
  ASSERT_TRUE(WaitFor([&] { return metrics.out() == "metrics ready\n"; })) << metrics.err();
  const Result result = Replay(run_, {"--url", url});
  EXPECT_EQ(result.code, 1);
  EXPECT_EQ(result.err, "error: " + url +
                            ": a run or another replay is active on this bus; pass another bus with --url\n");
}

TEST_F(Recorded, InterruptEndsTheReplay) {
  EVALBUS_NEEDS_BUS();
  Record(1);
  Program replay({"evalbus", "replay", run_, "--speed", "0.1"});
  ASSERT_TRUE(WaitFor([&] { return !ChildrenOf(replay.pid(), "lcm-logplayer").empty(); })) << replay.err();
  const std::vector<pid_t> children = ChildrenOf(replay.pid());
  replay.Signal(SIGINT);
  EXPECT_EQ(replay.Wait(), 2);
  EXPECT_EQ(replay.err(), "error: stopped before the end of the replay\n");
  EXPECT_EQ(children.size(), 2u);
  for (const pid_t child : children) EXPECT_NE(kill(child, 0), 0);
}

TEST_F(Recorded, WrongInputGetsOneLine) {
  Record(1);
  const fs::path empty = folder_.path() / "empty", text = folder_.path() / "text";
  fs::create_directories(empty / "episodes");
  WriteText(text, "no log at all\n");
  const std::string run = run_, none = folder_.path() / "none";
  const std::vector<std::pair<std::vector<std::string>, std::string>> cases = {
      {{"rescore", none}, none + ": no such run, suite or log"},
      {{"replay", none}, none + ": no such run, suite or log"},
      {{"rescore", folder_.path()}, folder_.path().string() + ": neither a run, a suite nor a log"},
      {{"rescore", empty}, empty.string() + ": this run has no finished episode"},
      {{"rescore", text},
       text.string() + ": no episode in this log (EVALBUS_MODEL and EVALBUS_EPISODE_BEGIN)"},
      {{"replay", text},
       text.string() + ": no episode in this log (EVALBUS_MODEL and EVALBUS_EPISODE_BEGIN)"},
      {{"replay", run, "--episode", "7"}, run + " has no finished episode 7; it has 1 episode: 0"},
      {{"replay", log_, "--episode", "0"},
       "--episode: " + log_.string() + " is not a run folder; a log is used as a whole"},
      {{"export", log_, "--mcap", "--episode", "0"},
       "--episode: " + log_.string() + " is not a run folder; a log is used as a whole"},
      {{"replay", run, "--speed", "0"}, "--speed: expected 0.001 to 1000000, got 0"},
      {{"replay", run, "--speed", "1e300"}, "--speed: expected 0.001 to 1000000, got 1e+300"},
      {{"replay", run, "--speed", "nan"}, "--speed: expected 0.001 to 1000000, got nan"},
      {{"replay", run, "--url", "memq://"}, "--url memq://: expected udpm://ADDRESS:PORT?ttl=0"},
      {{"rescore", run, "--task", none},
       none + ": cannot read the task description: No such file or directory"},
      {{"rescore", run, "--out", text}, "--out " + text.string() + ": exists; choose another name"},
  };
  for (const auto& [arguments, line] : cases) {
    std::vector<std::string> command = arguments;
    command.insert(command.begin(), "evalbus");
    const Result result = RunProgram(command);
    EXPECT_EQ(result.code, 1) << line;
    EXPECT_EQ(result.err, "error: " + line + "\n");
  }
}

TEST_F(Recorded, PlayerThatIsNotThereIsNamed) {
  Record(1);
  const Result result =
      RunProgram({"evalbus", "replay", run_},
                 {.working_folder = {}, .before = [] { setenv("EVALBUS_PATH", "/nowhere", 1); }});
  EXPECT_EQ(result.code, 2);
  EXPECT_EQ(result.err, "error: lcm-logplayer is not in PATH; fix: apt-get install liblcm-bin\n");
}

}  // namespace evalbus::replay_test
