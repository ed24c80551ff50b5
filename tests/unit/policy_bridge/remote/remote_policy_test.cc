#include "policy_bridge/remote/remote_policy.h"

#include <gtest/gtest.h>
#include <poll.h>

#include <cmath>
#include <future>
#include <limits>

#include "base/errors.h"
#include "bus/wake_event.h"
#include "tests/deadline.h"
#include "tests/doubles/policy_server.h"
#include "tests/unit/policy_bridge/policy_scene.h"

namespace evalbus::policy::remote_policy_test {

using namespace std::chrono_literals;

constexpr char kContract[] = R"(wire: openpi
url: ws://127.0.0.1:1
rate_hz: 20
deadlines: {connect_s: 900, first_reply_s: 900, reply_s: 900, return_s: 900}
observation:
  - {key: state, state: left.joint_position_rad, history_ticks: [-1, 0]}
  - {key: prompt, prompt: true}
action:
  kind: joint_position
  values: 8
  execute_steps: 2
  first_step_rad: 2
  arms:
    - {arm: left, indices: 0-6, gripper: {index: 7, open: 0, closed: 1}}
)";

// Returns a chunk whose k-th row contains `base + k / 10` everywhere.
Value ChunkOf(int steps, double base) {
  std::vector<double> numbers;
  for (int k = 0; k < steps; ++k) numbers.insert(numbers.end(), 8, base + 0.1 * k);
  return Map{{"actions", FloatArray(numbers, {steps, 8})}};
}

class RemotePolicyTest : public testing::Test {
 protected:
  void Serve(std::function<PolicyServerDouble::Answer(const Value&)> answer) {
    server_.emplace(PolicyServerDouble::Options{.answer = std::move(answer)});
    contract_ = ParseContract(kContract, "mine.yaml");
    contract_.url = server_->url();
  }
  // Serves chunks of six steps. All numbers of a chunk are the number of the call.
  void ServeConstantChunks() {
    Serve([calls = 0](const Value&) mutable {
      const double value = ++calls;
      std::vector<double> numbers(size_t{6} * 8, value);
      return Value(Map{{"actions", FloatArray(numbers, {6, 8})}});
    });
  }
  // Creates a policy that executes three steps of a chunk and computes for this time (ms).
  void MakeDelayed(const std::string& latency_ms, Execution rule) {
    contract_.first_step_rad.reset();
    contract_.execute_steps = 3;
    Latency latency = ParseLatency(latency_ms);
    latency.execution = rule;
    Make(latency);
  }
  void Make(Latency latency = {}, const std::string& clock = "lockstep", double realtime_factor = 1) {
    model_info_t info = GetPolicyScene().info();
    info.timestep_us = 2000;
    info.substeps = 25;
    info.clock = clock;
    info.realtime_factor = clock == "realtime" ? realtime_factor : 0;
    policy_ = std::make_unique<RemotePolicy>(contract_, latency, GetPolicyScene().model(), info);
    policy_->SetCallbacks({.on_observation = [this](const observation_t& m) { saw_.push_back(m); },
                           .on_policy_action = [this](const policy_action_t& m) { said_.push_back(m); },
                           .note = [this](const std::string& text) { notes_.push_back(text); },
                           .wake = [event = wake_event_] { event->Set(); }});
  }
  template <class F>
  bool Until(const F& f) {
    const auto deadline = std::chrono::steady_clock::now() + kDeadline;
    while (!f()) {
      if (std::chrono::steady_clock::now() > deadline) return false;
      std::this_thread::yield();
    }
    return true;
  }
  void Begin(int episode = 0) {
    episode_begin_t begin{};
    begin.header.episode = episode;
    policy_->Begin(begin);
    ASSERT_TRUE(Until([&] { return policy_->IsReady(); }));
  }
  static state_t State(int64_t tick) {
    state_t state{};
    state.header.tick = tick;
    state.header.sim_time_us = tick * 50'000;
    state.qpos_mixed.assign(static_cast<size_t>(GetPolicyScene().model().nq), 0);
    for (const arm_info_t& arm : GetPolicyScene().info().arm) {
      arm_state_t now{};
      now.joint_position_rad.assign(static_cast<size_t>(arm.num_joints), 0.01 * static_cast<double>(tick));
      now.joint_velocity_radps.assign(static_cast<size_t>(arm.num_joints), 0.0);
      now.num_joints = arm.num_joints;
      now.wrist_quat_wxyz[0] = 1;
      state.arm.push_back(now);
      state.gripper.emplace_back().opening = 1;
    }
    return state;
  }
  // Returns the policy's command at a tick: the target of the left arm's first joint.
  double Act(int64_t tick) {
    const state_t state = State(tick);
    EXPECT_TRUE(Until([&] { return policy_->Compute(state); }));
    action_ = {};
    policy_->Act(state, &action_);
    return action_.joint_position_rad.at(0);
  }

