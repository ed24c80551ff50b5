#include "sim/sim_component.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <fstream>
#include <sstream>

#include "base/errors.h"
#include "base/sha256.h"
#include "bus/channels.h"
#include "evalbus/episode_summary_t.hpp"
#include "tests/unit/poll_for.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::sim::sim_component_test {

// Acts as policy and metrics for a sim on an in-process bus and handles one message at a time.
class SimComponentTest : public testing::Test {
 protected:
  SimComponentTest() {
    Log::SetFiles([this](const std::string& name) { return folder_.path() / (name + ".log"); });
  }
  ~SimComponentTest() override { Log::SetFiles({}); }

  void MakeSim(SimOptions options = {}, int64_t session = 0) {
    if (options.task.empty()) options.task = "lift_pot";
    options.out = folder_.path();
    sim_.reset();
    bus_.emplace("memq://", session);
    sim_ = std::make_unique<SimComponent>(&*bus_, options);
    bus_->Subscribe(channels::kModel, [this](const model_info_t& m) {
      model_ = m;
      ++num_models_;
    });
    bus_->Subscribe(channels::kEpisodeBegin, [this](const episode_begin_t& m) { begins_.push_back(m); });
    bus_->Subscribe(channels::kState, [this](const state_t& m) { states_.push_back(m); });
    bus_->Subscribe(channels::kEpisodeEnd, [this](const episode_end_t& m) { ends_.push_back(m); });
  }
  void HandleAll() {
    while (bus_->Handle()) {
    }
  }
  void Command(int32_t episode, int32_t attempt = 0) {
    command_t command{};
    command.kind = command_t::START_EPISODE;
    command.episode = episode;
    command.attempt = attempt;
    command.seed = 11;
    command.required_component = {"policy", "metrics"};
    command.num_required = 2;
    command.required_instance.assign(command.required_component.size(), 0);
    bus_->Publish(channels::kCommand, command);
    HandleAll();
  }
  void Status(const std::string& name, int32_t episode, int64_t last_tick = -1, int64_t window = 0) {
    component_status_t status{};
    status.component = name;
    status.state = component_status_t::READY;
    status.episode = episode;
    status.last_tick = last_tick;
    status.lag_window_ticks = window;
    bus_->Publish(channels::kStatus, status);
    HandleAll();
  }
  void Start(int32_t episode = 0) {
    Command(episode);
    Status("policy", episode);
    Status("metrics", episode);
  }
  action_t Action(int64_t tick) {
    action_t action{};
    action.header.episode = states_.back().header.episode;
    action.header.tick = tick;
    action.mode = action_t::JOINT_POSITION;
    for (const arm_info_t& arm : model_.arm) {
      action.joint_position_rad.insert(action.joint_position_rad.end(), arm.joint_home_rad.begin(),
                                       arm.joint_home_rad.end());
    }
    action.num_joints = static_cast<int32_t>(action.joint_position_rad.size());
    action.gripper_closing = {0, 0};
    action.num_grippers = 2;
    return action;
  }
  void Act(const action_t& action) {
    bus_->Publish(channels::kAction, action);
    HandleAll();
  }
  void Score(int64_t tick, int8_t verdict = partial_metrics_t::UNDECIDED) {
    partial_metrics_t partial{};
    partial.header.episode = states_.back().header.episode;
    partial.header.tick = tick;
    partial.verdict = verdict;
    bus_->Publish(channels::kPartial, partial);
    HandleAll();
  }
  // Returns the contents of the sim's log so far.
  std::string Logged() const {
    std::ostringstream text;
    text << std::ifstream(folder_.path() / "sim.log").rdbuf();
    return text.str();
  }
  int64_t tick() const { return states_.back().header.tick; }

  TemporaryFolder folder_;
  std::optional<Bus> bus_;
  std::unique_ptr<SimComponent> sim_;
  model_info_t model_{};
  int num_models_ = 0;
  std::vector<episode_begin_t> begins_;
  std::vector<state_t> states_;
  std::vector<episode_end_t> ends_;
};

TEST_F(SimComponentTest, AnnouncesModelsThatExistAndMatchTheirHash) {
  MakeSim();
  Command(0);
  EXPECT_EQ(model_.task, "lift_pot");
  EXPECT_EQ(model_.variation, "base");
  EXPECT_EQ(model_.timestep_us, 2000);
  EXPECT_EQ(model_.substeps, 10);
  EXPECT_EQ(Sha256File(model_.physics_file), model_.physics_sha256);
  EXPECT_EQ(Sha256File(model_.visual_file), model_.visual_sha256);
  EXPECT_TRUE(std::filesystem::exists(folder_.path() / "model/scene.xml"));
}

