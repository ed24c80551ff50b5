#include "bus/episode_reader.h"

#include <gmock/gmock.h>

#include "base/errors.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::episode_reader_test {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::IsEmpty;

constexpr int64_t kTick_us = 50'000;

header_t Header(int episode, int attempt, int64_t tick) {
  header_t header{};
  header.episode = episode;
  header.attempt = attempt;
  header.tick = tick;
  header.sim_time_us = tick * kTick_us;
  return header;
}

template <class Message>
std::vector<int64_t> Ticks(const std::vector<Message>& messages) {
  std::vector<int64_t> ticks;
  for (const Message& message : messages) ticks.push_back(message.header.tick);
  return ticks;
}

class EpisodeReaderTest : public testing::Test {
 protected:
  template <class Message>
  void Write(const Channel<Message>& channel, const Message& message) {
    writer_.Write(channel, Encode(message), 0);
  }
  void Model(const std::string& task) {
    model_info_t model{};
    model.task = task;
    Write(channels::kModel, model);
  }
  void Begin(int episode, int attempt = 0, int64_t seed = 1) {
    episode_begin_t begin{};
    begin.header = Header(episode, attempt, 0);
    begin.seed = seed;
    Write(channels::kEpisodeBegin, begin);
  }
  void State(int episode, int attempt, int64_t tick, int64_t time_us = -1, int deadline_misses = 0) {
    state_t state{};
    state.header = Header(episode, attempt, tick);
    if (time_us >= 0) state.header.sim_time_us = time_us;
    state.deadline_misses = deadline_misses;
    Write(channels::kState, state);
  }
  void Action(int episode, int attempt, int64_t tick) {
    action_t action{};
    action.header = Header(episode, attempt, tick);
    Write(channels::kAction, action);
  }
  void End(int episode, int attempt, const std::string& reason) {
    episode_end_t end{};
    end.header = Header(episode, attempt, 9);
    end.end_reason = reason;
    Write(channels::kEpisodeEnd, end);
  }
  std::vector<EpisodeMessages> Read(
      const EpisodeReader::Channels& channels = EpisodeReader::kAllChannels,
      const std::function<bool(int)>& is_wanted = [](int) { return true; }) {
    writer_.Close();
    EpisodeReader reader(log_, channels);
    std::vector<EpisodeMessages> episodes;
    for (EpisodeMessages episode; reader.Next(&episode, is_wanted);) episodes.push_back(episode);
    return episodes;
  }

  TemporaryFolder folder_;
  const fs::path log_ = folder_.path() / "events.lcmlog";
  EventLogWriter writer_{log_};
};

TEST_F(EpisodeReaderTest, RepeatedMessagesAreOneEach) {
  Model("lift_pot");
  for (int i = 0; i < 3; ++i) Begin(4);
  for (int i = 0; i < 2; ++i) State(4, 0, 0, -1, i);
  Action(4, 0, 0);
  Action(4, 0, 0);
  State(4, 0, 1);
  End(4, 0, "time_limit");
  End(4, 0, "time_limit");
  const auto episodes = Read();
  ASSERT_EQ(episodes.size(), 1u);
  EXPECT_EQ(episodes[0].number(), 4);
  EXPECT_EQ(episodes[0].model->task, "lift_pot");
  EXPECT_THAT(Ticks(episodes[0].states), ElementsAre(0, 1));
  EXPECT_EQ(episodes[0].states[0].deadline_misses, 0) << "the first one is used";
  EXPECT_THAT(Ticks(episodes[0].actions), ElementsAre(0));
  EXPECT_EQ(episodes[0].outcome(), "time limit");
}