  std::optional<PolicyServerDouble> server_;
  Contract contract_;
  std::unique_ptr<RemotePolicy> policy_;
  action_t action_{};
  std::vector<observation_t> saw_;
  std::vector<policy_action_t> said_;
  std::vector<std::string> notes_;
  std::shared_ptr<WakeEvent> wake_event_ = std::make_shared<WakeEvent>();
};

TEST_F(RemotePolicyTest, CallsWhenItsStepsAreUsedUp) {
  Serve([calls = 0](const Value&) mutable { return ChunkOf(5, 0.2 * ++calls); });
  Make();
  Begin();
  EXPECT_FLOAT_EQ(Act(0), 0.2);
  EXPECT_FLOAT_EQ(Act(1), 0.3);
  EXPECT_FLOAT_EQ(Act(2), 0.4);
  EXPECT_FLOAT_EQ(Act(3), 0.5);
  EXPECT_EQ(server_->Requests().size(), 2u);
  ASSERT_EQ(saw_.size(), 2u);
  EXPECT_EQ(saw_[0].header.tick, 0);
  EXPECT_EQ(saw_[1].header.tick, 2);
  EXPECT_EQ(saw_[1].prompt, "lift the pot by the handles");
  ASSERT_EQ(said_.size(), 2u);
  EXPECT_EQ(said_[1].header.tick, 2);
  EXPECT_EQ(said_[1].kind, "joint_position");
  EXPECT_EQ(said_[1].num_steps, 5);
  EXPECT_EQ(said_[1].execute_steps, 2);
  EXPECT_FLOAT_EQ(said_[1].value_mixed[4][7], 0.8);
  EXPECT_GT(said_[1].answered_s, 0);
  EXPECT_EQ(said_[1].server_s, -1);
  // The arm that the contract does not mention stays at home.
  const arm_info_t& right = GetPolicyScene().info().arm[1];
  EXPECT_EQ(action_.joint_position_rad.at(7), right.joint_home_rad[0]);
}

TEST_F(RemotePolicyTest, ShowsItsHistory) {
  Serve([](const Value&) { return ChunkOf(2, 0); });
  Make();
  Begin();
  for (int tick = 0; tick < 4; ++tick) Act(tick);
  const auto state_of = [&](size_t request) {
    return Numbers(*server_->Requests().at(request).Find("state")->As<Array>());
  };
  // At tick 0 there is no earlier state. At tick 2 the earlier state is the state of tick 1.
  EXPECT_EQ(server_->Requests().at(0).Find("state")->As<Array>()->shape, (std::vector<int64_t>{2, 7}));
  EXPECT_FLOAT_EQ(state_of(0)[0], 0);
  EXPECT_FLOAT_EQ(state_of(0)[7], 0);
  EXPECT_FLOAT_EQ(state_of(1)[0], 0.01);
  EXPECT_FLOAT_EQ(state_of(1)[7], 0.02);
}

TEST_F(RemotePolicyTest, BytesHoldTheirRangeOnly) {
  Serve([](const Value&) { return ChunkOf(2, 0); });
  ObservationEntry& state = contract_.observation.at(0);
  state.dtype = "|u1";
  state.signals.at(0).scale = 100;
  state.signals.at(0).decimals = 0;
  Make();
  Begin();
  Act(2);
  const Value request = server_->Requests().at(0);
  EXPECT_EQ(request.Find("state")->As<Array>()->data[0], 2);
  EXPECT_THROW(policy_->Compute(State(300)), InputError);
}