TEST_F(SimComponentTest, WaitsUntilEveryRequiredComponentIsReadyForThisEpisode) {
  MakeSim();
  Command(3);
  ASSERT_EQ(begins_.size(), 1u);
  EXPECT_EQ(begins_[0].header.episode, 3);
  EXPECT_EQ(begins_[0].seed, 11);
  Status("policy", 3);
  Status("metrics", 2);  // ready for another episode
  EXPECT_TRUE(states_.empty());
  Status("metrics", 3);
  ASSERT_EQ(states_.size(), 1u);
  EXPECT_EQ(tick(), 0);
  EXPECT_EQ(states_[0].header.sim_time_us, 0);
}

TEST_F(SimComponentTest, ARepeatedCommandStartsNothingTwice) {
  MakeSim();
  Start();
  Command(0);
  EXPECT_EQ(begins_.size(), 1u);
  Command(0, 1);  // another attempt must wait
  EXPECT_EQ(begins_.size(), 1u);
  Score(0, partial_metrics_t::FAILURE);
  ASSERT_EQ(begins_.size(), 2u);
  EXPECT_EQ(begins_[1].header.attempt, 1);
}

TEST_F(SimComponentTest, CommandsOfAnOldLogDoNotKeepItFromTheLaunchers) {
  MakeSim();
  Command(0, 1);
  Command(0, 0);  // an earlier attempt
  ASSERT_EQ(begins_.size(), 1u);
  EXPECT_EQ(begins_[0].header.attempt, 1);
  EXPECT_EQ(sim_->status().foreign_messages, 1);
  // No component becomes ready for episode 5.
  Command(5);
  EXPECT_EQ(begins_.back().header.episode, 5);
  Command(0, 1);
  EXPECT_EQ(begins_.back().header.episode, 0);
  EXPECT_EQ(begins_.back().header.attempt, 1);
  // If several commands arrive during an episode, the last one counts.
  Command(1);
  Start(2);
  const size_t begun = begins_.size();
  for (int32_t episode = 3; episode < 100; ++episode) Command(episode);
  EXPECT_EQ(begins_.size(), begun);
  Score(0, partial_metrics_t::SUCCESS);
  ASSERT_EQ(begins_.size(), begun + 1);
  EXPECT_EQ(begins_.back().header.episode, 99);
}

TEST_F(SimComponentTest, TakesAStepOnlyWithActionAndScore) {
  MakeSim();
  Start();
  Act(Action(0));
  EXPECT_EQ(tick(), 0);
  Score(0);
  EXPECT_EQ(tick(), 1);
  EXPECT_EQ(states_.back().header.sim_time_us, 20000);
  Score(1);
  EXPECT_EQ(tick(), 1);
  Act(Action(1));
  EXPECT_EQ(tick(), 2);
}

TEST_F(SimComponentTest, TheOrderOfActionAndScoreDoesNotChangeTheState) {
  MakeSim();
  std::vector<std::vector<double>> qpos[2];
  for (const int order : {0, 1}) {
    Start(order);
    for (int64_t k = 0; k < 20; ++k) {
      action_t action = Action(k);
      action.joint_position_rad[0] = 0.02 * static_cast<double>(k);
      if (order == 0) Act(action);
      Score(k);
      if (order == 1) Act(action);
      ASSERT_EQ(tick(), k + 1);
      qpos[order].push_back(states_.back().qpos_mixed);
    }
    Act(Action(20));
    Score(20, partial_metrics_t::SUCCESS);
  }
  EXPECT_EQ(qpos[0], qpos[1]);
}

TEST_F(SimComponentTest, AVerdictEndsTheEpisodeAtItsTickAndDropsTheStepAhead) {
  MakeSim();
  Start();
  Act(Action(0));
  Score(0);
  Act(Action(1));  // physics of tick 2 is computed in advance and must not be published
  Score(1, partial_metrics_t::SUCCESS);
  ASSERT_EQ(ends_.size(), 1u);
  EXPECT_EQ(ends_[0].end_reason, "success");
  EXPECT_EQ(ends_[0].header.tick, 1);
  EXPECT_EQ(states_.size(), 2u);
}

