// Tests a policy's images with scripted messages.
#include "viz/camera_component.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>

#include "base/errors.h"
#include "bus/channels.h"
#include "evalbus/log_t.hpp"
#include "models/physics_model.h"
#include "tests/unit/dressed_scene.h"
#include "tests/unit/temporary_folder.h"
#include "tests/unit/viz/viz_scene.h"
#include "viz/viz_component.h"

namespace evalbus::viz::camera_component_test {

view_t View(const std::string& camera, int width, int height, const std::string& encoding = "rgb8") {
  view_t view{};
  view.camera = camera;
  view.width_px = width;
  view.height_px = height;
  view.shadows = 1;
  view.encoding = encoding;
  return view;
}

class CameraComponentTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { scene_ = new Scene(LiftPotScene()); }
  static void TearDownTestSuite() { delete scene_; }

  // A component on its own bus and the messages that it publishes.
  struct Process {
    explicit Process(const std::vector<std::string>& cameras = {"front", "left/hand/wrist", "roboeval/head"})
        : component(&bus) {
      for (const std::string& camera : cameras) {
        const std::string channel = channels::ImageChannel(camera);
        bus.Subscribe(Channel<image_t>{channel.c_str(), "cameras"}, [this, camera](const image_t& image) {
          EXPECT_EQ(image.view.camera, camera);
          EXPECT_EQ(static_cast<size_t>(image.num_bytes), image.data.size());
          images.push_back(image);
        });
      }
      bus.Subscribe(channels::kLog, [this](const log_t& line) { log += line.text + "\n"; });
    }

    template <class Message>
    void Publish(const Channel<Message>& channel, const Message& message) {
      bus.Publish(channel, message);
      while (bus.Handle()) {
      }
    }
    void PublishModel(const model_info_t& info) { Publish(channels::kModel, info); }
    void PublishBegin(int episode, int attempt = 0, int64_t seed = 7) {
      episode_begin_t begin{};
      begin.header = Header(0, episode, attempt);
      begin.seed = seed;
      Publish(channels::kEpisodeBegin, begin);
    }
    void PublishState(int64_t tick, int episode = 0, int attempt = 0) {
      Publish(channels::kState, StateAt(tick, episode, attempt));
    }
    // Publishes a request and returns the images that are published in response.
    std::vector<image_t> RequestImages(int64_t tick, const std::vector<view_t>& views, int episode = 0,
                                       int attempt = 0) {
      image_request_t request{};
      request.header = Header(tick, episode, attempt);
      request.num_views = static_cast<int32_t>(views.size());
      request.view = views;
      images.clear();
      Publish(channels::kRequestImage, request);
      return images;
    }

    Bus bus{"memq://"};
    CameraComponent component;
    std::vector<image_t> images;
    std::string log;
  };

  static header_t Header(int64_t tick, int episode = 0, int attempt = 0) {
    header_t header{};
    header.episode = episode;
    header.attempt = attempt;
    header.tick = tick;
    header.sim_time_us = tick * 20000;
    return header;
  }
  // Returns a STATE in which the left arm has rotated in proportion to the tick.
  static state_t StateAt(int64_t tick, int episode = 0, int attempt = 0) {
    std::vector<double> qpos = HomeQpos(*scene_->visual);
    qpos[static_cast<size_t>(QposIndex(*scene_->visual, "left/joint1"))] = 0.05 * static_cast<double>(tick);
    state_t state = StateOf(qpos);
    state.header = Header(tick, episode, attempt);
    return state;
  }
  // Returns the same image, rendered without the component.
  std::vector<uint8_t> Drawn(int64_t tick, const view_t& view) {
    Renderer renderer(Copy(*scene_->visual), {64, 64});
    renderer.SetState(StateAt(tick));
    std::vector<uint8_t> rgb;
    renderer.RenderRgb({FindCamera(renderer.model(), view.camera),
                        {view.width_px, view.height_px},
                        view.fovy_deg,
                        view.shadows != 0},
                       &rgb);
    return rgb;
  }
  model_info_t Info() { return VisualInfo(folder_.path(), *scene_->visual); }
  void Begin(Process* process) {
    process->PublishModel(Info());
    process->PublishBegin(0);
    ASSERT_EQ(process->component.status().state, component_status_t::READY);
  }

  static inline Scene* scene_ = nullptr;
  TemporaryFolder folder_;
  const std::vector<view_t> views_ = {View("front", 64, 48), View("left/hand/wrist", 33, 33)};
};