TEST_F(RemotePolicyTest, AChunkEndsWithItsEpisode) {
  Serve([calls = 0](const Value&) mutable { return ChunkOf(5, 0.2 * ++calls); });
  Make();
  Begin(0);
  Act(0);
  Begin(1);
  EXPECT_FLOAT_EQ(Act(0), 0.4);
}

TEST_F(RemotePolicyTest, SettlesFirst) {
  Serve([](const Value&) { return ChunkOf(2, 0.7); });
  contract_.settle_steps = 2;
  Make();
  Begin();
  EXPECT_EQ(Act(0), 0);
  EXPECT_EQ(Act(1), 0);
  EXPECT_EQ(server_->Requests().size(), 0u);
  EXPECT_FLOAT_EQ(Act(2), 0.7);
}

TEST_F(RemotePolicyTest, ComputationIsChargedInTicks) {
  Serve([calls = 0](const Value&) mutable { return ChunkOf(2, 0.2 * ++calls); });
  // 120 ms is rounded up to three ticks of 50 ms.
  Make(ParseLatency("120"));
  Begin();
  EXPECT_EQ(Act(0), 0);
  EXPECT_EQ(Act(1), 0);
  EXPECT_EQ(Act(2), 0);
  EXPECT_FLOAT_EQ(Act(3), 0.2);
  EXPECT_FLOAT_EQ(Act(4), 0.3);
  // The policy is called again at tick 5; the robot holds its last command.
  EXPECT_FLOAT_EQ(Act(5), 0.3);
  EXPECT_FLOAT_EQ(Act(7), 0.3);
  EXPECT_FLOAT_EQ(Act(8), 0.4);
  EXPECT_EQ(said_.at(1).header.tick, 5);
  EXPECT_EQ(said_.at(1).held_ticks, 3);
}

TEST_F(RemotePolicyTest, AsynchronousGoesOnDuringAnInference) {
  Serve([calls = 0](const Value&) mutable { return ChunkOf(6, ++calls); });
  MakeDelayed("100", Execution::kAsynchronous);
  Begin();
  EXPECT_EQ(Act(0), 0);
  EXPECT_EQ(Act(1), 0);
  for (int k = 0; k < 5; ++k) EXPECT_FLOAT_EQ(Act(2 + k), 1 + 0.1f * static_cast<float>(k));
  // The second answer was requested at tick 5, so its third row belongs to tick 7.
  EXPECT_FLOAT_EQ(Act(7), 2.2);
  EXPECT_FLOAT_EQ(Act(8), 2.3);
  EXPECT_EQ(said_.at(1).header.tick, 5);
  EXPECT_EQ(said_.at(1).held_ticks, 2);
}

TEST_F(RemotePolicyTest, RtcJoinsTheChunkToWhatIsCommitted) {
  ServeConstantChunks();
  MakeDelayed("50", Execution::kRealTimeChunking);
  Begin();
  EXPECT_EQ(Act(0), 0);
  for (int tick = 1; tick < 5; ++tick) EXPECT_FLOAT_EQ(Act(tick), 1);
  // The second chunk observed tick 4. The first chunk still had rows for ticks 4, 5 and 6, and its row for
  // tick 4 was executed. The weights of its other rows are tested in chunk_schedule_test.cc.
  EXPECT_NEAR(Act(5), 2 - 0.367706, 1e-6);
  EXPECT_NEAR(Act(6), 2 - 0.076746, 1e-6);
  EXPECT_EQ(saw_.at(1).header.tick, 4);
}

