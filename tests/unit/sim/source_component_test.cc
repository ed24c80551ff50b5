#include "sim/source_component.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <turbojpeg.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <memory>
#include <optional>

#include "base/errors.h"
#include "bus/channels.h"
#include "lcmtypes/clock.h"
#include "lcmtypes/end_reason.h"
#include "sim/world.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::sim::source_component_test {

using testing::HasSubstr;

// Acts as the source, the launcher and metrics on an in-process bus. Control ticks and samples are 20 ms
// apart.
class SourceComponentTest : public testing::Test {
 protected:
  SourceComponentTest() {
    Log::SetFiles([this](const std::string& name) { return folder_.path() / (name + ".log"); });
    options_.task = "lift_pot";
    options_.out = folder_.path();
    announcement_.source = "two Frankas";
    announcement_.period_us = 20'000;
    for (const std::string arm : {"left", "right"}) {
      for (int j = 1; j <= 7; ++j) announcement_.joint_name.push_back(arm + "/joint" + std::to_string(j));
    }
    home_ = {0, 0, 0, -1.5, 0, 1.5, 0, 0, 0, 0, -1.5, 0, 1.5, 0};
    for (const std::string arm : {"left", "right"}) {
      announcement_.joint_name.push_back(arm + "/hand/finger_joint1");
      home_.push_back(0.02);
    }
    announcement_.object_name = {"pot"};
  }
  ~SourceComponentTest() override { Log::SetFiles({}); }