TEST_F(CameraComponentTest, RendersOnlyRequestedImages) {
  Process process;
  Begin(&process);
  for (int64_t tick = 0; tick < 20; ++tick) process.PublishState(tick);
  EXPECT_EQ(process.component.num_drawn(), 0);
  EXPECT_TRUE(process.images.empty());
  EXPECT_EQ(process.component.status().last_tick, 19);
  process.RequestImages(19, {views_[0]});
  EXPECT_EQ(process.component.num_drawn(), 1);
}

TEST_F(CameraComponentTest, ShowsExactlyTheRequestedTick) {
  Process process;
  Begin(&process);
  for (int64_t tick = 0; tick < 4; ++tick) {
    process.PublishState(tick);
    if (tick == 2) continue;
    const std::vector<image_t> images = process.RequestImages(tick, views_);
    ASSERT_EQ(images.size(), 2u);
    for (size_t i = 0; i < 2; ++i) {
      EXPECT_EQ(images[i].header.tick, tick);
      EXPECT_EQ(images[i].header.sim_time_us, tick * 20000);
      EXPECT_EQ(images[i].view.camera, views_[i].camera);
      EXPECT_EQ(images[i].view.width_px, views_[i].width_px);
      EXPECT_EQ(images[i].view.height_px, views_[i].height_px);
      EXPECT_EQ(images[i].view.encoding, "rgb8");
      EXPECT_TRUE(images[i].data == Drawn(tick, views_[i]));
    }
  }
  EXPECT_FALSE(Drawn(2, views_[0]) == Drawn(3, views_[0]));
  EXPECT_EQ(process.component.status().foreign_messages, 0);
  EXPECT_EQ(process.component.status().skipped_ticks, 0);
  EXPECT_EQ(process.component.status().missing_ticks, 0);
}

// The log of the episode is later rendered with the texture and the light that the policy saw.
TEST_F(CameraComponentTest, ShowsTheTextureAndTheLightOfTheSeed) {
  const Scene dressed = BuildDressed("lift_pot",
                                     "      - texture: {of: [left_cabinet, right_cabinet], choices: "
                                     "[left_cabinet/oak, marble, checker]}\n"
                                     "      - light: {name: key, turn_deg: 20}\n")
                            .scene;
  model_info_t info = VisualInfo(folder_.path(), *dressed.visual);
  info.task_yaml = dressed.info.task_yaml;
  info.variation = "dressed";
  Process process;
  process.PublishModel(info);
  std::set<std::vector<uint8_t>> different;
  for (int episode = 0; episode < 3; ++episode) {
    const int64_t seed = 10 + episode;
    process.PublishBegin(episode, 0, seed);
    process.PublishState(0, episode);
    const std::vector<image_t> live = process.RequestImages(0, {views_[0]}, episode);
    ASSERT_EQ(live.size(), 1u);
    Renderer renderer(LoadVisualModel(info), {64, 64});
    renderer.SetAppearance(info, seed);
    renderer.SetState(StateAt(0));
    std::vector<uint8_t> replayed;
    renderer.RenderRgb({FindCamera(renderer.model(), "front"), {64, 48}, 0, true}, &replayed);
    EXPECT_TRUE(live[0].data == replayed);
    different.insert(replayed);
  }
  EXPECT_EQ(different.size(), 3u);
}

TEST_F(CameraComponentTest, WaitsForTheState) {
  Process process;
  Begin(&process);
  process.PublishState(0);
  EXPECT_TRUE(process.RequestImages(2, {views_[0]}).empty());
  process.PublishState(1);
  EXPECT_TRUE(process.images.empty());
  process.PublishState(2);
  ASSERT_EQ(process.images.size(), 1u);
  EXPECT_EQ(process.images[0].header.tick, 2);
  EXPECT_TRUE(process.images[0].data == Drawn(2, views_[0]));
  // The images are published only once.
  process.PublishState(3);
  EXPECT_EQ(process.images.size(), 1u);
}

TEST_F(CameraComponentTest, RepeatsImagesThatItHasRendered) {
  Process process;
  Begin(&process);
  process.PublishState(0);
  const std::vector<image_t> first = process.RequestImages(0, views_);
  ASSERT_EQ(first.size(), 2u);
  const std::vector<image_t> again = process.RequestImages(0, views_);
  ASSERT_EQ(again.size(), 2u);
  for (size_t i = 0; i < 2; ++i) EXPECT_TRUE(again[i].data == first[i].data);
  // A request for one of the images is answered even after the next STATE has arrived.
  process.PublishState(1);
  const std::vector<image_t> late = process.RequestImages(0, {views_[1]});
  ASSERT_EQ(late.size(), 1u);
  EXPECT_EQ(late[0].header.tick, 0);
  EXPECT_TRUE(late[0].data == first[1].data);
  EXPECT_EQ(process.component.num_drawn(), 2);
  EXPECT_EQ(process.component.status().skipped_ticks, 0);
}

