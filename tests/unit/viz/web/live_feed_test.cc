// Tests which messages viewers receive of a run that is faster than they read.
#include "viz/web/live_feed.h"

#include <gmock/gmock.h>

#include "bus/channels.h"
#include "bus/message.h"
#include "tests/unit/small_world.h"
#include "viz/viewer/block.h"

namespace evalbus::viz::live_feed_test {

using namespace small_world;
using namespace std::chrono_literals;
using testing::ElementsAre;

class LiveFeedTest : public testing::Test {
 protected:
  void SetUp() override {
    Receive(channels::kModel, Model());
    feed_.SetScene(feed_.model_without_scene(), {});
  }

  template <class Message>
  void Receive(const Channel<Message>& channel, const Message& message) {
    feed_.Receive(channel.name, Encode(message), now_, "12:00:00");
  }
  void Begin(int episode) {
    episode_begin_t begin{};
    begin.header = HeaderOf(episode, 0);
    Receive(channels::kEpisodeBegin, begin);
  }
  void Tick(int episode, int64_t tick) {
    state_t state = State(tick);
    state.header = HeaderOf(episode, tick);
    Receive(channels::kState, state);
    contacts_t contacts = Contacts(tick);
    contacts.header = state.header;
    Receive(channels::kContacts, contacts);
    partial_metrics_t partial{};
    partial.header = state.header;
    Receive(channels::kPartial, partial);
  }
  static episode_summary_t Summary(int episode, int64_t tick) {
    episode_summary_t summary{};
    summary.header = HeaderOf(episode, tick);
    summary.end_reason = "time_limit";
    return summary;
  }
  void End(int episode, int64_t tick) { Receive(channels::kEpisodeSummary, Summary(episode, tick)); }
  // Begins episode 0, of which the viewer receives four ticks.
  void BeginWatched(UpdateBroadcaster::Viewer* viewer) {
    broadcaster_.Enter(viewer);
    Begin(0);
    for (int64_t tick = 0; tick < 4; ++tick) Tick(0, tick);
    Publish();
    EXPECT_THAT(Given(viewer), ElementsAre(std::pair(0, false)));
  }
  // Publishes one second after the previous call.
  void Publish() {
    now_ += 1s;
    feed_.Publish(&broadcaster_, {}, nullptr, now_);
  }
  // Returns the episodes that this viewer receives, and whether they have ended.
  std::vector<std::pair<int, bool>> Given(UpdateBroadcaster::Viewer* viewer) {
    std::vector<std::pair<int, bool>> given;
    while (const SharedBytes bytes = broadcaster_.Next(viewer)) {
      const BlockReader block(*bytes);
      if (block.head()["block"] != "episode") continue;
      given.emplace_back(block.head()["episode"].get<int>(), block.head()["is_over"].get<bool>());
    }
    return given;
  }
  static header_t HeaderOf(int episode, int64_t tick) {
    header_t header = Header(tick);
    header.episode = episode;
    return header;
  }

  SteadyTime now_ = SteadyTime() + 1h;
  LiveFeed feed_{0, "expert", 2};
  UpdateBroadcaster broadcaster_;
};

TEST_F(LiveFeedTest, AnEpisodesEndIsSentEvenIfTheNextOneHasBegun) {
  UpdateBroadcaster::Viewer viewer;
  BeginWatched(&viewer);
  Tick(0, 4);
  End(0, 4);
  Begin(1);
  for (int64_t tick = 0; tick < 4; ++tick) Tick(1, tick);
  Publish();
  EXPECT_THAT(Given(&viewer), ElementsAre(std::pair(0, true)));
  Publish();
  EXPECT_THAT(Given(&viewer), ElementsAre(std::pair(1, false)));
  // Data is not sent twice.
  Tick(1, 4);
  End(1, 4);
  Publish();
  EXPECT_THAT(Given(&viewer), ElementsAre(std::pair(1, true)));
  Begin(2);
  for (int64_t tick = 0; tick < 4; ++tick) Tick(2, tick);
  Publish();
  EXPECT_THAT(Given(&viewer), ElementsAre(std::pair(2, false)));
}

TEST_F(LiveFeedTest, ALostEndIsTakenFromTheLog) {
  UpdateBroadcaster::Viewer viewer;
  BeginWatched(&viewer);
  const LiveFeed::Message end{channels::kEpisodeSummary.name, Encode(Summary(0, 4))};
  feed_.Complete(HeaderOf(1, 0), {end});
  Publish();
  EXPECT_THAT(Given(&viewer), ElementsAre());
  feed_.Complete(HeaderOf(0, 0), {end, end});
  Publish();
  EXPECT_THAT(Given(&viewer), ElementsAre(std::pair(0, true)));
}

TEST_F(LiveFeedTest, ALateViewerDoesNotReceiveAnOldEpisode) {
  UpdateBroadcaster::Viewer first, second;
  broadcaster_.Enter(&first);
  Begin(0);
  for (int64_t tick = 0; tick < 4; ++tick) Tick(0, tick);
  Publish();
  EXPECT_EQ(Given(&first).size(), 1u);
  broadcaster_.Leave(&first);
  // No viewer is connected now. The next one connects between two calls.
  End(0, 4);
  Begin(1);
  Tick(1, 0);
  Publish();
  broadcaster_.Enter(&second);
  EXPECT_THAT(Given(&second), ElementsAre());
  Publish();
  EXPECT_THAT(Given(&second), ElementsAre(std::pair(1, false)));
}

TEST_F(LiveFeedTest, ImagesOfASourceComeWithTheTicks) {
  EXPECT_TRUE(LiveFeed::Uses("EVALBUS_CAMERA_front"));
  EXPECT_FALSE(LiveFeed::Uses("EVALBUS_IMAGE_front"));
  UpdateBroadcaster::Viewer viewer;
  broadcaster_.Enter(&viewer);
  const auto image = [this](int64_t tick, const std::string& bytes) {
    image_t message{};
    message.header = HeaderOf(0, tick);
    message.view.camera = "front";
    message.view.encoding = "jpeg";
    message.data.assign(bytes.begin(), bytes.end());
    message.num_bytes = static_cast<int32_t>(bytes.size());
    Receive(Channel<image_t>{"EVALBUS_CAMERA_front", "sim"}, message);
  };
  const auto images = [&] {
    std::string all;
    while (const SharedBytes bytes = broadcaster_.Next(&viewer)) {
      const BlockReader block(*bytes);
      const auto kind = block.head()["block"];
      if ((kind == "episode" || kind == "ticks") && block.Has("image_jpeg")) all += block.Raw("image_jpeg");
    }
    return all;
  };
  Begin(0);
  for (int64_t tick = 0; tick < 4; ++tick) Tick(0, tick);
  image(2, "A");
  Publish();
  EXPECT_EQ(images(), "A");
  image(4, "B");
  Tick(0, 4);
  Publish();
  EXPECT_EQ(images(), "AB")
      << "the image of the tick at which the last block ended: it may have come after that block";
  Tick(0, 5);
  Publish();
  EXPECT_EQ(images(), "");
}

}  // namespace evalbus::viz::live_feed_test
