#include "policy_bridge/policy_component.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <memory>
#include <stdexcept>
#include <type_traits>

#include "base/errors.h"
#include "base/sha256.h"
#include "bus/channels.h"
#include "bus/event_log.h"
#include "bus/message.h"
#include "policy_bridge/policies/replay_policy.h"
#include "tests/unit/policy_bridge/policy_scene.h"

namespace evalbus::policy::policy_component_test {

namespace fs = std::filesystem;

class PolicyComponentTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        fs::path(testing::TempDir()) /
        ("policy_component_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
    fs::create_directories(folder_);
    model_ = GetPolicyScene().info();
    model_.substeps = 10;
    fs::create_directories(folder_ / "model");
    model_.physics_file = folder_ / "model/physics.mjb";
    mj_saveModel(&GetPolicyScene().model(), model_.physics_file.c_str(), nullptr, 0);
    model_.physics_sha256 = Sha256File(model_.physics_file);
    bus_.Subscribe(channels::kAction, [this](const action_t& action) { actions_.push_back(action); });
    bus_.Subscribe(channels::kStatus, [this](const component_status_t& status) { status_ = status; });
  }
  void TearDown() override { fs::remove_all(folder_); }

  template <class Message>
  void Send(const Channel<Message>& channel, const Message& message) {
    bus_.Publish(channel, message);
    while (bus_.Handle()) {
    }
  }
  void Begin(int episode) {
    episode_begin_t begin{};
    begin.header.episode = episode;
    begin.seed = 1;
    Send(channels::kEpisodeBegin, begin);
  }
  static state_t State(int episode, int64_t tick) {
    state_t state{};
    state.header.episode = episode;
    state.header.tick = tick;
    state.header.sim_time_us = tick * 20'000;
    return state;
  }

  fs::path folder_;
  model_info_t model_{};
  Bus bus_{"memq://"};
  std::vector<action_t> actions_;
  component_status_t status_{};
};