TEST_F(SimComponentTest, WrongActionsEndTheEpisodeWithPolicyError) {
  MakeSim();
  Start();
  action_t bad = Action(0);
  bad.joint_position_rad[0] = std::numeric_limits<double>::quiet_NaN();
  Act(bad);
  Score(0);
  action_t failed{};
  Start(1);
  failed = Action(0);
  failed.error = "out of memory";
  Act(failed);
  Score(0);
  ASSERT_EQ(ends_.size(), 2u);
  EXPECT_EQ(ends_[0].end_reason, "policy_error");
  EXPECT_EQ(ends_[0].detail, "the action contains NaN or infinity");
  EXPECT_EQ(ends_[1].end_reason, "policy_error");
  EXPECT_EQ(ends_[1].detail, "out of memory");
}

TEST_F(SimComponentTest, AnswersForOtherTicksAndEpisodesAreForeign) {
  MakeSim();
  Start();
  Act(Action(1));
  Act(Action(-1));
  Score(5);
  action_t other = Action(0);
  other.header.episode = 9;
  Act(other);
  EXPECT_EQ(tick(), 0);
  EXPECT_EQ(sim_->status().foreign_messages, 4);
  Act(Action(0));
  Act(Action(0));  // a second answer
  Score(0);
  Score(0);
  EXPECT_EQ(tick(), 1);
  EXPECT_EQ(sim_->status().foreign_messages, 6);
}

TEST_F(SimComponentTest, AConsumerWithAWindowHoldsTheSimBack) {
  MakeSim();
  Start();
  Status("recorder", 0, -1, 4);
  for (int64_t k = 0; k < 3; ++k) {
    Act(Action(k));
    Score(k);
  }
  // The sim is at most 4 ticks ahead of the last tick that the recorder has reported, which is -1 here.
  EXPECT_EQ(tick(), 3);
  Act(Action(3));
  Score(3);
  EXPECT_EQ(tick(), 3);
  Status("recorder", 0, 2, 4);
  EXPECT_EQ(tick(), 4);
}

TEST_F(SimComponentTest, EndsAtTheTimeLimit) {
  MakeSim();
  Start();
  const int64_t last = model_.time_limit_us / 20000;
  for (int64_t k = 0; ends_.empty() && k < 2 * last; ++k) {
    Act(Action(k));
    Score(k);
  }
  ASSERT_EQ(ends_.size(), 1u);
  EXPECT_EQ(ends_[0].end_reason, "time_limit");
  EXPECT_EQ(ends_[0].header.tick, last);
}

TEST_F(SimComponentTest, SilentPolicyAndSilentMetricsEndTheEpisode) {
  SimOptions options;
  options.policy_timeout_s = options.metrics_timeout_s = 5;
  MakeSim(options);
  Start();
  Score(0);
  PollFor(sim_.get(), std::chrono::steady_clock::now(), std::chrono::seconds(6));
  HandleAll();
  Start(1);
  PollFor(sim_.get(), std::chrono::steady_clock::now(), std::chrono::seconds(6));
  HandleAll();
  // Each EPISODE_END is repeated until the next episode begins.
  ASSERT_FALSE(ends_.empty());
  EXPECT_EQ(ends_.front().end_reason, "policy_timeout");
  EXPECT_EQ(ends_.back().end_reason, "aborted");
  EXPECT_EQ(ends_.back().header.episode, 1);
}

// The sim does not run for an hour, as in a frozen container, in which the policy did not run either.
TEST_F(SimComponentTest, TimeInWhichTheSimDidNotRunIsNotThePolicys) {
  SimOptions options;
  options.policy_timeout_s = options.metrics_timeout_s = 5;
  MakeSim(options);
  Start();
  const auto now = std::chrono::steady_clock::now();
  sim_->Poll(now + std::chrono::hours(1));  // exceeds the timeout of metrics
  HandleAll();
  Score(0);
  sim_->Poll(now + std::chrono::hours(2));
  HandleAll();
  EXPECT_TRUE(ends_.empty());
  PollFor(sim_.get(), now + std::chrono::hours(2), std::chrono::seconds(6));
  HandleAll();
  ASSERT_FALSE(ends_.empty());
  EXPECT_EQ(ends_[0].end_reason, "policy_timeout");
}