  void MakeSource() {
    component_.reset();
    bus_.emplace("memq://");
    component_ = std::make_unique<SourceComponent>(&*bus_, options_);
    bus_->Subscribe(channels::kModel, [this](const model_info_t& m) {
      model_ = m;
      ++num_models_;
    });
    bus_->Subscribe(channels::kState, [this](const state_t& m) { states_.push_back(m); });
    bus_->Subscribe(channels::kEpisodeEnd, [this](const episode_end_t& m) { ends_.push_back(m); });
  }
  void HandleAll() {
    while (bus_->Handle()) {
    }
  }
  void Announce() {
    announcement_.num_joints = static_cast<int32_t>(announcement_.joint_name.size());
    announcement_.num_objects = static_cast<int32_t>(announcement_.object_name.size());
    bus_->Publish(channels::kSourceAnnouncement, announcement_);
    HandleAll();
  }
  void Command(int32_t episode) {
    command_t command{};
    command.kind = command_t::START_EPISODE;
    command.episode = episode;
    command.required_component = {"metrics"};
    command.num_required = 1;
    command.required_instance.assign(command.required_component.size(), 0);
    bus_->Publish(channels::kCommand, command);
    HandleAll();
    component_status_t status{};
    status.component = "metrics";
    status.state = component_status_t::READY;
    status.episode = episode;
    bus_->Publish(channels::kStatus, status);
    HandleAll();
  }
  void Start() {
    MakeSource();
    Announce();
    Command(0);
  }
  source_state_t Sample(int64_t sample, int32_t episode = 0) const {
    source_state_t message{};
    message.episode = episode;
    message.sample = sample;
    message.stamp_us = 1'000'000'000 + sample * 20'000;
    message.joint_position_mixed = home_;
    message.num_joints = static_cast<int32_t>(home_.size());
    for (size_t k = 0; k < announcement_.object_name.size(); ++k) {
      message.object.push_back({{0.5, 0, 1}, {1, 0, 0, 0}});
    }
    message.num_objects = static_cast<int32_t>(message.object.size());
    return message;
  }
  // Like Sample(), but from a source that sends its stamps in ms by mistake.
  source_state_t InMilliseconds(int64_t sample) const {
    source_state_t message = Sample(sample);
    message.stamp_us /= 1000;
    return message;
  }
  void Send(const source_state_t& message) {
    bus_->Publish(channels::kSourceState, message);
    HandleAll();
  }
  void Score(int64_t tick, int8_t verdict = partial_metrics_t::UNDECIDED) {
    partial_metrics_t partial{};
    partial.header = states_.back().header;
    partial.header.tick = tick;
    partial.header.sim_time_us = tick * 20'000;
    partial.verdict = verdict;
    bus_->Publish(channels::kPartial, partial);
    HandleAll();
  }
  // Publishes the scores of all STATEs until no more arrive.
  void ScoreAll() {
    for (size_t k = scored_; k < states_.size(); k = ++scored_) Score(states_[k].header.tick);
  }
  // Returns the error that the handler of this message throws.
  template <class Function>
  std::string Error(const Function& function) {
    try {
      function();
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
  std::vector<int64_t> Ticks() const {
    std::vector<int64_t> ticks;
    for (const state_t& state : states_) ticks.push_back(state.header.tick);
    return ticks;
  }

  TemporaryFolder folder_;
  std::optional<Bus> bus_;
  SimOptions options_;
  source_announcement_t announcement_{};
  std::vector<double> home_;
  std::unique_ptr<SourceComponent> component_;
  model_info_t model_{};
  int num_models_ = 0;
  size_t scored_ = 0;
  std::vector<state_t> states_;
  std::vector<episode_end_t> ends_;
};

TEST_F(SourceComponentTest, AnswersAnAnnouncementWithAModelOfTheKnownQuantities) {
  MakeSource();
  Command(0);
  EXPECT_EQ(num_models_, 0);  // there is nothing to report yet
  Announce();
  ASSERT_GT(num_models_, 0);
  EXPECT_EQ(model_.source, "two Frankas");
  EXPECT_EQ(model_.has_physics, 0);
  EXPECT_EQ(model_.has_velocity, 0);
  EXPECT_EQ(model_.object_is_tracked[0], 1);
  const int before = num_models_;
  Announce();  // the source has not received MODEL
  EXPECT_EQ(num_models_, before + 1);
}

// 30 Hz is exact, although it is not a multiple of the physics step of 2 ms.
TEST_F(SourceComponentTest, TicksAreExactAtAnyRate) {
  options_.control_hz = 30;
  options_.after_success_s = 0.1;
  announcement_.period_us = 33'333;
  Start();
  EXPECT_EQ(model_.clock, "source");
  EXPECT_EQ(ControlPeriod(model_), 1.0 / 30);
  EXPECT_EQ(model_.after_success_us, 100'000);
  for (int64_t k = 0; k < 8; ++k) {
    source_state_t sample = Sample(k);
    sample.stamp_us = 1'000'000'000 + std::llround(static_cast<double>(k) * 1e6 / 30);
    sample.joint_position_mixed[0] = 0.01 * static_cast<double>(k);
    Send(sample);
    ASSERT_EQ(states_.size(), static_cast<size_t>(k) + 1) << "the sample is the tick";
    const state_t& state = states_.back();
    EXPECT_EQ(state.header.sim_time_us, std::llround(static_cast<double>(k) * 1e6 / 30));
    if (k > 0) {
      EXPECT_NEAR(state.qvel_mixed[0], 0.3, 1e-12) << "0.01 rad in 1/30 s";
    }
    // The success at tick 2, at 66667 us, lasts for three ticks.
    partial_metrics_t partial{};
    partial.header = state.header;
    partial.verdict = k < 2 ? partial_metrics_t::UNDECIDED : partial_metrics_t::SUCCESS;
    bus_->Publish(channels::kPartial, partial);
    HandleAll();
    if (!ends_.empty()) break;
  }
  ASSERT_EQ(ends_.size(), 1u);
  EXPECT_EQ(ends_[0].end_reason, "success");
  EXPECT_EQ(ends_[0].header.tick, 5);
}

// Returns a gray image, encoded by libjpeg-turbo.
std::vector<uint8_t> Jpeg(int width, int height) {
  const std::unique_ptr<void, int (*)(void*)> encoder(tjInitCompress(), tjDestroy);
  const std::vector<uint8_t> gray(static_cast<size_t>(width * height), 128);
  std::vector<uint8_t> jpeg(tjBufSize(width, height, TJSAMP_GRAY));
  uint8_t* begin = jpeg.data();
  unsigned long size = jpeg.size();
  EXPECT_EQ(tjCompress2(encoder.get(), gray.data(), width, 0, height, TJPF_GRAY, &begin, &size, TJSAMP_GRAY,
                        80, TJFLAG_NOREALLOC),
            0);
  jpeg.resize(size);
  return jpeg;
}

class CameraImages : public SourceComponentTest {
 protected:
  void Begin() {
    Start();
    for (const char* camera : {"EVALBUS_CAMERA_front", "EVALBUS_CAMERA_left_wrist"})
      bus_->Subscribe(Channel<image_t>{camera, "sim"}, [this](const image_t& m) { passed_on_.push_back(m); });
    Send(Sample(0));
    ScoreAll();
  }
  // Returns an image of the second episode. Times are on the source's clock, in ms after the episode's first
  // sample.
  image_t Image(int64_t time_ms, const std::string& camera = "front") const {
    image_t image{};
    image.header.sim_time_us = 1'000'000'000 + time_ms * 1000;
    image.view.camera = camera;
    image.view.width_px = 64;
    image.view.height_px = 48;
    image.view.encoding = "jpeg";
    image.data = jpeg_;
    image.num_bytes = static_cast<int32_t>(jpeg_.size());
    return image;
  }
  void Publish(image_t image) {
    image.num_bytes = static_cast<int32_t>(image.data.size());
    const std::string channel = channels::ImageChannel(image.view.camera, channels::kSourceImage);
    bus_->PublishRaw(channel.c_str(), Encode(image));
    HandleAll();
  }
  // Returns what EPISODE_END reports about the images.
  std::string EndDetail() {
    source_state_t last = Sample(100);
    last.sample = 1;
    last.is_last = true;
    last.stamp_us = 1'000'000'000 + 20'000;
    Send(last);
    ScoreAll();
    return ends_.empty() ? "no end" : ends_.back().detail;
  }

  const std::vector<uint8_t> jpeg_ = Jpeg(64, 48);
  std::vector<image_t> passed_on_;
};

TEST_F(CameraImages, ArePassedOnWithTheEpisodesHeader) {
  Begin();
  Publish(Image(45));
  Publish(Image(50, "left/wrist"));
  ASSERT_EQ(passed_on_.size(), 2u);
  EXPECT_EQ(passed_on_[0].header.episode, 0);
  EXPECT_EQ(passed_on_[0].header.tick, 2) << "the last tick before 45 ms";
  EXPECT_EQ(passed_on_[0].header.sim_time_us, 45'000);
  EXPECT_EQ(passed_on_[0].data, jpeg_);
  EXPECT_EQ(passed_on_[1].view.camera, "left/wrist");
  EXPECT_EQ(EndDetail(), "");
}

TEST_F(CameraImages, AreAtMostTenASecondOfEachCamera) {
  Begin();
  // Every third image is published, at 0, 99, ..., 990 ms.
  for (int64_t ms = 0; ms < 1000; ms += 33) Publish(Image(ms));
  EXPECT_EQ(passed_on_.size(), 11u);
  EXPECT_EQ(EndDetail(), "") << "further images are ignored, which is not a fault";
}

TEST_F(CameraImages, ThatAreWrongAreRefusedCountedAndCostNoSample) {
  Begin();
  image_t image = Image(0);
  image.data.resize(image.data.size() / 2);
  Publish(image);
  image = Image(0);
  image.data = {'n', 'o'};
  Publish(image);
  image = Image(0);
  image.view.width_px = 65;
  Publish(image);
  image = Image(0);
  image.view.encoding = "rgb8";
  Publish(image);
  image = Image(0);
  image.data.resize((512 << 10) + 1);
  Publish(image);
  image = Image(0);
  image.view.camera = "front.jpg";
  Publish(image);
  image = Image(0);
  image.header.sim_time_us = std::numeric_limits<int64_t>::max();
  Publish(image);
  Publish(Image(0));
  EXPECT_EQ(passed_on_.size(), 1u);
  Publish(Image(0));  // its time does not increase
  EXPECT_EQ(passed_on_.size(), 1u);
  const std::string detail = EndDetail();
  EXPECT_THAT(detail, testing::StartsWith("8 images refused, the first: not a valid JPEG: "));
  EXPECT_EQ(ends_.back().end_reason, "end_of_data");
  EXPECT_EQ(ends_.back().header.tick, 1) << "no tick is missing";
}

TEST_F(CameraImages, OfAnotherEpisodeAndBytesOfNoImageAreCounted) {
  Begin();
  image_t image = Image(0);
  image.header.episode = 7;
  const int64_t before = component_->status().foreign_messages;
  Publish(image);
  EXPECT_EQ(component_->status().foreign_messages, before + 1);
  bus_->PublishRaw("EVALBUS_SOURCE_IMAGE_front", Encode(header_t{}));
  HandleAll();
  EXPECT_EQ(bus_->decode_errors(), 1);
  EXPECT_TRUE(passed_on_.empty());
  EXPECT_EQ(EndDetail(), "");
}

TEST_F(CameraImages, OfMoreThanEightCamerasAreRefused) {
  Begin();
  for (int k = 0; k < 9; ++k) Publish(Image(0, "camera" + std::to_string(k)));
  EXPECT_EQ(EndDetail(), "1 image refused, the first: camera 'camera8': the maximum of 8 cameras is reached");
}

TEST_F(SourceComponentTest, AnUntrackedObjectIsReportedAsUntracked) {
  announcement_.object_name.clear();
  Start();
  EXPECT_EQ(model_.object_is_tracked[0], 0);
}

TEST_F(SourceComponentTest, MakesOneStateAtATimeAndVelocitiesOfDifferences) {
  Start();
  Send(Sample(0));
  source_state_t next = Sample(1);
  next.joint_position_mixed[1] += 0.01;
  next.object[0].position_m[0] = 0.6;
  Send(next);
  EXPECT_EQ(Ticks(), std::vector<int64_t>{0});  // the first tick has no score yet
  Score(0);
  ASSERT_EQ(states_.size(), 2u);
  EXPECT_EQ(states_[1].header.sim_time_us, 20'000);
  EXPECT_NEAR(states_[1].arm[0].joint_velocity_radps[1], 0.01 / 0.02, 1e-9);
  EXPECT_EQ(states_[0].arm[0].joint_velocity_radps[1], 0);
  EXPECT_EQ(states_[1].gripper[0].opening, 0.5);  // 20 of 40 mm
  const auto pot = std::ranges::find(model_.body_name, "pot") - model_.body_name.begin();
  EXPECT_EQ(states_[1].body[static_cast<size_t>(pot)].position_m[0], 0.6);
}

TEST_F(SourceComponentTest, LinksAndWristsAreWhereOurOwnSimHasThem) {
  Start();
  Send(Sample(0));
  const PreparedScene prepared = ComposeScene(options_);
  const ModelPtr model(mj_copyModel(nullptr, prepared.scene.physics.get()));
  const DataPtr data(mj_makeData(model.get()));
  for (size_t k = 0; k < home_.size(); ++k) {
    data->qpos[model
                   ->jnt_qposadr[mj_name2id(model.get(), mjOBJ_JOINT, announcement_.joint_name[k].c_str())]] =
        home_[k];
  }
  mj_forward(model.get(), data.get());
  for (const std::string& body : model_.body_name) {
    if (!body.starts_with("left/link") && !body.starts_with("right/link")) continue;
    const int id = mj_name2id(model.get(), mjOBJ_BODY, body.c_str());
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(states_[0].body[static_cast<size_t>(id)].position_m[i], data->xpos[3 * id + i], 1e-12)
          << body;
    }
  }
  for (const arm_info_t& arm : model_.arm) {
    const int site = mj_name2id(model.get(), mjOBJ_SITE, arm.wrist_site.c_str());
    const auto index = static_cast<size_t>(&arm - model_.arm.data());
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(states_[0].arm[index].wrist_position_m[i], data->site_xpos[3 * site + i], 1e-12);
    }
  }
}

TEST_F(SourceComponentTest, MeasuredVelocitiesAreTakenAsTheyAre) {
  announcement_.has_velocity = 1;
  Start();
  EXPECT_EQ(model_.has_velocity, 1);
  source_state_t sample = Sample(0);
  sample.joint_velocity_mixed.assign(home_.size(), 0.25);
  sample.num_velocities = sample.num_joints;
  Send(sample);
  EXPECT_EQ(states_.at(0).arm[1].joint_velocity_radps[6], 0.25);
}

TEST_F(SourceComponentTest, AnEpisodeEndsAtTheSourcesLastSampleOrWhenTheNextBegins) {
  Start();
  Send(Sample(0));
  source_state_t last = Sample(1);
  last.is_last = 1;
  Send(last);
  ScoreAll();
  ASSERT_EQ(ends_.size(), 1u);
  EXPECT_EQ(ends_[0].end_reason, end_reason::kEndOfData);
  EXPECT_EQ(ends_[0].header.tick, 1);
  EXPECT_EQ(ends_[0].detail, "");
  // These samples arrive before the launcher commands the episode. They are scored after its COMMAND.
  Send(Sample(0, 1));
  Send(Sample(1, 1));
  EXPECT_EQ(states_.size(), 2u);
  Command(1);
  ScoreAll();
  EXPECT_EQ(states_.size(), 4u);
  Send(Sample(0, 2));
  ASSERT_EQ(ends_.size(), 2u);
  EXPECT_EQ(ends_[1].header.episode, 1);
  EXPECT_EQ(ends_[1].header.tick, 1);
}

TEST_F(SourceComponentTest, WhatComesAfterTheVerdictDoesNotMatter) {
  Start();
  Send(Sample(0));
  Send(Sample(1));
  Score(0, partial_metrics_t::SUCCESS);
  ASSERT_EQ(ends_.size(), 1u);
  EXPECT_EQ(ends_[0].end_reason, end_reason::kSuccess);
  EXPECT_EQ(ends_[0].header.tick, 0);
  Command(1);
  Send(Sample(2));
  EXPECT_EQ(states_.size(), 1u);
  Send(Sample(0, 7));
  EXPECT_EQ(states_.size(), 2u);
}

TEST_F(SourceComponentTest, ARefusedSampleMakesTheEpisodeIncomplete) {
  for (const auto& [spoil, said] :
       {std::pair<void (*)(source_state_t*), std::string>{
            [](source_state_t* s) { s->joint_position_mixed[3] = std::nan(""); },
            "left/joint4 is nan, expected a finite number"},
        {[](source_state_t* s) { s->joint_position_mixed[3] = 4; },
         "4 rad is beyond the range of left/joint4"},
        {[](source_state_t* s) { s->stamp_us -= 20'000; }, "the time changes from"},
        {[](source_state_t* s) { s->object[0].quat_wxyz[0] = 2; }, "has norm 2, expected 1"},
        {[](source_state_t* s) { s->object[0].position_m[2] = std::numeric_limits<double>::infinity(); },
         "the position of pot is"},
        {[](source_state_t* s) { s->sample = std::numeric_limits<int64_t>::max(); },
         "expected a sample number of at most 1099511627776, got 9223372036854775807"},
        {[](source_state_t* s) { s->object[0].position_m[0] = 1e300; },
         "the position of pot is 1e+300, 0, 1 m, expected at most 1000 m from the origin"},
        {[](source_state_t* s) { s->object[0].position_m[1] = -1001; },
         "the position of pot is 0.5, -1001, 1 m, expected at most 1000 m from the origin"}}) {
    states_.clear();
    ends_.clear();
    scored_ = 0;
    Start();
    for (int64_t k = 0; k < 5; ++k) {
      source_state_t sample = Sample(k);
      if (k == 2) spoil(&sample);
      if (k == 4) sample.is_last = 1;
      Send(sample);
      ScoreAll();
    }
    // Tick 2 is missing and is not interpolated.
    EXPECT_EQ(Ticks(), (std::vector<int64_t>{0, 1, 3, 4})) << said;
    ASSERT_EQ(ends_.size(), 1u);
    EXPECT_THAT(ends_[0].detail, HasSubstr("1 sample refused, the first: sample "));
    EXPECT_THAT(ends_[0].detail, HasSubstr(said));
  }
}

TEST_F(SourceComponentTest, ARefusedLastSampleDoesToo) {
  Start();
  Send(Sample(0));
  source_state_t last = Sample(1);
  last.joint_position_mixed[0] = std::nan("");
  last.is_last = 1;
  Send(last);
  ScoreAll();
  ASSERT_EQ(ends_.size(), 1u);
  EXPECT_EQ(ends_[0].header.tick, 1);  // which was never published
  EXPECT_EQ(Ticks(), std::vector<int64_t>{0});
}

TEST_F(SourceComponentTest, ARefusedLastSampleAfterTheSuccessDoesToo) {
  options_.after_success_s = 1;
  Start();
  Send(Sample(0));
  Send(Sample(1));
  Score(0);
  Score(1, partial_metrics_t::SUCCESS);
  ASSERT_TRUE(ends_.empty());
  source_state_t last = Sample(2);
  last.joint_position_mixed[0] = std::nan("");
  last.is_last = 1;
  Send(last);
  ASSERT_EQ(ends_.size(), 1u);
  EXPECT_EQ(ends_[0].end_reason, end_reason::kSuccess);
  EXPECT_EQ(ends_[0].header.tick, 2);  // which was never published
  EXPECT_EQ(Ticks(), (std::vector<int64_t>{0, 1}));
}

// A source sends each sample twice. All ticks after the first are missing, including those at the end.
TEST_F(SourceComponentTest, TicksThatAreMissingAtTheEndCount) {
  Start();
  for (int64_t k = 0; k < 10; ++k) {
    source_state_t sample = Sample(k);
    sample.stamp_us = Sample(k / 2).stamp_us;
    sample.is_last = k == 9;
    Send(sample);
    ScoreAll();
  }
  EXPECT_EQ(Ticks(), std::vector<int64_t>{0});
  ASSERT_EQ(ends_.size(), 1u);
  // Ticks 1 to 4, and one for the last sample, which was refused.
  EXPECT_EQ(ends_[0].header.tick, 5);
  EXPECT_THAT(ends_[0].detail, HasSubstr("5 samples refused, the first: sample 1: the time changes from"));
}

TEST_F(SourceComponentTest, ObjectsOfTheFirstSampleAreNearTheOrigin) {
  Start();
  source_state_t sample = Sample(0);
  sample.object[0].position_m[0] = 716;
  try {
    Send(sample);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("the position of pot is 716, 0, 1 m, expected at most 10 m from"));
  }
}

TEST_F(SourceComponentTest, LostSamplesAreCountedAndAGapIsMissing) {
  Start();
  for (const int64_t k : {0, 1, 2, 12, 13}) {
    source_state_t sample = Sample(k);
    sample.is_last = k == 13;
    Send(sample);
    ScoreAll();
  }
  EXPECT_EQ(Ticks(), (std::vector<int64_t>{0, 1, 2, 12, 13}));
  ASSERT_EQ(ends_.size(), 1u);
  EXPECT_EQ(ends_[0].detail, "samples are missing in 1 place; 9 samples never came");
}

TEST_F(SourceComponentTest, AnotherPeriodThanTheAnnouncedOneIsStated) {
  std::vector<std::string> warnings;
  MakeSource();
  bus_->Subscribe(channels::kLog, [&](const log_t& line) {
    if (line.level >= log_t::WARN_LEVEL) warnings.push_back(line.text);
  });
  Announce();
  Command(0);
  for (int64_t k = 0; k < 4; ++k) {
    source_state_t sample = Sample(k);
    sample.stamp_us = 1'000'000'000 + k * 200'000;
    sample.is_last = k == 3;
    Send(sample);
    ScoreAll();
  }
  ASSERT_EQ(ends_.size(), 1u);
  EXPECT_EQ(ends_[0].detail,
            "samples are 200 ms apart in 3 places, but SOURCE_ANNOUNCEMENT states a period of 20 ms");
  EXPECT_THAT(warnings, testing::Contains("samples are 200 ms apart in 1 place, but SOURCE_ANNOUNCEMENT "
                                          "states a period of 20 ms; ticks between them are missing"));
}

TEST_F(SourceComponentTest, MetricsMayWaitForAGapWhileLaterTicksCome) {
  Start();
  Send(Sample(0));
  Score(0);
  for (int64_t k = 10; k < 400; ++k) Send(Sample(k));
  // After a hundred complete ticks, metrics stops waiting for the missing one.
  EXPECT_GT(states_.size(), 101u);
  EXPECT_LT(states_.size(), 130u);
}

TEST_F(SourceComponentTest, ASilentSourceHasBrokenItsEpisodeOff) {
  Start();
  Send(Sample(0));
  Score(0);
  auto now = std::chrono::steady_clock::now();
  for (int k = 0; k < 10; ++k) component_->Poll(now += std::chrono::milliseconds(200));
  HandleAll();
  EXPECT_TRUE(ends_.empty());  // two of the five seconds have passed
  for (int k = 0; k < 20; ++k) component_->Poll(now += std::chrono::milliseconds(200));
  HandleAll();
  ASSERT_GE(ends_.size(), 1u);
  EXPECT_EQ(ends_[0].end_reason, end_reason::kEndOfData);
  EXPECT_EQ(ends_[0].header.tick, 1);  // the source never announced the end, so the episode is incomplete
  EXPECT_EQ(ends_[0].detail, "no message from the source for 5 s");
}

TEST_F(SourceComponentTest, AClockThatLeapsBreaksTheEpisodeOff) {
  Start();
  Send(Sample(0));
  Score(0);
  source_state_t sample = Sample(1);
  sample.stamp_us += 3600'000'000;
  Send(sample);
  ASSERT_EQ(ends_.size(), 1u);
  EXPECT_EQ(ends_[0].header.tick, 1);
  EXPECT_THAT(ends_[0].detail, HasSubstr("the source's clock jumps by 3.6e+03 s"));
}

TEST_F(SourceComponentTest, StampsInMillisecondsGetAHint) {
  Start();
  Send(Sample(0));
  Score(0);
  source_state_t sample = Sample(1);
  sample.stamp_us = Sample(0).stamp_us + 20'000'000;
  Send(sample);
  ASSERT_EQ(ends_.size(), 1u);
  EXPECT_THAT(ends_[0].detail,
              HasSubstr("the source's clock jumps by 20 s; is the unit milliseconds instead"));
}

// Differences between these timestamps exceed 64 bits.
TEST_F(SourceComponentTest, AClockThatLeapsThroughAllItsRangeIsNoExceptionToThat) {
  Start();
  source_state_t sample = Sample(0);
  sample.stamp_us = std::numeric_limits<int64_t>::min();
  Send(sample);
  Score(0);
  sample = Sample(1);
  sample.stamp_us = std::numeric_limits<int64_t>::max() - 59;
  Send(sample);
  ASSERT_EQ(ends_.size(), 1u);
  EXPECT_EQ(ends_[0].header.tick, 1) << "which was never published: the episode is incomplete";
  EXPECT_THAT(ends_[0].detail, HasSubstr("the source's clock jumps by 9.22e+12 s"));
}

TEST_F(SourceComponentTest, ASourceThatStartsAgainBeginsANewEpisode) {
  Start();
  Send(Sample(0));
  Send(Sample(1));
  ScoreAll();
  Send(Sample(0));
  ASSERT_EQ(ends_.size(), 1u);
  EXPECT_EQ(ends_[0].header.tick, 2);
  EXPECT_THAT(ends_[0].detail, HasSubstr("the source restarted the episode"));
  Command(1);
  EXPECT_EQ(states_.size(), 3u);
}

TEST_F(SourceComponentTest, WhatIsWrongFromTheBeginningIsOneLine) {
  const auto with = [&](const std::function<void()>& change) {
    const source_announcement_t announcement = announcement_;
    MakeSource();
    change();
    const std::string error = Error([&] { Announce(); });
    announcement_ = announcement;
    return error;
  };
  EXPECT_EQ(
      with([&] { announcement_.joint_name[0] = "left/joint_1"; }),
      "SOURCE_ANNOUNCEMENT of 'two Frankas': there is no joint 'left/joint_1'; did you mean 'left/joint1'?");
  EXPECT_EQ(with([&] { announcement_.joint_name.erase(announcement_.joint_name.begin()); }),
            "SOURCE_ANNOUNCEMENT of 'two Frankas': joint 'left/joint1' is missing; all joints of the arms "
            "are required");
  EXPECT_THAT(with([&] { announcement_.joint_name[1] = announcement_.joint_name[0]; }),
              HasSubstr("is given twice"));
  EXPECT_THAT(with([&] { announcement_.object_name = {"kettle"}; }),
              HasSubstr("there is no object 'kettle'"));
  EXPECT_EQ(with([&] { announcement_.joint_name.pop_back(); }),
            "SOURCE_ANNOUNCEMENT of 'two Frankas': no finger joint of gripper 'right' is measured; state its "
            "constant position with "
            "--gripper right=open or right=closed");
  EXPECT_THAT(with([&] { announcement_.period_us = 0; }), HasSubstr("period_us is 0, expected 1 to 1000000"));
  EXPECT_THAT(with([&] { announcement_.source = "sim"; }), HasSubstr("evalbus itself uses"));
}

TEST_F(SourceComponentTest, TheFirstSampleMustBeRight) {
  Start();
  source_state_t sample = Sample(0);
  sample.joint_position_mixed[3] = -90;  // degrees
  EXPECT_EQ(Error([&] { Send(sample); }),
            "source 'two Frankas', sample 0: -90 rad is beyond the range of left/joint4, -3.072 to -0.070; "
            "are these "
            "degrees?");
  Start();
  EXPECT_EQ(Error([&] { Send(Sample(-1)); }),
            "source 'two Frankas', sample -1: expected a sample number of at least 0, got -1");
}

TEST_F(SourceComponentTest, StampsAreMicroseconds) {
  Start();
  for (int64_t i = 0; i < 20; ++i) Send(InMilliseconds(i));
  EXPECT_EQ(Error([&] { Send(InMilliseconds(20)); }),
            "source 'two Frankas': 20 samples took 0.0004 s by their stamp_us, expected about 0.4 s with the "
            "stated "
            "period_us of 20000; are these microseconds?");
}

TEST_F(SourceComponentTest, StampsAreMicrosecondsAlsoIfASampleIsLost) {
  Start();
  for (int64_t i = 0; i < 20; ++i) Send(InMilliseconds(i));
  EXPECT_THAT(Error([&] { Send(InMilliseconds(21)); }), testing::HasSubstr("are these microseconds?"));
}

TEST_F(SourceComponentTest, CountsMustBeThoseOfTheAnnouncement) {
  Start();
  source_state_t sample = Sample(0);
  sample.joint_position_mixed.pop_back();
  --sample.num_joints;
  EXPECT_EQ(Error([&] { Send(sample); }),
            "source 'two Frankas', sample 0: 15 joint positions, SOURCE_ANNOUNCEMENT states 16");
}

TEST_F(SourceComponentTest, ASecondSourceIsNoticed) {
  Start();
  announcement_.source = "three Frankas";
  EXPECT_THAT(Error([&] { Announce(); }), HasSubstr("is a second source on this bus?"));
}

TEST_F(SourceComponentTest, AnUnmeasuredGripperHasTheGivenState) {
  options_.gripper = {"right=closed"};
  announcement_.joint_name.pop_back();
  home_.pop_back();
  Start();
  Send(Sample(0));
  EXPECT_EQ(states_.at(0).gripper[1].opening, 0);
}

TEST_F(SourceComponentTest, AMeasuredGripperHasNoGivenState) {
  options_.gripper = {"right=closed"};
  EXPECT_EQ(Error([&] { Start(); }),
            "--gripper: the source 'two Frankas' measures finger joints of gripper 'right'; omit this option "
            "for it");
}

TEST_F(SourceComponentTest, AGripperHasOneState) {
  options_.gripper = {"left=open", "left=closed"};
  EXPECT_EQ(Error([&] { MakeSource(); }), "--gripper left=closed: 'left' is given twice");
}

// The wheels have a range of 0 to 4.71 rad, of which 5 % are 0.2355 rad.
class JointsOfObjects : public SourceComponentTest {
 protected:
  void SetUp() override {
    options_.task = "rotate_valve";
    announcement_.object_name = {"first_valve", "second_valve"};
    for (const char* wheel : {"first_valve/wheel", "second_valve/wheel"}) {
      announcement_.joint_name.emplace_back(wheel);
      home_.push_back(0);
    }
  }
  source_state_t WithWheel(int64_t sample, double position) const {
    source_state_t message = Sample(sample);
    message.joint_position_mixed[16] = position;
    return message;
  }
  double Wheel(size_t state) const {
    const auto joint = std::ranges::find(model_.joint_name, "first_valve/wheel") - model_.joint_name.begin();
    return states_.at(state)
        .qpos_mixed[static_cast<size_t>(model_.joint_qpos_index[static_cast<size_t>(joint)])];
  }
};

TEST_F(JointsOfObjects, AreAcceptedJustBeyondTheirSoftLimitsAndCounted) {
  Start();
  Send(WithWheel(0, -0.001));  // too little to be counted
  ScoreAll();
  Send(WithWheel(1, -0.0511));
  ScoreAll();
  Send(WithWheel(2, -0.2354));
  ScoreAll();
  Send(WithWheel(3, 4.9454));
  ScoreAll();
  source_state_t last = Sample(4);
  last.is_last = 1;
  Send(last);
  ScoreAll();
  ASSERT_EQ(Ticks(), (std::vector<int64_t>{0, 1, 2, 3, 4}));
  EXPECT_EQ(Wheel(1), -0.0511) << "used unchanged";
  EXPECT_EQ(Wheel(2), -0.2354);
  ASSERT_EQ(ends_.size(), 1u);
  EXPECT_EQ(ends_[0].header.tick, 4) << "complete";
  EXPECT_EQ(ends_[0].detail,
            "3 samples with a joint of an object beyond its soft limits, the first: sample 1: "
            "first_valve/wheel is beyond its range by 0.0511 rad");
}

TEST_F(JointsOfObjects, AreRefusedFurtherBeyond) {
  for (const double position : {-0.2357, 4.9481}) {
    states_.clear();
    ends_.clear();
    scored_ = 0;
    Start();
    Send(Sample(0));
    ScoreAll();
    Send(WithWheel(1, position));
    source_state_t last = Sample(2);
    last.is_last = 1;
    Send(last);
    ScoreAll();
    EXPECT_EQ(Ticks(), (std::vector<int64_t>{0, 2})) << position;
    ASSERT_EQ(ends_.size(), 1u);
    EXPECT_THAT(ends_[0].detail, HasSubstr("1 sample refused, the first: sample 1: "));
    EXPECT_THAT(ends_[0].detail, HasSubstr("is beyond the range of first_valve/wheel, 0.000 to 4.712"));
  }
}

// The limits of an arm's joints are the limits of its controller.
TEST_F(JointsOfObjects, JointsOfArmsKeepTheirTolerance) {
  Start();
  Send(Sample(0));
  source_state_t sample = Sample(1);
  sample.joint_position_mixed[3] = -0.0698 + 0.049;
  sample.is_last = 1;
  Send(sample);
  ScoreAll();
  EXPECT_EQ(ends_.at(0).detail, "");
  Command(1);
  Send(Sample(0, 1));
  sample = Sample(1, 1);
  sample.joint_position_mixed[3] = -0.0698 + 0.06;
  sample.is_last = 1;
  Send(sample);
  ScoreAll();
  EXPECT_THAT(ends_.at(1).detail, HasSubstr("is beyond the range of left/joint4"));
}

class ContactsOfTheSource : public SourceComponentTest {
 public:
  ContactsOfTheSource() {
    options_.contacts = contacts_from::kSource;
    announcement_.has_contacts = 1;
  }
  void Begin() {
    Start();
    bus_->Subscribe(channels::kMeasuredContacts, [this](const contacts_t& m) {
      contacts_.push_back(m);
      states_before_.push_back(states_.size());
    });
  }
  static source_contact_t Contact(const std::string& a, const std::string& b) {
    return {a, b, 0.001, {0.5, 0, 1}, {0, 0, 1}};
  }
  void SendContacts(int64_t sample, const std::vector<source_contact_t>& contacts, int32_t episode = 0) {
    source_contacts_t message{};
    message.episode = episode;
    message.sample = sample;
    message.contact = contacts;
    message.num_contacts = static_cast<int32_t>(contacts.size());
    bus_->Publish(channels::kSourceContacts, message);
  }
  std::string Name(int geom) const { return model_.geom_name[static_cast<size_t>(geom)]; }

  std::vector<contacts_t> contacts_;
  // Number of STATEs received before each message in contacts_.
  std::vector<size_t> states_before_;
};

TEST_F(ContactsOfTheSource, ArePublishedBeforeTheStateOfTheirTick) {
  Begin();
  SendContacts(0, {});
  Send(Sample(0));
  ScoreAll();
  SendContacts(1, {Contact("left/hand/hand", "pot"), Contact("floor", "pot/wall")});
  source_state_t last = Sample(1);
  last.is_last = 1;
  Send(last);
  ScoreAll();
  ASSERT_EQ(contacts_.size(), 2u);
  EXPECT_EQ(states_before_, (std::vector<size_t>{0, 1}));
  EXPECT_EQ(contacts_[0].num_contacts, 0);
  EXPECT_EQ(contacts_[1].header.tick, 1);
  ASSERT_EQ(contacts_[1].num_contacts, 2);
  EXPECT_EQ(Name(contacts_[1].contact[0].geom_a), "floor");
  EXPECT_EQ(Name(contacts_[1].contact[0].geom_b), "pot/wall");
  EXPECT_EQ(Name(contacts_[1].contact[1].geom_a), "left/hand/hand");
  EXPECT_EQ(contacts_[1].contact[1].distance_m, -0.001);
  EXPECT_FALSE(contacts_[1].has_clearance);
  EXPECT_EQ(ends_.at(0).detail, "");
}

// Ticks are 20 ms apart and samples 25 ms, so tick 1 is between the samples at 0 and 25 ms.
TEST_F(ContactsOfTheSource, BetweenTwoSamplesAreThoseOfTheSampleBefore) {
  Begin();
  SendContacts(0, {Contact("floor", "pot")});
  Send(Sample(0));
  ScoreAll();
  SendContacts(1, {});
  source_state_t sample = Sample(1);
  sample.stamp_us += 5'000;
  Send(sample);
  ScoreAll();
  ASSERT_EQ(contacts_.size(), 2u);
  EXPECT_EQ(contacts_[1].header.tick, 1);
  EXPECT_EQ(contacts_[1].num_contacts, 1);
}

TEST_F(ContactsOfTheSource, ASampleWithoutThemIsRefusedAndCounted) {
  for (const auto& [spoil, said] :
       {std::pair<void (*)(ContactsOfTheSource*), std::string>{
            [](ContactsOfTheSource*) {}, "SOURCE_CONTACTS of this sample did not arrive"},
        {[](ContactsOfTheSource* test) { test->SendContacts(1, {}); },
         "SOURCE_CONTACTS of this sample did not arrive"},
        {[](ContactsOfTheSource* test) { test->SendContacts(2, {}, 7); },
         "SOURCE_CONTACTS of this sample did not arrive"},
        {[](ContactsOfTheSource* test) {
           source_contact_t contact = Contact("floor", "pot");
           contact.penetration_m = std::nan("");
           test->SendContacts(2, {contact});
         },
         "the contact of floor and pot has a penetration of nan m"}}) {
    states_.clear();
    contacts_.clear();
    ends_.clear();
    scored_ = 0;
    Begin();
    for (int64_t k = 0; k < 5; ++k) {
      if (k != 2) SendContacts(k, {});
      if (k == 2) spoil(this);
      source_state_t sample = Sample(k);
      if (k == 4) sample.is_last = 1;
      Send(sample);
      ScoreAll();
    }
    EXPECT_EQ(Ticks(), (std::vector<int64_t>{0, 1, 3, 4})) << said;
    EXPECT_EQ(contacts_.size(), 4u);
    ASSERT_EQ(ends_.size(), 1u);
    EXPECT_THAT(ends_[0].detail, HasSubstr("1 sample refused, the first: sample 2: "));
    EXPECT_THAT(ends_[0].detail, HasSubstr(said));
  }
}

TEST_F(ContactsOfTheSource, AnUnknownNameEndsTheWatch) {
  Begin();
  SendContacts(0, {});
  Send(Sample(0));
  SendContacts(1, {Contact("floor", "pott")});
  EXPECT_EQ(Error([&] { Send(Sample(1)); }),
            "source 'two Frankas', sample 1: contacts: there is no object, body or geom 'pott'; did you mean "
            "'pot'?");
}

TEST_F(ContactsOfTheSource, MustBeAnnouncedIffTheyAreAskedFor) {
  MakeSource();
  announcement_.has_contacts = 0;
  EXPECT_EQ(Error([&] { Announce(); }),
            "SOURCE_ANNOUNCEMENT of 'two Frankas': it publishes no contacts, but --contacts source requires "
            "them");
  options_.contacts = contacts_from::kShapes;
  MakeSource();
  announcement_.has_contacts = 1;
  EXPECT_EQ(Error([&] { Announce(); }),
            "SOURCE_ANNOUNCEMENT of 'two Frankas': it publishes contacts; score with them with --contacts "
            "source");
}

class MappedSource : public ContactsOfTheSource {
 protected:
  void Write(const std::string& text) {
    std::ofstream(folder_.path() / "map.yaml") << text;
    options_.map = folder_.path() / "map.yaml";
  }
  std::string File() const { return folder_.path() / "map.yaml"; }
};

TEST_F(MappedSource, NamesZerosAndFramesAreConverted) {
  Write(R"(joints:
  unit: deg
  columns: {left/joint1: {column: q0, sign: -1, zero: 10}}
objects:
  pot: {name: kettle, frame: {position_m: [0, 0, 0.1], quaternion_wxyz: [0, 1, 0, 0]}}
contacts:
  pot: [kettle, lid]
)");
  announcement_.joint_name[0] = "q0";
  announcement_.object_name = {"kettle"};
  for (size_t k = 0; k < 14; ++k) home_[k] *= 180 / 3.14159265358979;
  Begin();
  EXPECT_EQ(model_.object_is_tracked[0], 1);
  SendContacts(0, {Contact("lid", "floor")});
  source_state_t sample = Sample(0);
  sample.joint_position_mixed[0] = 40;
  sample.object[0] = {{0.5, 0, 1}, {0, 0, 0, 1}};
  Send(sample);
  ASSERT_EQ(states_.size(), 1u);
  EXPECT_NEAR(states_[0].arm[0].joint_position_rad[0], -30 * 3.14159265358979 / 180, 1e-12);
  EXPECT_NEAR(states_[0].arm[0].joint_position_rad[3], -1.5, 1e-12);
  EXPECT_EQ(states_[0].gripper[1].opening, 0.5) << "fingers slide: m, not deg";
  const auto pot = static_cast<size_t>(std::ranges::find(model_.body_name, "pot") - model_.body_name.begin());
  EXPECT_NEAR(states_[0].body[pot].position_m[2], 1.1, 1e-12);
  EXPECT_NEAR(std::abs(states_[0].body[pot].quat_wxyz[2]), 1, 1e-12) << "k times i is j";
  ASSERT_EQ(contacts_.at(0).num_contacts, 1);
  EXPECT_EQ(Name(contacts_[0].contact[0].geom_b), "pot/wall");
}

TEST_F(MappedSource, NamesThatDoNotExistAreOneLine) {
  const auto error = [&](const std::string& text) {
    Write(text);
    return Error([&] {
      MakeSource();
      Announce();
    });
  };
  EXPECT_EQ(error("objects:\n  pott: {name: kettle}\n"),
            File() + ":2: key 'pott': there is no object 'pott'; did you mean 'pot'?");
  EXPECT_EQ(error("joints:\n  unit: rad\n  columns: {left/joint_1: q0}\n"),
            File() + ":3: key 'left/joint_1': there is no joint 'left/joint_1'; did you mean 'left/joint1'?");
  EXPECT_EQ(error("contacts:\n  pott: kettle\n"),
            File() + ":2: key 'pott': there is no object, body or geom 'pott'; did you mean 'pot'?");
  EXPECT_EQ(error("objects:\n  pot: {name: pots}\n"),
            File() + ":2: key 'pot': source 'two Frankas' has no object 'pots'; did you mean 'pot'?");
  EXPECT_EQ(error("joints:\n  unit: rad\n  columns: {left/joint1: left/joint_1}\n"),
            File() +
                ":3: key 'left/joint1': source 'two Frankas' has no joint 'left/joint_1'; did you mean "
                "'left/joint1'?");
}

}  // namespace evalbus::sim::source_component_test