TEST_F(CameraComponentTest, DrawsATickThatNewerOnesHaveFollowed) {
  Process process;
  Begin(&process);
  for (int64_t tick = 0; tick < 5; ++tick) process.PublishState(tick);
  for (const int64_t tick : {1, 4, 0}) {
    const std::vector<image_t> images = process.RequestImages(tick, views_);
    ASSERT_EQ(images.size(), 2u);
    EXPECT_EQ(images[0].header.tick, tick);
    for (size_t i = 0; i < 2; ++i) EXPECT_TRUE(images[i].data == Drawn(tick, views_[i]));
  }
  EXPECT_EQ(process.component.status().skipped_ticks, 0);
}

TEST_F(CameraComponentTest, AnswersATickThatItNoLongerHasWithAnEmptyImage) {
  Process process;
  Begin(&process);
  const auto num_states = static_cast<int64_t>(CameraComponent::kKeptStates);
  for (int64_t tick = 0; tick <= num_states; ++tick) process.PublishState(tick);
  const std::vector<image_t> gone = process.RequestImages(0, views_);
  ASSERT_EQ(gone.size(), 1u);
  EXPECT_TRUE(gone[0].data.empty());
  EXPECT_EQ(gone[0].header.tick, 0);
  EXPECT_EQ(process.component.status().skipped_ticks, 1);
  EXPECT_EQ(process.component.num_drawn(), 0);
  EXPECT_EQ(process.log, "a REQUEST_IMAGE for tick 0 arrived at tick 64, too late for its images\n");
  EXPECT_FALSE(process.RequestImages(1, {views_[0]}).at(0).data.empty());
  // A header whose time belongs to another tick matches no STATE.
  image_request_t request{};
  request.header = Header(2);
  request.header.sim_time_us += 1;
  request.num_views = 1;
  request.view = {views_[0]};
  process.images.clear();
  process.Publish(channels::kRequestImage, request);
  EXPECT_TRUE(process.images.at(0).data.empty());
  EXPECT_EQ(process.component.status().skipped_ticks, 2);
  // This request is held for a STATE that is lost.
  EXPECT_TRUE(process.RequestImages(num_states + 1, views_).empty());
  process.PublishState(num_states + 2);
  EXPECT_TRUE(process.images.at(0).data.empty());
  EXPECT_EQ(process.component.status().skipped_ticks, 3);
  EXPECT_EQ(process.component.status().missing_ticks, 1);
}

TEST_F(CameraComponentTest, ReceivesOnlyItsOwnEpisode) {
  Process process;
  // This request arrives before an episode begins.
  EXPECT_TRUE(process.RequestImages(0, views_).empty());
  Begin(&process);
  process.PublishState(0);
  EXPECT_TRUE(process.RequestImages(0, views_, 1).empty());
  EXPECT_TRUE(process.RequestImages(0, views_, 0, 1).empty());
  EXPECT_EQ(process.component.status().foreign_messages, 3);
  // A new attempt begins without a STATE and discards requests that the old one held.
  EXPECT_TRUE(process.RequestImages(1, views_).empty());
  process.PublishBegin(0, 1);
  EXPECT_TRUE(process.RequestImages(0, views_, 0, 1).empty());
  process.PublishState(0, 0, 1);
  ASSERT_EQ(process.images.size(), 2u);
  EXPECT_EQ(process.images[0].header.attempt, 1);
  process.PublishState(1, 0, 1);
  EXPECT_EQ(process.images.size(), 2u);
}

TEST_F(CameraComponentTest, BeginsOnceItsModelIsThere) {
  Process process;
  process.PublishBegin(0);
  EXPECT_EQ(process.component.status().state, component_status_t::IDLE);
  process.PublishModel(Info());
  EXPECT_EQ(process.component.status().state, component_status_t::IDLE);
  process.PublishBegin(0);
  EXPECT_EQ(process.component.status().state, component_status_t::READY);
  EXPECT_EQ(process.component.status().component, "cameras");
}

