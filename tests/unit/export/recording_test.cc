#include "export/recording.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "bus/channels.h"
#include "bus/event_log.h"
#include "bus/message.h"
#include "evalbus/episode_begin_t.hpp"
#include "evalbus/episode_summary_t.hpp"
#include "tests/unit/small_world.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::exports::recording_test {

// The beginning of the log is lost. Without an error, an MCAP file without the requested images would look as
// if the cameras had recorded none.
TEST(AddImages, RefusesALogWithoutItsBeginning) {
  const TemporaryFolder folder;
  const std::filesystem::path log = folder.path() / "events.lcmlog";
  EventLogWriter writer(log);
  writer.Write(channels::kState, Encode(state_t{}), 0);
  writer.Close();
  EncodedEpisode episode;
  try {
    AddImages(log, {"head"}, "64x48", &episode);
    FAIL() << "no error";
  } catch (const InputError& error) {
    EXPECT_EQ(error.what(),
              log.string() + ": images cannot be rendered: no complete MODEL and EPISODE_BEGIN");
  }
  EXPECT_TRUE(episode.topics.empty());
}

// A policy whose first action is an error ends its episode at tick 0, so begin and result have equal times.
TEST(EncodeEpisode, KeepsTheTopicsOfAnEpisodeThatEndsAtItsFirstTick) {
  const TemporaryFolder folder;
  const std::filesystem::path log = folder.path() / "events.lcmlog";
  EventLogWriter writer(log);
  const auto write = [&](const auto& channel, const auto& message) {
    writer.Write(channel.name, Encode(message), 0);
  };
  write(channels::kModel, small_world::Model());
  const auto write_attempt = [&](int attempt) {
    episode_begin_t begin{};
    begin.header = small_world::Header(0);
    begin.header.attempt = attempt;
    begin.seed = 77;
    write(channels::kEpisodeBegin, begin);
    state_t state = small_world::State(0);
    state.header.attempt = attempt;
    write(channels::kState, state);
    episode_summary_t summary{};
    summary.header = begin.header;
    summary.end_reason = "policy_error";
    write(channels::kEpisodeSummary, summary);
  };
  write_attempt(0);
  write_attempt(1);
  writer.Close();
  SceneSource scenes;
  const EncodedEpisode episode = EncodeEpisode(log, &scenes);
  const auto count = [&](TopicId topic) {
    return std::ranges::count(episode.messages, topic, &Message::topic);
  };
  // Only the last attempt is kept.
  EXPECT_EQ(count(kTransforms), 1);
  EXPECT_EQ(count(kRobot), 1);
  EXPECT_EQ(count(kEpisode), 2);
  for (const Message& message : episode.messages) {
    if (message.topic != kEpisode) continue;
    EXPECT_EQ(nlohmann::json::parse(*message.json)["attempt"], 1);
  }
}

}  // namespace evalbus::exports::recording_test