TEST_F(SimComponentTest, MessagesOfAnotherRunsSimAreCountedAndIgnored) {
  MakeSim({}, 7);
  Start();
  EXPECT_EQ(model_.session, 7);
  EXPECT_EQ(begins_[0].header.session, 7);
  EXPECT_EQ(states_[0].header.session, 7);
  // Publishes an ACTION that would end the episode, and a verdict.
  action_t action = Action(0);
  action.header.session = 8;
  action.error = "another run's policy failed";
  bus_->PublishRaw(channels::kAction.name, Encode(action));
  partial_metrics_t partial{};
  partial.header = action.header;
  partial.verdict = partial_metrics_t::FAILURE;
  bus_->PublishRaw(channels::kPartial.name, Encode(partial));
  model_info_t model = model_;
  model.session = 8;
  bus_->PublishRaw(channels::kModel.name, Encode(model));
  episode_begin_t begin = begins_[0];
  begin.header.session = 8;
  begin.header.episode = 3;
  bus_->PublishRaw(channels::kEpisodeBegin.name, Encode(begin));
  HandleAll();
  EXPECT_TRUE(ends_.empty());
  EXPECT_EQ(bus_->foreign_messages(), 4);
  sim_->Poll(std::chrono::steady_clock::now() + std::chrono::seconds(1));
  EXPECT_EQ(sim_->status().foreign_messages, 4);
  sim_->Poll(std::chrono::steady_clock::now() + std::chrono::seconds(2));
  EXPECT_THAT(Logged(), testing::HasSubstr("4 of them came from another run, or from a log being played"));
  // The same message with this run's session ends the episode.
  bus_->Publish(channels::kEpisodeBegin, begin);
  HandleAll();
  ASSERT_EQ(ends_.size(), 1u);
  EXPECT_EQ(ends_[0].end_reason, "aborted");
}

// A replayed policy that answered tick 5 of an old log has not answered tick 5 of this run.
TEST_F(SimComponentTest, AStateOfATickToComeEndsTheEpisode) {
  MakeSim();
  Start();
  state_t state = states_[0];
  bus_->Publish(channels::kState, state);  // unchanged
  HandleAll();
  EXPECT_TRUE(ends_.empty());
  state.header.tick = 5;
  state.header.attempt = 1;
  bus_->Publish(channels::kState, state);
  HandleAll();
  EXPECT_TRUE(ends_.empty());
  state.header.attempt = 0;
  bus_->Publish(channels::kState, state);
  HandleAll();
  ASSERT_EQ(ends_.size(), 1u);
  EXPECT_EQ(ends_[0].end_reason, "aborted");
  EXPECT_EQ(ends_[0].detail,
            "a STATE that is not this sim's: is a second sim on this bus, or a log being played?");
}

TEST_F(SimComponentTest, AConsumerWithAWindowThatStopsEndsTheEpisode) {
  SimOptions options;
  options.metrics_timeout_s = 5;
  options.policy_timeout_s = 1;
  MakeSim(options);
  Start();
  Status("recorder", 0, -1, 1);
  Act(Action(0));
  Score(0);
  const auto later = PollFor(sim_.get(), std::chrono::steady_clock::now(), std::chrono::seconds(4));
  HandleAll();
  EXPECT_TRUE(ends_.empty());
  PollFor(sim_.get(), later, std::chrono::seconds(2));
  HandleAll();
  ASSERT_FALSE(ends_.empty());
  EXPECT_EQ(ends_[0].end_reason, "aborted");
  EXPECT_EQ(ends_[0].detail, "recorder does not keep up: 1 tick behind at tick 0");
}

TEST_F(SimComponentTest, StopsOnCommandInMidEpisode) {
  MakeSim();
  Start(3);
  command_t stop{};
  stop.kind = command_t::STOP;
  bus_->Publish(channels::kCommand, stop);
  HandleAll();
  ASSERT_EQ(ends_.size(), 1u);
  EXPECT_EQ(ends_[0].end_reason, "aborted");
  EXPECT_EQ(ends_[0].detail, "stopped on command");
  EXPECT_TRUE(sim_->done());
}

TEST_F(SimComponentTest, RepeatsTheEndUntilTheNextEpisodeBegins) {
  MakeSim();
  Start(3);
  Score(0, partial_metrics_t::FAILURE);
  ASSERT_EQ(ends_.size(), 1u);
  const auto later = std::chrono::steady_clock::now() + std::chrono::seconds(3);
  sim_->Poll(later);
  HandleAll();
  ASSERT_EQ(ends_.size(), 2u);
  EXPECT_EQ(ends_[1].end_reason, "failure");
  EXPECT_EQ(ends_[1].header.episode, 3);
  Start(4);
  sim_->Poll(later + std::chrono::seconds(3));
  HandleAll();
  EXPECT_EQ(ends_.size(), 2u);
}