TEST_F(PolicyComponentTest, AnswersEachStateOfItsEpisode) {
  PolicyComponent component(&bus_, {"hold"});
  Begin(3);
  EXPECT_NE(status_.state, component_status_t::READY) << "ready without MODEL";
  Send(channels::kModel, model_);
  Begin(3);
  EXPECT_EQ(status_.state, component_status_t::READY);
  EXPECT_EQ(status_.episode, 3);
  Send(channels::kState, State(3, 0));
  Send(channels::kState, State(2, 0));
  Send(channels::kState, State(3, 1));
  ASSERT_EQ(actions_.size(), 2u);
  EXPECT_EQ(actions_[1].header.episode, 3);
  EXPECT_EQ(actions_[1].header.tick, 1);
  EXPECT_EQ(actions_[1].header.sim_time_us, 20'000);
  EXPECT_EQ(actions_[1].joint_position_rad.size(), 14u);
  EXPECT_TRUE(actions_[1].error.empty());
  EXPECT_EQ(component.status().foreign_messages, 1);
  EXPECT_EQ(component.status().last_tick, 1);
}

TEST_F(PolicyComponentTest, WhatAPolicyThrowsTravelsInTheAction) {
  PolicyComponent component(&bus_, {"expert"});
  Send(channels::kModel, model_);
  Begin(0);
  // The state has no bodies.
  Send(channels::kState, State(0, 0));
  ASSERT_EQ(actions_.size(), 1u);
  EXPECT_FALSE(actions_[0].error.empty());
  EXPECT_EQ(actions_[0].header.tick, 0);
}

TEST_F(PolicyComponentTest, ReplaysALogAndARunFolder) {
  const fs::path log = folder_ / "episodes" / "0001" / "events.lcmlog";
  fs::create_directories(log.parent_path());
  EventLogWriter writer(log);
  action_t action{};
  action.header.episode = 1;
  action.mode = action_t::JOINT_POSITION;
  action.num_joints = 14;
  action.num_grippers = 2;
  action.gripper_closing = {0, 0};
  const auto write = [&](int64_t tick, double value) {
    action.header.tick = tick;
    action.header.sim_time_us = tick * 20'000;
    action.joint_position_rad.assign(14, value);
    writer.Write(channels::kAction, Encode(action), 0);
  };
  const auto begin_attempt = [&](int attempt) {
    episode_begin_t begin{};
    begin.header.episode = 1;
    begin.header.attempt = action.header.attempt = attempt;
    begin.seed = 1;
    writer.Write(channels::kEpisodeBegin, Encode(begin), 0);
  };
  writer.Write(channels::kModel, Encode(model_), 0);
  // The second attempt at the episode is replayed.
  begin_attempt(0);
  for (const int tick : {0, 1, 2}) write(tick, 0.5);
  begin_attempt(1);
  write(0, 0.1);
  write(1, 0.2);
  episode_end_t end{};
  end.header = action.header;
  writer.Write(channels::kEpisodeEnd, Encode(end), 0);
  episode_summary_t summary{};
  summary.header = action.header;
  writer.Write(channels::kEpisodeSummary, Encode(summary), 0);
  writer.Close();

  PolicyComponent component(&bus_, {"replay:" + log.string()});
  Send(channels::kModel, model_);
  Begin(1);
  Send(channels::kState, State(1, 0));
  Send(channels::kState, State(1, 1));
  ASSERT_EQ(actions_.size(), 2u);
  EXPECT_EQ(actions_[0].joint_position_rad[0], 0.1);
  EXPECT_EQ(actions_[1].joint_position_rad[0], 0.2);
  EXPECT_THROW(Begin(2), InputError);
  EXPECT_EQ(OpenRecording(folder_)(1).episode.actions.size(), 2u);
  EXPECT_EQ(OpenRecording(folder_)(1).episode.model->variation, model_.variation);
  EXPECT_TRUE(OpenRecording(folder_)(0).episode.actions.empty());
}

TEST_F(PolicyComponentTest, BadPoliciesAreRefusedAtOnce) {
  EXPECT_THROW(PolicyComponent(&bus_, {"nobody"}), InputError);
  EXPECT_THROW(PolicyComponent(&bus_, {"replay"}), InputError);
  EXPECT_THROW(PolicyComponent(&bus_, {"replay:/nowhere"}), InputError);
  EXPECT_THROW(PolicyComponent(&bus_, {"replay:" + folder_.string()}), InputError);
}

TEST_F(PolicyComponentTest, MissingModelIsAnInputError) {
  PolicyComponent component(&bus_, {"hold"});
  fs::remove(model_.physics_file);
  Send(channels::kModel, model_);
  EXPECT_THROW(Begin(0), InputError);
}

TEST_F(PolicyComponentTest, ActsOncePerStateAndRepeatsTheAction) {
  PolicyComponent component(&bus_, {"random"});
  Send(channels::kModel, model_);
  Begin(0);
  Send(channels::kState, State(0, 0));
  Send(channels::kState, State(0, 1));
  Send(channels::kState, State(0, 1));
  Send(channels::kState, State(0, 0));  // was answered before
  ASSERT_EQ(actions_.size(), 3u);
  EXPECT_EQ(actions_[2].header.tick, 1);
  EXPECT_EQ(actions_[2].joint_position_rad, actions_[1].joint_position_rad);
}

// A policy whose Begin() throws `error`.
template <class Error>
class FailingBegin : public Policy {
 public:
  explicit FailingBegin(const Error& error) : error_(error) {}
  void Begin(const episode_begin_t&) override { throw error_; }
  void Act(const state_t&, action_t*) override {}

 private:
  Error error_;
};

TEST_F(PolicyComponentTest, AFailedBeginNamesThePolicy) {
  const auto error_of = [&](const std::string& name, const auto& error) {
    using Error = std::decay_t<decltype(error)>;
    Bus bus("memq://");
    PolicyComponent component(&bus, name, [error](const mjModel&, const model_info_t&) {
      return std::make_unique<FailingBegin<Error>>(error);
    });
    bus.Publish(channels::kModel, model_);
    bus.Publish(channels::kEpisodeBegin, episode_begin_t{});
    try {
      while (bus.Handle()) {
      }
    } catch (const std::exception& thrown) {
      return std::string(thrown.what());
    }
    return std::string();
  };
  EXPECT_EQ(error_of("planner", std::runtime_error("no plan")), "policy 'planner': Begin() failed: no plan");
  EXPECT_EQ(error_of("planner", 7),
            "policy 'planner': Begin() failed: it threw an exception that is not a std::exception");
  EXPECT_EQ(error_of("replay", InputError("log.lcmlog: no episode 3")), "log.lcmlog: no episode 3");
}

// A policy that needs one image of each tick.
class ImagePolicy : public Policy {
 public:
  void Begin(const episode_begin_t&) override {}
  bool Compute(const state_t& state) override {
    if (seen_tick_ == state.header.tick) return true;
    image_request_.header = state.header;
    return false;
  }
  const image_request_t* image_request() const override {
    return seen_tick_ < image_request_.header.tick ? &image_request_ : nullptr;
  }
  void OnImage(const image_t& image) override { seen_tick_ = image.header.tick; }
  void Act(const state_t&, action_t* action) override { action->mode = action_t::JOINT_POSITION; }

 private:
  image_request_t image_request_{};
  int64_t seen_tick_ = -1;
};

TEST_F(PolicyComponentTest, RequestsImagesOfANewTickAtOnce) {
  RegisterPolicy("image_policy", "one image a tick",
                 [](const mjModel&, const model_info_t&) { return std::make_unique<ImagePolicy>(); });
  PolicyComponent component(&bus_, {"image_policy"});
  std::vector<int64_t> observed;
  bus_.Subscribe(channels::kRequestImage,
                 [&](const image_request_t& m) { observed.push_back(m.header.tick); });
  Send(channels::kModel, model_);
  Begin(0);
  for (int64_t tick = 0; tick < 20; ++tick) {
    Send(channels::kState, State(0, tick));
    // Each tick has one request and no repeat, because the repeat period has not passed.
    ASSERT_EQ(observed.size(), static_cast<size_t>(tick) + 1);
    EXPECT_EQ(observed.back(), tick);
    image_t image{};
    image.header = State(0, tick).header;
    Send(Channel<image_t>{"EVALBUS_IMAGE_front", "cameras"}, image);
    ASSERT_EQ(actions_.size(), static_cast<size_t>(tick) + 1);
  }
}

TEST_F(PolicyComponentTest, ModelsThatAreNoneAreRefused) {
  // The model file must be in the run folder and must not be a file that never ends.
  fs::create_directories(folder_ / "pipe/model");
  ASSERT_EQ(mkfifo((folder_ / "pipe/model/physics.mjb").c_str(), 0600), 0);
  fs::copy_file(model_.physics_file, folder_ / "other.mjb");
  fs::copy_file(model_.physics_file, folder_ / "physics.mjb");
  const std::string here = folder_.string(), real = model_.physics_file;
  for (const std::string& file :
       {std::string("/etc/passwd"), std::string("/dev/zero"), std::string("/proc/self/mem"), std::string("/"),
        std::string(), std::string("model/physics.mjb"), here + "/other.mjb", here + "/physics.mjb",
        here + "/model/../model/physics.mjb", here + "/pipe/model/physics.mjb", std::string(5000, '/') + real,
        "/" + std::string(5000, 'x') + "/" + real}) {
    Bus bus("memq://");
    PolicyComponent component(&bus, {"hold"});
    model_info_t model = model_;
    model.physics_file = file;
    bus.Publish(channels::kModel, model);
    bus.Publish(channels::kEpisodeBegin, episode_begin_t{});
    EXPECT_THROW(
        {
          while (bus.Handle()) {
          }
        },
        InputError)
        << file;
  }
}

}  // namespace evalbus::policy::policy_component_test
