// Tests live images with scripted messages.
#include "viz/viz_component.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/errors.h"
#include "bus/channels.h"
#include "tests/deadline.h"
#include "tests/unit/temporary_folder.h"
#include "tests/unit/viz/decoded_jpeg.h"
#include "tests/unit/viz/viz_scene.h"

namespace evalbus::viz::viz_component_test {

using std::chrono::milliseconds;

constexpr FrameSize kSize{160, 120};

TEST(JpegEncoder, GivesTheImageBack) {
  Frame frame({64, 32});
  for (size_t i = 0; i < frame.bgrx.size(); i += 4) {
    const bool left = i / 4 % 64 < 32, top = i / 4 / 64 < 16;
    frame.bgrx[i] = left ? 200 : 30;
    frame.bgrx[i + 1] = top ? 180 : 60;
    frame.bgrx[i + 2] = left ? 20 : 220;
  }
  const Frame again = DecodedJpeg(JpegEncoder().Encode(frame));
  ASSERT_EQ(again.size.width, 64);
  ASSERT_EQ(again.size.height, 32);
  double difference = 0;
  for (size_t i = 0; i < frame.bgrx.size(); ++i) {
    if (i % 4 != 3) difference += std::abs(frame.bgrx[i] - again.bgrx[i]);
  }
  EXPECT_LT(difference / (64 * 32 * 3), 3);
}

class VizComponentTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { scene_ = new Scene(LiftPotScene()); }
  static void TearDownTestSuite() { delete scene_; }

  VizComponentTest() : viz_(&bus_, {{"front", "left/hand/wrist"}, kSize, 10}) {
    for (const char* channel : {"EVALBUS_IMAGE_front", "EVALBUS_IMAGE_left_hand_wrist"}) {
      bus_.Subscribe(Channel<image_t>{channel, "viz"}, [this, channel](const image_t& image) {
        EXPECT_EQ(channels::ImageChannel(image.view.camera), channel);
        images_.push_back(image);
      });
    }
  }

  void Handle() {
    while (bus_.Handle()) {
    }
  }
  void PublishModel() {
    bus_.Publish(channels::kModel, VisualInfo(folder_.path(), *scene_->visual));
    Handle();
  }
  void PublishBegin(int episode, int attempt = 0) {
    episode_begin_t begin{};
    begin.header.episode = episode;
    begin.header.attempt = attempt;
    begin.seed = 7;
    bus_.Publish(channels::kEpisodeBegin, begin);
    Handle();
  }
  header_t Header(int episode, int64_t tick) {
    header_t header{};
    header.episode = episode;
    header.tick = tick;
    header.sim_time_us = tick * 20000;
    return header;
  }
  void PublishState(int episode, int64_t tick) {
    state_t state = StateOf(HomeQpos(*scene_->visual));
    state.header = Header(episode, tick);
    bus_.Publish(channels::kState, state);
  }
  // Polls when the next frame is due, and returns its images.
  std::vector<image_t> Poll(milliseconds later = milliseconds(100)) {
    images_.clear();
    viz_.Poll(now_ += later);
    Handle();
    return images_;
  }

  static inline Scene* scene_ = nullptr;
  TemporaryFolder folder_;
  Bus bus_{"memq://"};
  VizComponent viz_;
  std::vector<image_t> images_;
  SteadyTime now_ = std::chrono::steady_clock::now();
};

TEST_F(VizComponentTest, ShowsTheNewestStateAndCountsWhatItPassesOver) {
  PublishModel();
  PublishBegin(3);
  EXPECT_EQ(viz_.status().state, component_status_t::READY);
  EXPECT_TRUE(Poll().empty());
  for (int64_t tick = 0; tick < 10; ++tick) PublishState(3, tick);
  // viz receives the first message and, before it renders, all others.
  bus_.Handle();
  const std::vector<image_t> first = Poll();
  ASSERT_EQ(first.size(), 2u);
  EXPECT_EQ(first[0].view.camera, "front");
  EXPECT_EQ(first[1].view.camera, "left/hand/wrist");
  for (const image_t& image : first) {
    EXPECT_EQ(image.header.episode, 3);
    EXPECT_EQ(image.header.tick, 9);
    EXPECT_EQ(image.header.sim_time_us, 180000);
    EXPECT_EQ(image.view.encoding, "jpeg");
    const Frame frame = DecodedJpeg(image.data);
    EXPECT_EQ(image.view.width_px, 160);
    EXPECT_EQ(image.view.height_px, 120);
    EXPECT_EQ(frame.size.width, 160);
    EXPECT_EQ(frame.size.height, 120);
  }
  EXPECT_EQ(viz_.status().last_tick, 9);
  EXPECT_EQ(viz_.status().skipped_ticks, 9);
  EXPECT_EQ(viz_.status().missing_ticks, 0);
  EXPECT_TRUE(Poll().empty());
  // Neither a rendered tick nor a tick that never arrived counts as skipped.
  PublishState(3, 12);
  Handle();
  EXPECT_EQ(Poll().size(), 2u);
  EXPECT_EQ(viz_.status().skipped_ticks, 9);
  EXPECT_EQ(viz_.status().missing_ticks, 2);
}

TEST_F(VizComponentTest, RendersNoMoreFramesThanRequested) {
  PublishModel();
  PublishBegin(0);
  int frames = 0;
  for (int64_t tick = 0; tick < 100; ++tick) {
    PublishState(0, tick);
    Handle();
    frames += static_cast<int>(Poll(milliseconds(20)).size());
  }
  // 2 s at 10 frames per second from 2 cameras are 40 images.
  EXPECT_EQ(frames, 40);
  // 20 of 100 ticks are in a frame, and the last tick may still be rendered.
  EXPECT_EQ(viz_.status().skipped_ticks, 79);
}