TEST_F(SimComponentTest, RepeatsTheModelForLateComponents) {
  MakeSim();
  Start();
  const int announced = num_models_;
  const auto now = std::chrono::steady_clock::now();
  sim_->Poll(now);
  HandleAll();
  EXPECT_EQ(num_models_, announced);
  sim_->Poll(now + std::chrono::milliseconds(1100));  // while the policy computes
  HandleAll();
  EXPECT_EQ(num_models_, announced + 1);
  for (int64_t k = 0; k < 101; ++k) {  // two simulated seconds without wall-clock time
    Act(Action(k));
    Score(k);
    sim_->Poll(now);
    HandleAll();
  }
  EXPECT_EQ(num_models_, announced + 2);
  EXPECT_EQ(states_.size(), 102u);
}

TEST_F(SimComponentTest, RealtimeHoldsTheLastActionAndCountsTheMiss) {
  SimOptions options;
  options.realtime = true;
  MakeSim(options);
  Start();
  Act(Action(0));
  sim_->Poll(sim_->next_poll());
  HandleAll();
  EXPECT_EQ(tick(), 1);
  EXPECT_EQ(states_.back().deadline_misses, 0);
  sim_->Poll(sim_->next_poll());
  HandleAll();
  EXPECT_EQ(tick(), 2);
  EXPECT_EQ(states_.back().deadline_misses, 1);
  Score(1, partial_metrics_t::SUCCESS);  // a late verdict counts
  ASSERT_EQ(ends_.size(), 1u);
  EXPECT_EQ(ends_[0].end_reason, "success");
  EXPECT_THAT(Logged(), testing::ContainsRegex("warning. sim  e0 t2  1 tick without an ACTION in time, "));
}

// Datagrams of a policy on another machine may be reordered.
TEST_F(SimComponentTest, RealtimeIgnoresAnActionThatALaterOneHasOvertaken) {
  SimOptions options;
  options.realtime = true;
  MakeSim(options);
  Start();
  sim_->Poll(sim_->next_poll());
  HandleAll();
  ASSERT_EQ(tick(), 1);
  action_t newer = Action(1), older = Action(0);
  newer.joint_position_rad[0] += 0.1;
  Act(newer);
  EXPECT_EQ(sim_->status().foreign_messages, 0);
  Act(older);
  EXPECT_EQ(sim_->status().foreign_messages, 1);
  sim_->Poll(sim_->next_poll());
  HandleAll();
  EXPECT_EQ(states_.back().deadline_misses, 1);
  EXPECT_DOUBLE_EQ(states_.back().arm[0].joint_command_rad[0], newer.joint_position_rad[0]);
}

TEST_F(SimComponentTest, RealtimeReportsHowLateTicksWere) {
  SimOptions options;
  options.realtime = true;
  options.rtf = 1e6;  // 20 ns a tick: shorter than the physics takes
  MakeSim(options);
  Start();
  while (tick() < 20) {
    sim_->Poll(std::chrono::steady_clock::now());
    HandleAll();
  }
  Score(19, partial_metrics_t::SUCCESS);
  ASSERT_EQ(ends_.size(), 1u);
  EXPECT_EQ(ends_[0].late_ticks, 20);
  EXPECT_THAT(Logged(), testing::HasSubstr(" 20 late by a whole tick or more\n"));
  const time_distribution_t& error = ends_[0].pacing_error;
  EXPECT_EQ(error.count, 20);
  EXPECT_GT(error.p50_s, 20e-9);
  EXPECT_LE(error.p50_s, error.p99_s);
  EXPECT_EQ(error.p99_s, error.max_s);  // the largest of 20 values
  // The episode has one score and no action.
  EXPECT_EQ(ends_[0].partial_latency.count, 1);
  EXPECT_GT(ends_[0].partial_latency.max_s, 0);
  EXPECT_EQ(ends_[0].action_latency.count, 0);

  // The next episode is aborted before its first tick, so it has no times.
  Command(1);
  model_info_t other = model_;
  other.run_id = "another";
  bus_->Publish(channels::kModel, other);
  HandleAll();
  ASSERT_EQ(ends_.size(), 2u);
  EXPECT_EQ(ends_[1].end_reason, "aborted");
  EXPECT_EQ(ends_[1].late_ticks, 0);
  EXPECT_EQ(ends_[1].pacing_error.count, 0);
  EXPECT_EQ(ends_[1].partial_latency.count, 0);
}

TEST_F(SimComponentTest, APolicyThatReportsAnErrorEndsTheEpisode) {
  MakeSim();
  Start();
  component_status_t status{};
  status.component = "policy";
  status.state = component_status_t::FAILED;
  status.error = "out of memory";
  status.attempt = 1;  // another episode
  bus_->Publish(channels::kStatus, status);
  HandleAll();
  Act(Action(0));
  Score(0);
  EXPECT_EQ(tick(), 1);
  status.attempt = 0;
  bus_->Publish(channels::kStatus, status);
  HandleAll();
  EXPECT_TRUE(ends_.empty());  // the tick is scored first
  Score(1);
  ASSERT_EQ(ends_.size(), 1u);
  EXPECT_EQ(ends_[0].end_reason, "policy_error");
  EXPECT_EQ(ends_[0].detail, "out of memory");
}