// The second process has already rendered different images, in a different order.
TEST_F(CameraComponentTest, EqualStatesGiveEqualBytes) {
  std::vector<view_t> views = {View("front", 64, 48), View("roboeval/head", 224, 224),
                               View("roboeval/head", 40, 40, "depth32"), View("left/hand/wrist", 51, 37)};
  views[1].shadows = 0;
  views[3].fovy_deg = 100;
  Process one, other;
  Begin(&one);
  Begin(&other);
  for (int64_t tick = 0; tick < 3; ++tick) one.PublishState(tick);
  const std::vector<image_t> images = one.RequestImages(2, views);
  ASSERT_EQ(images.size(), 4u);
  other.PublishState(0);
  other.RequestImages(0, {View("front", 700, 501)});
  std::reverse(views.begin(), views.end());
  other.RequestImages(2, views);
  other.PublishState(1);
  other.PublishState(2);
  ASSERT_EQ(other.images.size(), 4u);
  for (size_t i = 0; i < 4; ++i) EXPECT_TRUE(other.images[3 - i].data == images[i].data) << i;
}

TEST_F(CameraComponentTest, DepthIsFloatsInMeters) {
  Process process;
  Begin(&process);
  process.PublishState(0);
  const view_t view = View("front", 32, 24, "depth32");
  const std::vector<image_t> images = process.RequestImages(0, {view});
  ASSERT_EQ(images.size(), 1u);
  EXPECT_EQ(images[0].view.encoding, "depth32");
  ASSERT_EQ(images[0].data.size(), 32u * 24 * 4);
  Renderer renderer(Copy(*scene_->visual), {64, 64});
  renderer.SetState(StateAt(0));
  std::vector<float> depth;
  renderer.RenderDepth({FindCamera(renderer.model(), "front"), {32, 24}}, &depth);
  EXPECT_EQ(std::memcmp(images[0].data.data(), depth.data(), images[0].data.size()), 0);
  // Camera "front" is 1.4 m in front of the robot, so the distances in its image are between the nearest
  // object and the end of the room.
  for (const float distance : depth) {
    EXPECT_GT(distance, 0.2);
    EXPECT_LE(distance, 28.01);
  }
}

TEST_F(CameraComponentTest, AnEpisodesColorsAreThoseOfItsSeed) {
  model_info_t info = Info();
  info.variation = "green";
  info.task_yaml = WithVariation(info.task_yaml,
                                 "  green:\n    randomize:\n"
                                 "      - color: {of: [pot], min_rgb: [0, 0.2, 0], max_rgb: [0, 1, 0]}\n");
  Process process;
  process.PublishModel(info);
  std::vector<std::vector<uint8_t>> drawn;
  for (const int64_t seed : {1, 2, 1}) {
    const int episode = static_cast<int>(drawn.size());
    process.PublishBegin(episode, 0, seed);
    process.PublishState(0, episode);
    const std::vector<image_t> images = process.RequestImages(0, {views_[0]}, episode);
    ASSERT_EQ(images.size(), 1u);
    drawn.push_back(images[0].data);
  }
  EXPECT_FALSE(drawn[0] == drawn[1]);
  EXPECT_TRUE(drawn[0] == drawn[2]);
}

TEST_F(CameraComponentTest, WhatCannotBeDrawnIsOneClearLine) {
  const auto complaint = [this](const std::vector<view_t>& views) -> std::string {
    Process process;
    Begin(&process);
    process.PublishState(0);
    try {
      process.RequestImages(0, views);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(complaint({views_[0], View("nowhere", 64, 64)}),
            "REQUEST_IMAGE of tick 0: no camera 'nowhere'; this scene has head, roboeval/external, front, "
            "overview, "
            "roboeval/head, roboeval/front, roboeval/left_wrist, left/hand/wrist, roboeval/right_wrist, "
            "right/hand/wrist");
  EXPECT_EQ(complaint({View("front", 0, 64)}),
            "REQUEST_IMAGE of tick 0: an image of 0x64: expected 1 to 2048 pixels per side");
  EXPECT_EQ(complaint({View("front", 64, 2049)}),
            "REQUEST_IMAGE of tick 0: an image of 64x2049: expected 1 to 2048 pixels per side");
  EXPECT_EQ(complaint({View("front", 64, 64, "jpeg")}),
            "REQUEST_IMAGE of tick 0: encoding 'jpeg': expected rgb8 or depth32");
  view_t wide = views_[0];
  for (const double fovy : {-1.0, 0.5, 180.0, std::nan("")}) {
    wide.fovy_deg = fovy;
    EXPECT_NE(complaint({wide}).find("expected 1 to 170 degrees, or 0 for the camera's own"),
              std::string::npos);
  }
  EXPECT_EQ(complaint(std::vector<view_t>(33, views_[0])),
            "REQUEST_IMAGE of tick 0: 33 views: expected at most 32");
  EXPECT_EQ(complaint(std::vector<view_t>(32, views_[0])), "");
}

}  // namespace evalbus::viz::camera_component_test