TEST_F(VizComponentTest, ShowsTheSameAsAVideo) {
  PublishModel();
  PublishBegin(0);
  PublishState(0, 5);
  partial_metrics_t partial{};
  partial.header = Header(0, 5);
  partial.metrics.num_stages = 1;
  partial.metrics.stage_index = {1};
  partial.metrics.stage_name = {"pot_lifted"};
  partial.metrics.stage_reached = {1};
  bus_.Publish(channels::kPartial, partial);
  Handle();
  const auto images = Poll();
  ASSERT_EQ(images.size(), 2u);

  Renderer renderer(Copy(*scene_->visual), kSize);
  Frame frame(kSize);
  renderer.SetState(StateOf(HomeQpos(*scene_->visual)));
  renderer.Render(FindCamera(renderer.model(), "front"), &frame);
  OverlayText text;
  text.title = "lift_pot/base";
  text.subtitle = "episode 0";
  text.maker = "bimanual_panda";
  text.clock = "0.10 s";
  text.stages = {{"pot_lifted", true}};
  Overlay(kSize).Draw(text, &frame);
  EXPECT_TRUE(images[0].data == JpegEncoder().Encode(frame));

  // The end is shown in a separate image of the same tick.
  episode_end_t end{};
  end.header = Header(0, 5);
  end.end_reason = "success";
  bus_.Publish(channels::kEpisodeEnd, end);
  Handle();
  const auto last = Poll();
  ASSERT_EQ(last.size(), 2u);
  EXPECT_EQ(last[0].header.tick, 5);
  EXPECT_FALSE(last[0].data == images[0].data);

  // The outcome from the score is shown once it has arrived.
  episode_summary_t summary{};
  summary.header = Header(0, 5);
  summary.failure_reason = "grasp_slip";
  bus_.Publish(channels::kEpisodeSummary, summary);
  Handle();
  const auto scored = Poll();
  ASSERT_EQ(scored.size(), 2u);
  text.end_reason = "slipped from the gripper";
  renderer.Render(FindCamera(renderer.model(), "front"), &frame);
  Overlay(kSize).Draw(text, &frame);
  EXPECT_TRUE(scored[0].data == JpegEncoder().Encode(frame));
  bus_.Publish(channels::kEpisodeEnd, end);
  Handle();
  EXPECT_TRUE(Poll().empty());
}

TEST_F(VizComponentTest, MayComeInTheMiddleOfAnEpisode) {
  PublishState(4, 70);
  Handle();
  EXPECT_TRUE(Poll().empty());
  PublishModel();
  PublishState(4, 71);
  Handle();
  const auto images = Poll();
  ASSERT_EQ(images.size(), 2u);
  EXPECT_EQ(images[0].header.tick, 71);
  EXPECT_EQ(viz_.status().episode, 4);
  EXPECT_EQ(viz_.status().missing_ticks, 0);
  EXPECT_EQ(viz_.status().skipped_ticks, 1);
}

TEST_F(VizComponentTest, ANewAttemptBeginsAtItsFirstTick) {
  PublishModel();
  PublishBegin(0);
  PublishState(0, 0);
  PublishState(0, 1);
  Handle();
  Poll();
  PublishBegin(0, 1);
  PublishState(0, 0);
  Handle();
  const auto images = Poll();
  ASSERT_EQ(images.size(), 2u);
  EXPECT_EQ(images[0].header.tick, 0);
  EXPECT_EQ(viz_.status().missing_ticks, 0);
  EXPECT_EQ(viz_.status().foreign_messages, 0);
  EXPECT_EQ(viz_.status().skipped_ticks, 1);
}

TEST_F(VizComponentTest, TheSameEpisodeMayBeginAgain) {
  PublishModel();
  for (int replay = 0; replay < 2; ++replay) {
    PublishBegin(0);
    PublishBegin(0);
    PublishState(0, 0);
    PublishState(0, 1);
    Handle();
    const auto images = Poll();
    ASSERT_EQ(images.size(), 2u);
    EXPECT_EQ(images[0].header.tick, 1);
  }
  EXPECT_EQ(viz_.status().foreign_messages, 0);
  EXPECT_EQ(viz_.status().skipped_ticks, 2);
}

TEST_F(VizComponentTest, AModelThatCannotBeShownDoesNotEndWhatIs) {
  PublishModel();
  PublishBegin(0);
  model_info_t other = VisualInfo(folder_.path(), *scene_->visual);
  other.message_version = 99;
  bus_.Publish(channels::kModel, other);
  other = VisualInfo(folder_.path(), *scene_->visual);
  other.visual_file = "/nowhere/model/visual.mjb";
  other.visual_sha256 = "none";
  bus_.Publish(channels::kModel, other);
  Handle();
  EXPECT_EQ(viz_.status().foreign_messages, 2);
  PublishState(0, 0);
  Handle();
  EXPECT_EQ(Poll().size(), 2u);
}

TEST_F(VizComponentTest, MistakesAreErrors) {
  Bus bus("memq://");
  EXPECT_THROW(VizComponent(&bus, {{"front"}, {161, 120}, 10}), InputError);
  EXPECT_THROW(VizComponent(&bus, {{"front"}, kSize, 0}), InputError);
  VizComponent viz(&bus, {{"nowhere"}, kSize, 10});
  bus.Publish(channels::kModel, VisualInfo(folder_.path(), *scene_->visual));
  EXPECT_THROW(bus.Handle(std::chrono::steady_clock::now() + kDeadline), InputError);
}

}  // namespace evalbus::viz::viz_component_test