TEST_F(RemotePolicyTest, RtcLeavesJoiningToAServerThatIsShownWhatIsCommitted) {
  ServeConstantChunks();
  std::string text = kContract;
  text.insert(text.find("  - {key: prompt"),
              "  - {key: prefix, committed: actions}\n  - {key: delay, committed: delay_steps}\n");
  contract_ = ParseContract(text, "mine.yaml");
  contract_.url = server_->url();
  MakeDelayed("50", Execution::kRealTimeChunking);
  Begin();
  for (int tick = 0; tick < 5; ++tick) Act(tick);
  EXPECT_FLOAT_EQ(Act(5), 2);
  const auto requests = server_->Requests();
  ASSERT_EQ(requests.size(), 2u);
  EXPECT_EQ(requests[0].Find("prefix")->As<Array>()->shape, (std::vector<int64_t>{0, 8}));
  EXPECT_EQ(*requests[0].Find("delay"), Value(0));
  EXPECT_EQ(requests[1].Find("prefix")->As<Array>()->shape, (std::vector<int64_t>{3, 8}));
  EXPECT_EQ(*requests[1].Find("delay"), Value(1));
}

TEST(CheckExecution, RtcRequiresNumbersThatCanBeAveraged) {
  Contract contract = ParseContract(kContract, "mine.yaml");
  EXPECT_NO_THROW(CheckExecution(contract, Execution::kRealTimeChunking));
  contract.actions.kind = ActionKind::kEefPose;
  contract.actions.rotation = RotationForm::kQuaternionWxyz;
  EXPECT_THROW(CheckExecution(contract, Execution::kRealTimeChunking), InputError);
  EXPECT_NO_THROW(CheckExecution(contract, Execution::kAsynchronous));
  contract.actions.rotation = RotationForm::kRotation6d;
  EXPECT_NO_THROW(CheckExecution(contract, Execution::kRealTimeChunking));
}

TEST_F(RemotePolicyTest, OnARealtimeClockItHoldsUntilTheAnswerIsThere) {
  std::promise<void> go;
  Serve([go = go.get_future().share()](const Value&) {
    go.wait();
    return ChunkOf(2, 0.7);
  });
  // The server's thread determines how far the robot of State() has moved when the answer arrives, so
  // first_step_rad is not checked.
  contract_.first_step_rad.reset();
  Make({}, "realtime");
  Begin();
  EXPECT_EQ(Act(0), 0);
  EXPECT_EQ(Act(1), 0);
  go.set_value();
  int64_t tick = 2;
  ASSERT_TRUE(Until([&] { return Act(tick++) > 0; }));
  EXPECT_EQ(said_.at(0).header.tick, 0);
  EXPECT_GE(said_.at(0).held_ticks, 2);
}

// The simulation is so slow here that the answer arrives within the first half (25 s) of its tick.
TEST_F(RemotePolicyTest, OnARealtimeClockAnAnswerWithinTheWindowCountsForItsTick) {
  Serve([calls = 0](const Value&) mutable { return ChunkOf(2, 0.2 * ++calls); });
  Make({}, "realtime", 1e-3);
  Begin();
  EXPECT_FLOAT_EQ(Act(0), 0.2);
  EXPECT_FLOAT_EQ(Act(1), 0.3);
  EXPECT_FLOAT_EQ(Act(2), 0.4);
  EXPECT_EQ(said_.at(1).header.tick, 2);
  EXPECT_EQ(said_.at(1).held_ticks, 0);
}

// The second inference takes as many ticks as are executed, so the third one begins when its answer arrives,
// as in lockstep.
TEST_F(RemotePolicyTest, OnARealtimeClockADueInferenceBeginsAtTheTickOfTheLastAnswer) {
  std::promise<void> go;
  Serve([calls = 0, go = go.get_future().share()](const Value&) mutable {
    if (++calls == 2) go.wait();
    return ChunkOf(6, calls);
  });
  contract_.first_step_rad.reset();
  contract_.execute_steps = 3;
  Make({.execution = Execution::kAsynchronous}, "realtime", 1e-3);
  Begin();
  for (int tick = 0; tick < 6; ++tick) EXPECT_FLOAT_EQ(Act(tick), 1 + 0.1f * static_cast<float>(tick));
  EXPECT_EQ(saw_.size(), 2u);
  go.set_value();
  EXPECT_FLOAT_EQ(Act(6), 2.3);
  EXPECT_EQ(said_.at(1).header.tick, 3);
  EXPECT_EQ(said_.at(1).held_ticks, 3);
  ASSERT_EQ(saw_.size(), 3u);
  EXPECT_EQ(saw_[2].header.tick, 6);
}

