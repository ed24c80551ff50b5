#include "bus/recorder/recorder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <limits>

#include "base/errors.h"
#include "base/run_layout.h"
#include "bus/channels.h"
#include "evalbus/episode_end_t.hpp"
#include "evalbus/episode_summary_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "evalbus/run_summary_t.hpp"
#include "evalbus/state_t.hpp"
#include "tests/unit/temporary_folder.h"

namespace evalbus::recorder_test {

class RecorderTest : public testing::Test {
 protected:
  void Begin(int episode, int attempt = 0, const std::string& clock = "lockstep") {
    model_info_t model{};
    model.clock = clock;
    bus_.Publish(channels::kModel, model);
    episode_begin_t begin{};
    begin.header.episode = episode;
    begin.header.attempt = attempt_ = attempt;
    bus_.Publish(channels::kEpisodeBegin, begin);
  }
  void Tick(int episode, int64_t tick) {
    state_t state{};
    state.header = {0, episode, attempt_, tick, 20000 * tick};
    bus_.Publish(channels::kState, state);
  }
  void End(int episode) {
    episode_end_t end{};
    end.header.episode = episode;
    end.header.attempt = attempt_;
    bus_.Publish(channels::kEpisodeEnd, end);
    episode_summary_t summary{};
    summary.header = end.header;
    bus_.Publish(channels::kEpisodeSummary, summary);
    bus_.Publish(channels::kRunSummary, run_summary_t{});
  }
  void HandleAll() {
    while (bus_.Handle()) {
    }
  }
  std::vector<std::pair<std::string, int64_t>> Log(int episode) {
    std::vector<std::pair<std::string, int64_t>> events;
    EventLogReader reader(EpisodeFolder(folder_.path(), episode) / "events.lcmlog");
    LogEvent event;
    while (reader.Next(&event)) events.emplace_back(event.channel, event.time_us);
    return events;
  }