TEST_F(EpisodeReaderTest, SortsMessagesThatWereRecordedOutOfOrder) {
  Begin(0);
  for (const int64_t tick : {0, 2, 1, 3}) State(0, 0, tick);
  for (const int64_t tick : {1, 0}) Action(0, 0, tick);
  const auto episodes = Read();
  ASSERT_EQ(episodes.size(), 1u);
  EXPECT_THAT(Ticks(episodes[0].states), ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(Ticks(episodes[0].actions), ElementsAre(0, 1));
}

// If a message of the first attempt arrives after the second has begun, it does not belong to the second.
TEST_F(EpisodeReaderTest, AttemptsAreSeparate) {
  Begin(0, 0);
  State(0, 0, 0);
  State(0, 0, 1);
  Begin(0, 1);
  Action(0, 0, 0);
  End(0, 0, "aborted");
  State(0, 1, 0);
  Action(0, 1, 0);
  const auto episodes = Read();
  ASSERT_EQ(episodes.size(), 2u);
  EXPECT_THAT(Ticks(episodes[0].states), ElementsAre(0, 1));
  EXPECT_THAT(episodes[0].actions, IsEmpty());
  EXPECT_THAT(Ticks(episodes[1].states), ElementsAre(0));
  EXPECT_THAT(Ticks(episodes[1].actions), ElementsAre(0));
  EXPECT_EQ(episodes[1].first_header.attempt, 1);
  EXPECT_EQ(episodes[1].outcome(), "");
}

// The log contains two replays of one run, recorded by lcm-logger.
TEST_F(EpisodeReaderTest, AnEpisodeAfterItsEndIsAnotherOne) {
  Model("first");
  Begin(0);
  State(0, 0, 0);
  End(0, 0, "time_limit");
  Model("second");
  Begin(0);
  State(0, 0, 0);
  State(0, 0, 1);
  const auto episodes = Read();
  ASSERT_EQ(episodes.size(), 2u);
  EXPECT_EQ(episodes[0].model->task, "first");
  EXPECT_EQ(episodes[1].model->task, "second");
  EXPECT_THAT(Ticks(episodes[1].states), ElementsAre(0, 1));
}

TEST_F(EpisodeReaderTest, StatesWhyAnEpisodeIsNotWhole) {
  Model("lift_pot");
  Begin(0);
  State(0, 0, 0);
  Begin(1);
  State(1, 0, 0);
  End(1, 0, "time_limit");
  episode_summary_t summary{};
  summary.header = Header(1, 0, 0);
  Write(channels::kEpisodeSummary, summary);
  writer_.Close();
  const auto reasons = [&] {
    EpisodeReader reader(log_);
    std::vector<EpisodeMessages> episodes;
    for (EpisodeMessages episode; reader.Next(&episode);) episodes.push_back(episode);
    std::vector<std::string> all = {reader.WhyNotWhole(nullptr)};
    for (const EpisodeMessages& episode : episodes) all.push_back(reader.WhyNotWhole(&episode));
    return all;
  };
  EXPECT_THAT(reasons(), ElementsAre("no episode in this log (MODEL and EPISODE_BEGIN)",
                                     "the end of the episode is missing (EPISODE_END, EPISODE_SUMMARY)", ""));
  fs::resize_file(log_, fs::file_size(log_) - 1);
  EXPECT_THAT(reasons(), testing::Each(testing::StartsWith("damaged: ")));
}

TEST_F(EpisodeReaderTest, DamagedTimesAreIgnored) {
  Begin(0);
  State(0, 0, 0);
  State(0, 0, 1, 61'000'000);
  State(0, 0, 2);
  State(0, 0, 3, 2 * kTick_us);
  State(0, 0, 4, kMaxSimTimeUs + 1);
  State(0, 0, kMaxTick + 1, 5 * kTick_us);
  State(0, 0, 5);
  const auto episodes = Read();
  ASSERT_EQ(episodes.size(), 1u);
  EXPECT_THAT(Ticks(episodes[0].states), ElementsAre(0, 2, 5));
}

// The beginning of the log is lost. The first message of a tick determines the episode, even if this episode
// was not requested.
TEST_F(EpisodeReaderTest, BeginningMayBeMissing) {
  End(6, 0, "end of an episode that is not in the log");
  State(7, 2, 5);
  State(7, 2, 6);
  End(7, 2, "time_limit");
  Begin(8);
  State(8, 0, 0);
  const auto episodes = Read({channels::kState}, [](int number) { return number == 8; });
  ASSERT_EQ(episodes.size(), 2u);
  EXPECT_EQ(episodes[0].number(), 7);
  EXPECT_FALSE(episodes[0].begin);
  EXPECT_EQ(episodes[0].outcome(), "time limit");
  EXPECT_THAT(episodes[0].states, IsEmpty());
  EXPECT_EQ(episodes[1].number(), 8);
  EXPECT_THAT(Ticks(episodes[1].states), ElementsAre(0));
}

TEST_F(EpisodeReaderTest, OnlyTheChannelsAskedForAreDecoded) {
  Begin(0);
  State(0, 0, 0);
  Action(0, 0, 0);
  const auto episodes = Read({channels::kAction});
  ASSERT_EQ(episodes.size(), 1u);
  EXPECT_THAT(episodes[0].states, IsEmpty());
  EXPECT_THAT(Ticks(episodes[0].actions), ElementsAre(0));
}

TEST_F(EpisodeReaderTest, MessagesOfAnotherTypeAreIgnored) {
  Begin(0);
  State(0, 0, 0);
  writer_.Write(channels::kState, Encode(action_t{}), 0);
  writer_.Write(channels::kEpisodeEnd, std::vector<uint8_t>(5), 0);
  const auto episodes = Read();
  ASSERT_EQ(episodes.size(), 1u);
  EXPECT_THAT(Ticks(episodes[0].states), ElementsAre(0));
  EXPECT_FALSE(episodes[0].end);
}

TEST_F(EpisodeReaderTest, LogWithoutEpisodeHasNone) {
  Model("lift_pot");
  EXPECT_THAT(Read(), IsEmpty());
  EXPECT_THROW(EpisodeReader(folder_.path() / "none"), InputError);
}

}  // namespace evalbus::episode_reader_test