TEST_F(RemotePolicyTest, WithoutAWindowAnAnswerCountsForTheNextTick) {
  Serve([](const Value&) { return ChunkOf(2, 0.7); });
  contract_.answer_window = 0;
  Make({}, "realtime", 1e-3);
  Begin();
  const state_t state = State(0);
  EXPECT_TRUE(policy_->Compute(state)) << "it does not wait";
}

TEST_F(RemotePolicyTest, CountsEpisodesTicksAndObservations) {
  Serve([](const Value&) { return ChunkOf(2, 0.7); });
  std::string text = kContract;
  text.insert(text.find("  - {key: prompt"),
              "  - {key: episode, counter: episode}\n  - {key: tick, counter: tick}\n"
              "  - {key: observation, counter: observation}\n");
  contract_ = ParseContract(text, "mine.yaml");
  contract_.url = server_->url();
  Make();
  for (const int episode : {0, 4}) {
    Begin(episode);
    // The header of State() belongs to episode 0.
    for (int64_t tick = 0; tick < 4; ++tick) Act(tick);
  }
  const auto requests = server_->Requests();
  ASSERT_EQ(requests.size(), 4u);
  for (size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(*requests[i].Find("tick"), Value(static_cast<int>(i % 2 * 2)));
    EXPECT_EQ(*requests[i].Find("observation"), Value(static_cast<int>(i % 2)));
    EXPECT_EQ(*requests[i].Find("episode"), Value(0));
  }
  EXPECT_EQ(saw_.at(3).array.at(1).key, "episode");
}

TEST_F(RemotePolicyTest, WakesItsOwnerWhenAnAnswerIsThere) {
  Serve([](const Value&) { return ChunkOf(2, 0.7); });
  Make();
  Begin();
  for (const int64_t tick : {0, 2}) {
    wake_event_->Clear();
    const state_t state = State(tick);
    // The first call starts the request. The next call is made when the event is set, and it returns the
    // answer.
    if (policy_->Compute(state)) continue;
    pollfd readable{wake_event_->fd(), POLLIN, 0};
    ASSERT_EQ(poll(&readable, 1, 60'000), 1);
    EXPECT_TRUE(policy_->Compute(state));
    policy_->Act(state, &action_);
    policy_->Act(State(tick + 1), &action_);
  }
}

TEST_F(RemotePolicyTest, AnImageThatIsNoLongerAvailableGivesWayToTheNewestTick) {
  Serve([](const Value&) { return ChunkOf(2, 0.7); });
  std::string text = kContract;
  text.insert(text.find("  - {key: prompt"), "  - {key: image, camera: front, size_px: [32, 32]}\n");
  contract_ = ParseContract(text, "mine.yaml");
  contract_.url = server_->url();
  Make({}, "realtime");
  Begin();
  policy_->Compute(State(0));
  ASSERT_NE(policy_->image_request(), nullptr);
  image_t gone{};
  gone.header = policy_->image_request()->header;
  policy_->Compute(State(7));
  EXPECT_EQ(policy_->image_request()->header.tick, 0);
  gone.view = policy_->image_request()->view.at(0);
  policy_->OnImage(gone);
  EXPECT_EQ(policy_->image_request(), nullptr);
  policy_->Compute(State(8));
  ASSERT_NE(policy_->image_request(), nullptr);
  EXPECT_EQ(policy_->image_request()->header.tick, 8);
}

TEST_F(RemotePolicyTest, FirstStepOfAnAbsoluteActionIsWhereTheRobotIs) {
  Serve([](const Value&) { return ChunkOf(2, 90); });
  Make();
  Begin();
  try {
    Act(0);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()).find("mine.yaml: the policy's first action moves joint"), 0u)
        << error.what();
  }
}

TEST_F(RemotePolicyTest, AnAbsurdFirstStepIsReportedInFewDigits) {
  Serve([](const Value&) { return ChunkOf(2, 1e38); });
  Make();
  Begin();
  try {
    Act(0);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find(" by 1e+38 rad, "), std::string::npos) << error.what();
  }
}