  // Attempt of the most recent episode.
  int attempt_ = 0;
  TemporaryFolder folder_;
  Bus bus_{"memq://"};
  Recorder dut_{&bus_, folder_.path()};
};

TEST_F(RecorderTest, WritesModelFirstAndStampsSimulatedTime) {
  Begin(0);
  bus_.Publish(channels::kRunSummary, run_summary_t{});  // repeated; belongs to no episode
  for (int tick = 0; tick < 3; ++tick) Tick(0, tick);
  bus_.PublishRaw("OTHER", Encode(header_t{}));
  End(0);
  HandleAll();
  std::vector<std::pair<std::string, int64_t>> events = Log(0);
  // STATUS messages of the recorder itself are also recorded.
  std::erase_if(events, [](const auto& event) { return event.first == channels::kStatus; });
  const std::vector<std::pair<std::string, int64_t>> expected = {
      {channels::kModel.name, 0},          {channels::kEpisodeBegin.name, 0},
      {channels::kState.name, 0},          {channels::kState.name, 20000},
      {channels::kState.name, 40000},      {"OTHER", 40000},
      {channels::kEpisodeEnd.name, 40000}, {channels::kEpisodeSummary.name, 40000},
      {channels::kRunSummary.name, 40000}};
  EXPECT_EQ(events, expected);
}

TEST_F(RecorderTest, EpisodesAreSeparateAndRenamedWhenComplete) {
  for (int episode = 0; episode < 2; ++episode) {
    Begin(episode);
    Tick(episode, 0);
    HandleAll();
    EXPECT_FALSE(std::filesystem::exists(EpisodeFolder(folder_.path(), episode)));
    End(episode);
    HandleAll();
    EXPECT_TRUE(std::filesystem::exists(EpisodeFolder(folder_.path(), episode)));
    EXPECT_EQ(dut_.status().last_finished_episode, episode);
  }
}

TEST_F(RecorderTest, ARetriedEpisodeKeepsNothingOfTheAttemptBefore) {
  Begin(0, 0);
  for (int tick = 0; tick < 5; ++tick) Tick(0, tick);
  Begin(0, 1);
  Tick(0, 0);
  End(0);
  HandleAll();
  const auto events = Log(0);
  EXPECT_EQ(
      std::count_if(events.begin(), events.end(), [](const auto& e) { return e.first == channels::kState; }),
      1);
}

TEST_F(RecorderTest, ARetryTakesThePlaceOfAnAttemptThatWasAborted) {
  Begin(0, 0);
  for (int tick = 0; tick < 5; ++tick) Tick(0, tick);
  End(0);
  HandleAll();
  EXPECT_EQ(dut_.status().last_finished_episode, 0);
  Begin(0, 1);
  Tick(0, 0);
  End(0);
  HandleAll();
  const auto events = Log(0);
  EXPECT_EQ(
      std::count_if(events.begin(), events.end(), [](const auto& e) { return e.first == channels::kState; }),
      1);
}

TEST_F(RecorderTest, MessagesOfAnotherTypeOrEpisodeNeitherMoveTheClockNorEndTheEpisode) {
  Begin(0);
  Tick(0, 0);
  state_t ahead{};
  ahead.header.tick = 1000;
  ahead.header.sim_time_us = 1'000'000'000;
  for (const char* channel :
       {channels::kEpisodeSummary.name, channels::kEpisodeEnd.name, channels::kAction.name})
    bus_.PublishRaw(channel, Encode(ahead));
  episode_summary_t other{};
  other.header = ahead.header;
  bus_.PublishRaw(channels::kState.name, Encode(other));
  Tick(7, 1000);
  bus_.Publish(channels::kRunSummary, run_summary_t{});
  HandleAll();
  EXPECT_EQ(dut_.status().last_finished_episode, -1);
  EXPECT_EQ(dut_.status().last_tick, 0);
  EXPECT_EQ(dut_.status().missing_ticks, 0);
  EXPECT_EQ(dut_.status().foreign_messages, 1);
  Tick(0, 1);
  End(0);
  HandleAll();
  for (const auto& [channel, time_us] : Log(0)) EXPECT_LE(time_us, 20000) << channel;
}

TEST_F(RecorderTest, RefusesToReplaceAFinishedEpisode) {
  std::filesystem::create_directories(EpisodeFolder(folder_.path(), 0));
  Begin(0);
  EXPECT_THROW(HandleAll(), InputError);
}

TEST_F(RecorderTest, CountsTicksThatNeverArrived) {
  Begin(0);
  for (const int tick : {0, 1, 4, 5}) Tick(0, tick);
  HandleAll();
  EXPECT_EQ(dut_.status().missing_ticks, 2);
}

// A complete log has a STATE of each tick up to the tick of EPISODE_END. In lockstep, it also has CONTACTS
// and PARTIAL of each of these ticks, and an ACTION of each except the last.
TEST_F(RecorderTest, ReportsWhatAClosedLogLacks) {
  const auto say = [this]<class Message>(const Channel<Message>& channel, int64_t tick) {
    Message message{};
    message.header = {0, 0, attempt_, tick, 20000 * tick};
    bus_.Publish(channel, message);
  };
  const auto all = [&](int64_t tick) {
    say(channels::kState, tick);
    say(channels::kContacts, tick);
    say(channels::kAction, tick);
    say(channels::kPartial, tick);
  };
  const auto end = [&](int64_t tick) {
    say(channels::kEpisodeEnd, tick);
    say(channels::kEpisodeSummary, tick);
    bus_.Publish(channels::kRunSummary, run_summary_t{});
    HandleAll();
    EXPECT_EQ(dut_.status().last_finished_episode, 0);
    return dut_.status().last_finished_missing_ticks;
  };
  Begin(0, 0);
  for (const int64_t tick : {0, 2, 1, 3, 1}) all(tick);
  say(channels::kState, 4);
  say(channels::kContacts, 4);
  say(channels::kPartial, 4);
  EXPECT_EQ(end(4), 0) << "the last tick needs no action, and order does not matter";
  Begin(0, 1);
  for (const int64_t tick : {0, 3, 4}) all(tick);
  EXPECT_EQ(end(6), 4) << "1, 2, and those before the end: 5, 6";
  Begin(0, 2);
  for (const int64_t tick : {0, 1, 2}) all(tick);
  say(channels::kState, 3);
  say(channels::kPartial, 3);
  EXPECT_EQ(end(3), 1) << "CONTACTS of tick 3";
  Begin(0, 3, "realtime");
  for (const int64_t tick : {0, 1, 3}) say(channels::kState, tick);
  EXPECT_EQ(end(3), 1) << "in real time, only the sim's STATE is guaranteed to be published";
}

TEST_F(RecorderTest, BytesThatAreNoMessageOfTheirChannelAreNotWritten) {
  Begin(0);
  Tick(0, 0);
  std::vector<uint8_t> huge = Encode(state_t{});
  huge.resize(1'000'000);
  bus_.PublishRaw(channels::kState.name, huge);
  bus_.PublishRaw(channels::kModel.name, huge);
  bus_.PublishRaw(channels::kStatus.name, huge);
  End(0);
  HandleAll();
  auto events = Log(0);
  std::erase_if(events, [](const auto& event) { return event.first == channels::kStatus; });
  EXPECT_EQ(events.size(), 6u);  // MODEL, EPISODE_BEGIN, STATE, EPISODE_END, EPISODE_SUMMARY, RUN_SUMMARY
  EXPECT_EQ(bus_.decode_errors(), 3);
}

TEST_F(RecorderTest, RepeatedMessagesAreRecordedOnce) {
  for (int attempt = 0; attempt < 2; ++attempt) {
    for (int i = 0; i < 2; ++i) Begin(0, attempt);
    for (const int tick : {0, 0, 1, 1, 1, 2}) Tick(0, tick);
    for (int i = 0; i < 2; ++i) bus_.PublishRaw("OTHER", Encode(header_t{}));
  }
  episode_end_t end{};
  end.header.attempt = attempt_;
  bus_.Publish(channels::kEpisodeEnd, end);
  episode_summary_t summary{};
  summary.header = end.header;
  bus_.Publish(channels::kEpisodeSummary, summary);
  End(0);
  HandleAll();
  const auto events = Log(0);
  const auto count = [&](std::string_view channel) {
    return std::ranges::count_if(events, [&](const auto& event) { return event.first == channel; });
  };
  EXPECT_EQ(count(channels::kState), 3);
  for (const char* name :
       {channels::kEpisodeBegin.name, channels::kEpisodeEnd.name, channels::kEpisodeSummary.name})
    EXPECT_EQ(count(name), 1) << name;
  EXPECT_EQ(count("OTHER"), 2);
}

TEST_F(RecorderTest, TicksThatNoEpisodeReachesAreForeign) {
  Begin(0);
  constexpr auto kMax = std::numeric_limits<int64_t>::max(), kLeast = std::numeric_limits<int64_t>::min();
  for (const int64_t tick : {int64_t{0}, kMax, kLeast, int64_t{1}}) {
    state_t state{};
    state.header.tick = tick;
    bus_.Publish(channels::kState, state);
  }
  HandleAll();
  EXPECT_EQ(dut_.status().last_tick, 1);
  EXPECT_EQ(dut_.status().missing_ticks, 0);
  EXPECT_EQ(dut_.status().foreign_messages, 2);
}

TEST_F(RecorderTest, RealtimeRunsAreStampedWithTheTimeOfArrival) {
  Begin(0, 0, "realtime");
  Tick(0, 0);
  End(0);
  HandleAll();
  // Times are in microseconds since 1970, and this number is a time in 2001.
  for (const auto& [channel, time_us] : Log(0)) EXPECT_GT(time_us, 1'000'000'000'000'000) << channel;
}

TEST_F(RecorderTest, AnOldLogNeverReplacesAFinishedEpisode) {
  const auto count = [&](int episode) {
    std::ofstream(EpisodeFolder(folder_.path(), episode) / "summary.json") << "{}";
  };
  for (int episode = 0; episode < 2; ++episode) {
    Begin(episode);
    Tick(episode, 0);
    if (episode == 0) End(0);
    HandleAll();
    if (episode == 0) count(0);
  }
  const auto before = Log(0);
  for (int attempt = 0; attempt < 2; ++attempt) Begin(0, attempt);
  HandleAll();
  EXPECT_EQ(Log(0), before);
  EXPECT_EQ(dut_.status().foreign_messages, 2);
  attempt_ = 0;  // the attempt of episode 1, which continues
  End(1);
  HandleAll();
  EXPECT_EQ(dut_.status().last_finished_episode, 1);
  // Episode 1 has just been counted, so a second attempt does not change its log either.
  count(1);
  const auto last = Log(1);
  Begin(1, 1);
  End(1);
  HandleAll();
  EXPECT_EQ(Log(1), last);
  EXPECT_TRUE(std::filesystem::exists(EpisodeFolder(folder_.path(), 1) / "summary.json"));
}

TEST_F(RecorderTest, AScoreBeforeTheEndDoesNotCloseTheLog) {
  Begin(0);
  Tick(0, 0);
  bus_.Publish(channels::kEpisodeSummary, episode_summary_t{});
  bus_.Publish(channels::kRunSummary, run_summary_t{});
  Tick(0, 1);
  HandleAll();
  EXPECT_EQ(dut_.status().last_finished_episode, -1);
  End(0);
  HandleAll();
  EXPECT_EQ(dut_.status().last_finished_episode, 0);
  const auto events = Log(0);
  EXPECT_EQ(
      std::count_if(events.begin(), events.end(), [](const auto& e) { return e.first == channels::kState; }),
      2);
}

TEST_F(RecorderTest, NothingBeginsBeforeTheModelIsKnown) {
  bus_.Publish(channels::kEpisodeBegin, episode_begin_t{});
  Tick(0, 0);
  HandleAll();
  EXPECT_NE(dut_.status().state, component_status_t::READY);
  Begin(0);
  HandleAll();
  EXPECT_EQ(dut_.status().state, component_status_t::READY);
  EXPECT_EQ(dut_.status().last_tick, -1);
}

TEST_F(RecorderTest, ARetryIsRecordedWhateverAnOldLogBeganMeanwhile) {
  Begin(0);
  End(0);
  Begin(1);
  Begin(0, 1);
  Tick(0, 0);
  HandleAll();
  EXPECT_EQ(dut_.status().state, component_status_t::READY);
  EXPECT_EQ(dut_.status().attempt, 1);
  EXPECT_EQ(dut_.status().last_tick, 0);
}

// The new log cannot replace the existing one.
TEST_F(RecorderTest, AnotherSeedOfAFinishedEpisodeIsForeign) {
  Begin(0);
  Tick(0, 0);
  End(0);
  HandleAll();
  const auto before = Log(0);
  episode_begin_t begin{};
  begin.seed = 99;
  bus_.Publish(channels::kEpisodeBegin, begin);
  Tick(0, 0);
  End(0);
  HandleAll();
  EXPECT_EQ(Log(0), before);
  EXPECT_EQ(dut_.status().foreign_messages, 1);
}

TEST(RecorderOfASession, ReceivesOnlyItsRun) {
  TemporaryFolder folder;
  Bus bus("memq://", 7);
  Recorder dut(&bus, folder.path());
  const auto say = [&](int64_t session, int32_t episode) {
    model_info_t model{};
    model.session = session;
    model.clock = session == 7 ? "lockstep" : "realtime";
    bus.PublishRaw(channels::kModel.name, Encode(model));
    episode_begin_t begin{};
    begin.header.session = session;
    begin.header.episode = episode;
    bus.PublishRaw(channels::kEpisodeBegin.name, Encode(begin));
    while (bus.Handle()) {
    }
  };
  std::filesystem::create_directories(EpisodeFolder(folder.path(), 0));
  say(8, 0);
  EXPECT_EQ(dut.status().episode, -1);
  EXPECT_EQ(bus.foreign_messages(), 2);
  // This run's launcher does not begin an episode that is recorded already, so this message also belongs to
  // another run.
  say(7, 0);
  EXPECT_EQ(dut.status().episode, -1);
  say(7, 1);
  say(8, 2);
  EXPECT_EQ(dut.status().episode, 1);
  // Once MODEL has been received, not even a message that claims this run's session is recorded.
  model_info_t forged{};
  forged.message_version = 99;
  bus.Publish(channels::kModel, forged);
  episode_end_t end{};
  end.header.episode = 1;
  bus.Publish(channels::kEpisodeEnd, end);
  episode_summary_t summary{};
  summary.header.episode = 1;
  bus.Publish(channels::kEpisodeSummary, summary);
  bus.Publish(channels::kRunSummary, run_summary_t{});
  while (bus.Handle()) {
  }
  EventLogReader reader(EpisodeLog(folder.path(), 1));
  int models = 0, begins = 0;
  for (LogEvent event; reader.Next(&event);) {
    models += event.channel == channels::kModel;
    begins += event.channel == channels::kEpisodeBegin;
  }
  EXPECT_EQ(models, 1);
  EXPECT_EQ(begins, 1);
}

TEST_F(RecorderTest, WhateverBeginsWritesIntoTheRunFolderAndLeavesNothingHalfDone) {
  for (const int32_t episode : {-1, std::numeric_limits<int32_t>::min(), 12345, 0}) {
    Begin(episode, 1);
    Tick(episode, 0);
    HandleAll();
  }
  End(0);
  HandleAll();
  std::vector<std::filesystem::path> entries;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_.path())) {
    entries.push_back(entry.path().lexically_relative(folder_.path()));
  }
  std::sort(entries.begin(), entries.end());
  // episodes/1xxxx, a folder for many episodes, must be empty.
  const std::vector<std::filesystem::path> expected = {"episodes", "episodes/0000",
                                                       "episodes/0000/events.lcmlog", "episodes/1xxxx"};
  EXPECT_EQ(entries, expected);
}

}  // namespace evalbus::recorder_test
