#include "viz/viewer/grasp_watch.h"

#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <tuple>

#include "metrics/episode/episode_scorer.h"
#include "tests/unit/small_world.h"
#include "viz/viewer/episode_track.h"

namespace evalbus::viz::grasp_watch_test {

using namespace small_world;
using metrics::EpisodeScorer;

// The left gripper has two fingers and the right one has one.
model_info_t ModelWithFingers() {
  model_info_t model = Model();
  model.gripper[0].pad_geom = {kLeftPad, kLeftLink};
  model.gripper[0].num_pad_geoms = 2;
  return model;
}

struct Messages {
  state_t state;
  contacts_t contacts;
  partial_metrics_t partial;
};

// Fingers touch and leave the pot at random for 1 to 12 ticks. Interruptions are therefore both shorter and
// longer than the 5 ticks that separate two grasps. At tick `success` the pot is lifted.
std::vector<Messages> Episode(unsigned seed, int64_t ticks, int64_t success, EpisodeScorer* scorer) {
  std::mt19937 random(seed);
  constexpr int kPads[] = {kLeftPad, kLeftLink, kRightPad};
  bool touches[3] = {};
  int64_t until[3] = {};
  std::vector<Messages> episode;
  for (int64_t tick = 0; tick < ticks; ++tick) {
    std::vector<std::pair<int, int>> pairs;
    if (tick < success) pairs.emplace_back(kTop, kWall);
    for (int k = 0; k < 3; ++k) {
      if (tick >= until[k]) {
        touches[k] = !touches[k];
        until[k] = tick + 1 + static_cast<int64_t>(random() % 12);
      }
      if (touches[k]) pairs.emplace_back(kPads[k], random() % 2 ? kWall : kLidGeom);
    }
    Messages& messages = episode.emplace_back(Messages{State(tick), Contacts(tick, pairs), {}});
    if (tick >= success) messages.state.body[kPot].position_m[2] = 1.2;
    scorer->Tick(messages.state, messages.contacts);
    scorer->Partial(&messages.partial);
  }
  return episode;
}

void Receive(const Messages& messages, EpisodeTrack* track) {
  track->Receive(messages.state);
  track->Receive(messages.contacts);
  track->Receive(messages.partial);
}

using Event = std::tuple<int64_t, TrackEvent::Kind, std::string, double>;

// Returns grasps, releases and slips. Slips lack the gripper, which is unknown while an episode runs.
std::vector<Event> EventsOf(const EpisodeTrack& track) {
  std::vector<Event> events;
  for (const TrackEvent& event : track.Events()) {
    const bool is_slip = event.kind == TrackEvent::Kind::kSlip;
    if (!is_slip && event.kind != TrackEvent::Kind::kGrasp && event.kind != TrackEvent::Kind::kRelease)
      continue;
    events.emplace_back(event.tick, event.kind, is_slip ? event.object : event.text, event.duration);
  }
  return events;
}

// At every tick, the grasps of an active episode equal the grasps in the summary of an episode that ends at
// this tick.
TEST(GraspWatch, EqualsTheSummaryAtEveryTick) {
  constexpr int64_t kTicks = 90, kSuccess = 70;
  const auto model = std::make_shared<model_info_t>(ModelWithFingers());
  size_t grasps = 0;
  for (unsigned seed = 1; seed <= 8; ++seed) {
    EpisodeScorer all(*model, ParseTask(kTask, "small.yaml", false));
    const std::vector<Messages> episode = Episode(seed, kTicks, kSuccess, &all);
    EpisodeTrack live(model, Header(0), {});
    EpisodeScorer scorer(*model, ParseTask(kTask, "small.yaml", false));
    for (int64_t tick = 0; tick < kTicks; ++tick) {
      const Messages& now = episode[static_cast<size_t>(tick)];
      Receive(now, &live);
      scorer.Tick(now.state, now.contacts);
      EpisodeTrack recorded(model, Header(0), {});
      for (int64_t k = 0; k <= tick; ++k) Receive(episode[static_cast<size_t>(k)], &recorded);
      episode_end_t end{};
      end.header = Header(tick);
      end.end_reason = "time_limit";
      recorded.Receive(scorer.Summary({}, end));
      ASSERT_EQ(EventsOf(live), EventsOf(recorded)) << "seed " << seed << ", tick " << tick;
    }
    grasps += EventsOf(live).size();
  }
  EXPECT_GT(grasps, 40u);
}

TEST(GraspWatch, AnObjectInOneFingerIsNotGrasped) {
  const model_info_t model = ModelWithFingers();
  const ModelNames names(model);
  const GraspWatch dut(names);
  EXPECT_TRUE(dut.Pinched(Contacts(1, {{kLeftPad, kWall}, {kTop, kWall}})).empty());
  EXPECT_EQ(dut.Pinched(Contacts(1, {{kLeftPad, kWall}, {kLidGeom, kLeftLink}})), (std::vector<uint16_t>{0}));
  EXPECT_EQ(dut.Pinched(Contacts(1, {{kWall, kRightPad}})), (std::vector<uint16_t>{1}));
}

}  // namespace evalbus::viz::grasp_watch_test