TEST_F(RemotePolicyTest, AnotherShapeIsReportedBeforeTheFirstEpisodeCounts) {
  Serve([](const Value&) -> Value {
    return Map{{"actions", FloatArray(std::vector<double>(14, 0), {2, 7})}};
  });
  Make();
  Begin();
  const state_t state = State(0);
  EXPECT_THROW(Until([&] { return policy_->Compute(state); }), InputError);
}

TEST_F(RemotePolicyTest, AnotherShapeLaterIsTheServersFault) {
  Serve([calls = 0](const Value&) mutable -> Value { return ChunkOf(++calls == 1 ? 2 : 1, 0); });
  Make();
  Begin();
  Act(0);
  Act(1);
  const state_t state = State(2);
  EXPECT_THROW(Until([&] { return policy_->Compute(state); }), ServerError);
}

TEST_F(RemotePolicyTest, NanIsThePolicysFault) {
  Serve([](const Value&) { return ChunkOf(2, std::numeric_limits<double>::quiet_NaN()); });
  Make();
  Begin();
  const state_t state = State(0);
  ASSERT_TRUE(Until([&] { return policy_->Compute(state); }));
  try {
    policy_->Act(state, &action_);
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(dynamic_cast<const ServerError*>(&error), nullptr);
  }
}

TEST_F(RemotePolicyTest, WaitsForAServerThatComesBack) {
  Serve([](const Value&) { return ChunkOf(2, 0.7); });
  Make();
  Begin();
  Act(0);
  Act(1);
  server_->Stop();
  const state_t state = State(2);
  EXPECT_THROW(Until([&] { return policy_->Compute(state); }), ServerError);
  episode_begin_t begin{};
  begin.header.attempt = 1;
  policy_->Begin(begin);
  ASSERT_TRUE(Until([&] { return !policy_->IsReady() && !notes_.empty(); }));
  server_->Start();
  ASSERT_TRUE(Until([&] { return policy_->IsReady(); }));
  EXPECT_EQ(notes_.size(), 2u) << notes_.front();
  EXPECT_FLOAT_EQ(Act(0), 0.7);
}

TEST_F(RemotePolicyTest, AServerThatStaysAwayIsTheEnvironments) {
  Serve([](const Value&) { return ChunkOf(2, 0.7); });
  contract_.deadlines.return_s = 0.001;
  server_->Stop();
  Make();
  policy_->Begin({});
  // The launcher does not restart a policy that has waited for return_s.
  try {
    Until([&] { return policy_->IsReady(); });
    FAIL();
  } catch (const LastingError& error) {
    const std::string words = error.what();
    EXPECT_TRUE(words.starts_with("waited 0.001 s for the policy's server (return_s): ")) << words;
  }
  ASSERT_EQ(notes_.size(), 1u);
  EXPECT_TRUE(notes_[0].starts_with("waiting up to 0.001 s for the policy's server: ")) << notes_[0];
}

TEST_F(RemotePolicyTest, ARefusalIsNotWaitedFor) {
  Serve([](const Value&) { return ChunkOf(2, 0.7); });
  server_.emplace(PolicyServerDouble::Options{.answer = {}, .http_status = 401});
  contract_.url = server_->url();
  Make();
  policy_->Begin({});
  EXPECT_THROW(Until([&] { return policy_->IsReady(); }), EnvironmentError);
  EXPECT_TRUE(notes_.empty()) << notes_.front();
}

TEST_F(RemotePolicyTest, AnotherRateIsRefused) {
  Serve([](const Value&) { return ChunkOf(2, 0.7); });
  contract_.rate_hz = 50;
  EXPECT_THROW(Make(), InputError);
}

TEST(Latency, IsOneOfThree) {
  EXPECT_EQ(ParseLatency("none").kind, Latency::Kind::kNone);
  EXPECT_EQ(ParseLatency("measured").kind, Latency::Kind::kMeasured);
  EXPECT_EQ(ParseLatency("80").fixed_s, 0.08);
  for (const char* wrong : {"", "some", "-1", "1e9", "nan", "5 ms"})
    EXPECT_THROW(ParseLatency(wrong), InputError);
}

}  // namespace evalbus::policy::remote_policy_test