TEST_F(SimComponentTest, AServersFaultEndsTheEpisodeWithServerError) {
  MakeSim();
  Start();
  action_t action = Action(0);
  action.error = "connection closed";
  action.is_server_error = true;
  Act(action);
  Score(0);
  ASSERT_EQ(ends_.size(), 1u);
  EXPECT_EQ(ends_[0].end_reason, "server_error");
  EXPECT_EQ(ends_[0].detail, "connection closed");
}

TEST_F(SimComponentTest, CountsWristPosesThatCouldNotBeReached) {
  MakeSim();
  Start();
  for (int64_t k = 0; k < 3; ++k) {
    action_t action = Action(k);
    action.unreachable_poses = k == 1 ? 0 : 2;
    action.singular_poses = 1;
    Act(action);
    Act(action);  // a repeated message
    Score(k);
  }
  EXPECT_EQ(states_.back().unreachable_poses, 4);
  EXPECT_EQ(states_.back().singular_poses, 3);
  Score(3, partial_metrics_t::SUCCESS);
  Start(1);
  EXPECT_EQ(states_.back().unreachable_poses + states_.back().singular_poses, 0);
}

SimOptions GoingOnFor(double after_success_s) {
  SimOptions options;
  options.after_success_s = after_success_s;
  return options;
}

TEST_F(SimComponentTest, ContinuesForAGivenTimeAfterASuccess) {
  std::vector<std::vector<double>> qpos[2];
  for (const int8_t verdict : {partial_metrics_t::UNDECIDED, partial_metrics_t::SUCCESS}) {
    MakeSim(GoingOnFor(0.1));
    states_.clear();
    ends_.clear();
    Start();
    for (int64_t k = 0; k <= 7; ++k) {
      action_t action = Action(k);
      action.joint_position_rad[0] = 0.02 * static_cast<double>(k);
      // The action arrives before the verdict, so the sim has already computed the physics of the next tick.
      Act(action);
      Score(k, k >= 2 ? verdict : int8_t{partial_metrics_t::UNDECIDED});
      ASSERT_EQ(ends_.size(), verdict == partial_metrics_t::SUCCESS && k == 7 ? 1u : 0u) << k;
      qpos[verdict == partial_metrics_t::SUCCESS].push_back(states_.back().qpos_mixed);
    }
  }
  EXPECT_EQ(ends_[0].end_reason, "success");
  EXPECT_EQ(ends_[0].detail, "");
  EXPECT_EQ(ends_[0].header.tick, 7);
  EXPECT_EQ(ends_[0].header.sim_time_us, 140'000);
  qpos[0].pop_back();
  qpos[1].pop_back();
  EXPECT_EQ(qpos[0], qpos[1]);
}

TEST_F(SimComponentTest, TheTimeLimitDoesNotCutWhatComesAfterASuccess) {
  std::vector<std::vector<double>> qpos[2];
  for (const int order : {0, 1}) {
    MakeSim(GoingOnFor(0.04));
    states_.clear();
    ends_.clear();
    Start();
    const int64_t last = model_.time_limit_us / 20000;
    for (int64_t k = 0; ends_.empty() && k < 2 * last; ++k) {
      action_t action = Action(k);
      action.joint_position_rad[0] = 0.001 * static_cast<double>(k);
      // The first success is at the very last tick.
      const int8_t verdict = k >= last ? partial_metrics_t::SUCCESS : partial_metrics_t::UNDECIDED;
      if (order == 0) Act(action);
      Score(k, verdict);
      if (order == 1 && ends_.empty()) Act(action);
      if (k >= last) qpos[order].push_back(states_.back().qpos_mixed);
    }
    ASSERT_EQ(ends_.size(), 1u);
    EXPECT_EQ(ends_[0].end_reason, "success");
    EXPECT_EQ(ends_[0].header.tick, last + 2);
  }
  EXPECT_EQ(qpos[0], qpos[1]);
  EXPECT_NE(qpos[0][0], qpos[0][1]);
}

TEST_F(SimComponentTest, WhatEndsAnEpisodeAfterItsSuccessDoesNotChangeItsVerdict) {
  const auto end = [this](const std::function<void()>& what) {
    SimOptions options = GoingOnFor(1);
    options.policy_timeout_s = 5;
    MakeSim(options);
    states_.clear();
    ends_.clear();
    Start();
    Act(Action(0));
    Score(0);
    Act(Action(1));
    Score(1, partial_metrics_t::SUCCESS);
    EXPECT_EQ(tick(), 2);
    Score(2, partial_metrics_t::SUCCESS);
    what();
    EXPECT_EQ(ends_.size(), 1u);
    return ends_.empty() ? "" : ends_[0].end_reason + " | " + ends_[0].detail;
  };
  action_t action{};
  EXPECT_EQ(end([&] {
              action = Action(2);
              action.error = "no such grasp";
              Act(action);
            }),
            "success | after the success: policy_error, no such grasp");
  EXPECT_EQ(end([&] {
              auto now = std::chrono::steady_clock::now();
              for (int i = 0; ends_.empty() && i < 100; ++i) {
                sim_->Poll(now += std::chrono::milliseconds(100));
                HandleAll();
              }
            }),
            "success | after the success: policy_timeout, no ACTION for tick 2 from policy within 5 s");
  EXPECT_EQ(end([&] {
              action.is_server_error = true;
              Act(action);
            }),
            "server_error | no such grasp");
  command_t stop{};
  stop.kind = command_t::STOP;
  EXPECT_EQ(end([&] {
              bus_->Publish(channels::kCommand, stop);
              HandleAll();
            }),
            "aborted | stopped on command");
}

TEST_F(SimComponentTest, RealtimeContinuesFromTheTickOfTheSuccess) {
  SimOptions options = GoingOnFor(0.1);
  options.realtime = true;
  MakeSim(options);
  Start();
  const auto play_to = [this](int64_t last) {
    while (ends_.empty() && tick() < last) {
      Act(Action(tick()));
      sim_->Poll(sim_->next_poll());
      HandleAll();
    }
  };
  play_to(4);
  Score(1, partial_metrics_t::UNDECIDED);
  Score(2, partial_metrics_t::SUCCESS);  // two ticks late
  Score(3, partial_metrics_t::SUCCESS);
  EXPECT_TRUE(ends_.empty());
  play_to(7);
  EXPECT_TRUE(ends_.empty());
  play_to(8);
  ASSERT_EQ(ends_.size(), 1u);
  EXPECT_EQ(ends_[0].end_reason, "success");
  EXPECT_EQ(ends_[0].header.tick, 7);

  // The success is reported only when the time after it has passed.
  ends_.clear();
  Start(1);
  play_to(9);
  Score(2, partial_metrics_t::SUCCESS);
  ASSERT_EQ(ends_.size(), 1u);
  EXPECT_EQ(ends_[0].end_reason, "success");
  EXPECT_EQ(ends_[0].header.tick, 9);
}

TEST_F(SimComponentTest, TheTimeAfterASuccessIsWholeTicks) {
  for (const auto& [s, us] :
       {std::pair(0.0, 0), {0.1, 100'000}, {0.3, 300'000}, {0.05, 60'000}, {0.001, 20'000}}) {
    MakeSim(GoingOnFor(s));
    Command(0);
    EXPECT_EQ(model_.after_success_us, us) << s;
  }
}

TEST_F(SimComponentTest, ControlRatesAreWholePhysicsSteps) {
  // 2.5 and 12.5 steps are rounded to the even number, as in Python's round() and therefore in RoboEval.
  for (const auto& [hz, substeps] :
       {std::pair{20.0, 25}, {40.0, 12}, {50.0, 10}, {200.0, 2}, {334.0, 1}, {500.0, 1}}) {
    SimOptions options;
    options.control_hz = hz;
    MakeSim(options);
    Command(0);
    EXPECT_EQ(model_.substeps, substeps) << hz;
  }
}

TEST_F(SimComponentTest, RefusesWrongOptions) {
  const auto with = [](auto change) {
    SimOptions options;
    change(&options);
    return options;
  };
  EXPECT_THROW(MakeSim(with([](SimOptions* o) { o->control_hz = 4; })), InputError);
  EXPECT_THROW(MakeSim(with([](SimOptions* o) { o->control_hz = 1000; })), InputError);
  EXPECT_THROW(MakeSim(with([](SimOptions* o) { o->rtf = 0; })), InputError);
  EXPECT_THROW(MakeSim(with([](SimOptions* o) { o->after_success_s = -1; })), InputError);
  EXPECT_THROW(MakeSim(with([](SimOptions* o) {
                 o->seed_stream = kRoboEvalSeeds;
                 o->seed = -1;
                 o->episodes = 1;
               })),
               InputError);
  EXPECT_THROW(MakeSim(with([](SimOptions* o) { o->task = "lift_pan"; })), InputError);
  EXPECT_THROW(MakeSim(with([](SimOptions* o) { o->task = "lift_pot/sideways"; })), InputError);
  EXPECT_THROW(MakeSim(with([](SimOptions* o) { o->robot = "/no/such/robot.yaml"; })), InputError);
}

TEST_F(SimComponentTest, InventedNamesDoNotFillTheMemory) {
  MakeSim();
  for (int i = 0; i < 1000; ++i) Status("component_" + std::to_string(i), 0);
  EXPECT_EQ(sim_->status().foreign_messages, 900);
  Start();
  EXPECT_EQ(states_.size(), 1u);
}

TEST_F(SimComponentTest, TwoActionsForATickEndTheEpisode) {
  MakeSim();
  Start();
  Act(Action(0));
  Score(0);
  Act(Action(1));
  Score(1);
  action_t other = Action(0);  // a tick in the past
  other.gripper_closing = {1, 1};
  Act(other);
  ASSERT_EQ(ends_.size(), 1u);
  EXPECT_EQ(ends_[0].end_reason, "aborted");
  EXPECT_EQ(ends_[0].detail, "two different actions for tick 0: is a second policy on this bus?");
  EXPECT_THAT(Logged(),
              testing::HasSubstr("[warning] sim  e0 t2  ends, aborted: two different actions for tick 0"));
}

TEST_F(SimComponentTest, WarningsOfMuJoCoStandInItsLog) {
  MakeSim();
  Start();
  mju_warning("joint 3 went astray");
  EXPECT_THAT(Logged(), testing::HasSubstr("[warning] sim  e0 t0  MuJoCo: joint 3 went astray\n"));
}

TEST_F(SimComponentTest, TwoScoresForATickEndTheEpisode) {
  MakeSim();
  Start();
  Score(0);
  Score(0, partial_metrics_t::SUCCESS);
  ASSERT_EQ(ends_.size(), 1u);
  EXPECT_EQ(ends_[0].end_reason, "aborted");
  EXPECT_NE(ends_[0].detail.find("EVALBUS_PARTIAL for tick 0"), std::string::npos) << ends_[0].detail;
}

TEST_F(SimComponentTest, TwoProcessesOfOneNameEndTheEpisode) {
  MakeSim();
  Start();
  component_status_t status{};
  status.component = "policy";
  status.state = component_status_t::READY;
  status.instance = 1;  // the component that is ready reported instance 0
  bus_->Publish(channels::kStatus, status);
  HandleAll();
  ASSERT_EQ(ends_.size(), 1u);
  EXPECT_EQ(ends_[0].end_reason, "aborted");
  EXPECT_EQ(ends_[0].detail, "two processes on this bus claim to be the policy");
}

TEST_F(SimComponentTest, AForeignEndBeforeTickZeroAbortsTheEpisode) {
  MakeSim();
  Command(0);
  ASSERT_TRUE(states_.empty());
  episode_end_t end{};
  end.end_reason = "success";
  bus_->Publish(channels::kEpisodeEnd, end);
  HandleAll();
  ASSERT_EQ(ends_.size(), 2u);
  EXPECT_EQ(ends_[1].end_reason, "aborted");
  // The next attempt receives the sim's own EPISODE_END late.
  Command(0, 1);
  bus_->Publish(channels::kEpisodeEnd, ends_[1]);
  HandleAll();
  EXPECT_EQ(ends_.size(), 3u);
}

TEST_F(SimComponentTest, ForgedMessagesOfASimEndTheEpisode) {
  MakeSim();
  for (int32_t episode = 0; episode < 3; ++episode) {
    Start(episode);
    ASSERT_EQ(states_.back().header.episode, episode);
    episode_begin_t begin{};
    begin.header.episode = 77;
    episode_end_t end{};
    end.header.episode = episode;
    model_info_t model = model_;
    model.run_id = "another";
    if (episode == 0) bus_->Publish(channels::kEpisodeBegin, begin);
    if (episode == 1) bus_->Publish(channels::kEpisodeEnd, end);
    if (episode == 2) bus_->Publish(channels::kModel, model);
    HandleAll();
    ASSERT_FALSE(ends_.empty());
    EXPECT_EQ(ends_.back().header.episode, episode);
    EXPECT_EQ(ends_.back().end_reason, "aborted");
    EXPECT_NE(ends_.back().detail.find("not this sim's"), std::string::npos) << ends_.back().detail;
  }
}

}  // namespace evalbus::sim::sim_component_test
