// Tests the metrics component on an in-process bus.
#include "metrics/metrics_component.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numeric>
#include <random>

#include "base/errors.h"
#include "bus/channels.h"
#include "evalbus/run_summary_t.hpp"
#include "metrics/episode/part_of_run.h"
#include "metrics/episode/result_json.h"
#include "tests/unit/poll_for.h"
#include "tests/unit/small_world.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::metrics::metrics_component_test {

using namespace small_world;

class MetricsComponentTest : public testing::Test {
 protected:
  MetricsComponentTest() {
    bus_.Subscribe(channels::kPartial, [this](const auto& m) { partials_.push_back(m); });
    bus_.Subscribe(channels::kEpisodeSummary, [this](const auto& m) { summaries_.push_back(m); });
    bus_.Subscribe(channels::kRunSummary, [this](const auto& m) { runs_.push_back(m); });
    bus_.Subscribe(channels::kStatus, [this](const auto& m) { said_ = m; });
  }

  void Drain() {
    while (bus_.Handle()) {
    }
  }
  void Begin(int32_t episode, int32_t attempt = 0, bool with_model = true) {
    if (with_model) bus_.Publish(channels::kModel, model_);
    episode_begin_t begin{};
    begin.header = Header(0, episode);
    begin.seed = 1000 + episode;
    begin.header.attempt = attempt_ = attempt;
    bus_.Publish(channels::kEpisodeBegin, begin);
    Drain();
  }
  void SendState(int64_t tick, int32_t episode, double pot_z = 1) {
    state_t state = State(tick, episode);
    state.body[kPot].position_m[2] = pot_z;
    state.header.attempt = attempt_;
    bus_.Publish(channels::kState, state);
    Drain();
  }
  void SendContacts(int64_t tick, int32_t episode,
                    const std::vector<std::pair<int, int>>& pairs = {{kTop, kWall}}) {
    contacts_t contacts = Contacts(tick, pairs, episode);
    contacts.header.attempt = attempt_;
    bus_.Publish(channels::kContacts, contacts);
    Drain();
  }
  void End(int64_t tick, int32_t episode, const std::string& reason = "time_limit") {
    episode_end_t end{};
    end.header = Header(tick, episode);
    end.header.attempt = attempt_;
    end.end_reason = reason;
    bus_.Publish(channels::kEpisodeEnd, end);
    Drain();
  }

  Bus bus_{"memq://"};
  MetricsComponent dut_{&bus_};
  model_info_t model_ = Model();
  std::vector<partial_metrics_t> partials_;
  std::vector<episode_summary_t> summaries_;
  std::vector<run_summary_t> runs_;
  component_status_t said_{};
  // Attempt of the most recent episode, to which sent messages belong.
  int32_t attempt_ = 0;
};

TEST_F(MetricsComponentTest, ScoresTwoEpisodes) {
  Begin(0);
  EXPECT_EQ(said_.state, component_status_t::READY);
  EXPECT_EQ(said_.episode, 0);
  SendState(0, 0);
  EXPECT_TRUE(partials_.empty());
  SendContacts(0, 0);
  ASSERT_EQ(partials_.size(), 1);
  EXPECT_EQ(partials_[0].header.tick, 0);
  SendContacts(1, 0, {});
  SendState(1, 0, 1.2);
  ASSERT_EQ(partials_.size(), 2);
  EXPECT_EQ(partials_[1].verdict, partial_metrics_t::SUCCESS);
  EXPECT_TRUE(summaries_.empty());
  End(1, 0, "success");
  ASSERT_EQ(summaries_.size(), 1);
  EXPECT_TRUE(summaries_[0].complete);
  EXPECT_EQ(summaries_[0].seed, 1000);
  ASSERT_EQ(runs_.size(), 1);
  EXPECT_EQ(runs_[0].num_success, 1);
  EXPECT_EQ(said_.last_finished_episode, 0);

  Begin(1);
  EXPECT_EQ(said_.state, component_status_t::READY);
  SendState(0, 1);
  SendContacts(0, 1);
  End(0, 1);
  ASSERT_EQ(runs_.size(), 2);
  EXPECT_EQ(summaries_[1].failure_reason, "timeout");
  EXPECT_EQ(runs_[1].num_episodes, 2);
  EXPECT_EQ(runs_[1].num_complete, 2);
  EXPECT_EQ(runs_[1].success_rate, 0.5);
  EXPECT_NE(std::find(runs_[1].metric_name.begin(), runs_[1].metric_name.end(), "cartesian_path_length.left"),
            runs_[1].metric_name.end());
  EXPECT_NE(std::find(runs_[1].metric_name.begin(), runs_[1].metric_name.end(), "extended.contact_time_s"),
            runs_[1].metric_name.end());
}

TEST_F(MetricsComponentTest, CriteriaArePublishedPeriodicallyAndAtTheLastTick) {
  std::vector<criteria_t> said;
  bus_.Subscribe(channels::kCriteria, [&](const criteria_t& m) { said.push_back(m); });
  for (int32_t episode = 0; episode < 2; ++episode) {
    said.clear();
    Begin(episode);
    // Criteria are published at every third tick of 20 ms, at the verdict's tick, at which the pot is lifted,
    // and at every later tick.
    for (int64_t tick = 0; tick <= 8; ++tick) {
      SendState(tick, episode, tick >= 7 ? 1.2 : 1);
      SendContacts(tick, episode, {});
    }
    End(8, episode, "success");
    std::vector<int64_t> ticks;
    for (const criteria_t& criteria : said) ticks.push_back(criteria.header.tick);
    EXPECT_EQ(ticks, (std::vector<int64_t>{0, 3, 6, 7, 8}));
    ASSERT_EQ(said.size(), 5u);
    EXPECT_TRUE(std::isnan(said[0].success[1].value_mixed));
    EXPECT_EQ(said[2].success[1].value_mixed, 1);
    EXPECT_FALSE(said[2].success[1].holds);
    EXPECT_TRUE(said[3].success[1].holds);
    EXPECT_EQ(said[3].header.episode, episode);
  }
}

TEST_F(MetricsComponentTest, TheOrderOfArrivalChangesNoBit) {
  constexpr int kTicks = 40;
  // The messages of an episode with every kind of event arrive in several orders: chronological, contacts
  // first, reversed and shuffled. The end arrives early or last.
  const auto send = [&](int message) {
    const int tick = message / 2;
    if (message % 2 == 0) {
      state_t state = State(tick);
      for (int k = 0; k < 2; ++k) {
        state.arm[k].wrist_position_m[0] = std::sin(0.3 * tick + k);
        state.arm[k].joint_position_rad[0] = std::cos(0.2 * tick);
        state.arm[k].joint_velocity_radps[0] = std::sin(0.1 * tick + k);
        state.arm[k].mechanical_work_J = tick;
      }
      state.header.attempt = attempt_;
      bus_.Publish(channels::kState, state);
    } else {
      contacts_t contacts =
          Contacts(tick, tick % 7 < 3   ? std::vector<std::pair<int, int>>{{kLeftPad, kWall}}
                         : tick % 7 < 5 ? std::vector<std::pair<int, int>>{{kLeftLink, kTop}}
                                        : std::vector<std::pair<int, int>>{});
      contacts.header.attempt = attempt_;
      contacts.has_clearance = tick % 5 == 0;
      contacts.clearance_m = 0.1 + 0.01 * (tick % 3);
      bus_.Publish(channels::kContacts, contacts);
    }
    Drain();
  };
  std::vector<int> order(2 * kTicks);
  std::iota(order.begin(), order.end(), 0);
  std::mt19937 random(1);
  for (int attempt = 0; attempt < 6; ++attempt) {
    if (attempt == 1) {
      for (int tick = 0; tick < kTicks; ++tick) std::swap(order[2 * tick], order[2 * tick + 1]);
    }
    if (attempt == 2) std::reverse(order.begin(), order.end());
    if (attempt > 2) std::shuffle(order.begin(), order.end(), random);
    partials_.clear();
    Begin(0, attempt);
    for (size_t k = 0; k < order.size(); ++k) {
      if (attempt % 2 == 1 && k == 11) End(kTicks - 1, 0);
      send(order[k]);
    }
    if (attempt % 2 == 0) End(kTicks - 1, 0);
    ASSERT_EQ(summaries_.size(), static_cast<size_t>(attempt) + 1);
    episode_summary_t& summary = summaries_.back();
    EXPECT_TRUE(summary.complete);
    EXPECT_GT(summary.metrics.slip_count, 0);
    // The summary equals the live values of the last tick, except for metrics that need the whole
    // episode.
    ASSERT_EQ(partials_.size(), static_cast<size_t>(kTicks));
    EXPECT_EQ(ResultJson(partials_.back().metrics), ResultJson(summary.metrics));
    auto live = ExtendedJson(partials_.back().extended, partials_.back().metrics);
    auto last = ExtendedJson(summary.extended, summary.metrics);
    EXPECT_TRUE(live["spectral_arc_length"]["left"].is_null());
    EXPECT_TRUE(last["spectral_arc_length"]["left"].is_number());
    live.erase("spectral_arc_length");
    last.erase("spectral_arc_length");
    EXPECT_EQ(live, last);
    summary.header.attempt = 0;
    EXPECT_EQ(Encode(summary), Encode(summaries_.front())) << "attempt " << attempt;
  }
}

TEST_F(MetricsComponentTest, IsNotReadyWithoutAModel) {
  Begin(0, 0, false);
  EXPECT_EQ(dut_.status().state, component_status_t::IDLE);
  Begin(0, 0, true);
  EXPECT_EQ(dut_.status().state, component_status_t::READY);
}

TEST_F(MetricsComponentTest, ARepeatedModelChangesNothing) {
  Begin(0);
  SendState(0, 0);
  SendContacts(0, 0);
  bus_.Publish(channels::kModel, model_);
  SendState(1, 0);
  bus_.Publish(channels::kModel, model_);
  SendContacts(1, 0);
  ASSERT_EQ(partials_.size(), 2);
  EXPECT_EQ(partials_[1].metrics.num_samples, 1);
  EXPECT_EQ(said_.foreign_messages, 0);
}

TEST_F(MetricsComponentTest, RepeatsTheRunSummaryForLateComponents) {
  const auto now = std::chrono::steady_clock::now();
  dut_.Poll(now);
  Begin(0);
  SendState(0, 0);
  SendContacts(0, 0);
  Drain();
  EXPECT_EQ(runs_.size(), 0);
  End(0, 0);
  ASSERT_EQ(runs_.size(), 1);
  dut_.Poll(now + std::chrono::milliseconds(500));
  Drain();
  EXPECT_EQ(runs_.size(), 1);
  dut_.Poll(now + std::chrono::milliseconds(1600));
  Drain();
  ASSERT_EQ(runs_.size(), 2);
  EXPECT_EQ(runs_[1].num_episodes, 1);
  EXPECT_EQ(summaries_.size(), 1);
}

TEST_F(MetricsComponentTest, TheRunSummaryIsMarkedAsPartial) {
  const auto finish = [&](int episode) {
    Begin(episode);
    SendState(0, episode);
    SendContacts(0, episode);
    End(0, episode);
  };
  finish(0);
  ASSERT_EQ(runs_.size(), 1);
  EXPECT_FALSE(runs_.back().is_part);
  // Another process, possibly an earlier one, has finished episode 1.
  finish(2);
  EXPECT_TRUE(runs_.back().is_part);
  finish(1);
  EXPECT_FALSE(runs_.back().is_part);
  EXPECT_EQ(runs_.back().num_episodes, 3);
}

// The run folder shows it before any message has arrived.
TEST(PartOfRun, IsWhereOthersHaveFinishedOrWork) {
  const TemporaryFolder folder;
  EXPECT_FALSE(IsPartOfRun(folder.path()));
  std::ofstream(folder.path() / "run.json") << R"({"workers": 1})";
  EXPECT_FALSE(IsPartOfRun(folder.path()));
  std::ofstream(folder.path() / "episodes.jsonl");
  EXPECT_FALSE(IsPartOfRun(folder.path()));
  std::ofstream(folder.path() / "episodes.jsonl") << "{}\n";
  EXPECT_TRUE(IsPartOfRun(folder.path()));
  std::filesystem::remove(folder.path() / "episodes.jsonl");
  std::ofstream(folder.path() / "run.json") << R"({"workers": 2})";
  EXPECT_TRUE(IsPartOfRun(folder.path()));
}

TEST_F(MetricsComponentTest, ARepeatedBeginChangesNothing) {
  Begin(0);
  SendState(0, 0);
  Begin(0);
  SendContacts(0, 0);
  EXPECT_EQ(partials_.size(), 1);
}

TEST_F(MetricsComponentTest, ANewAttemptBeginsAgainAndReplacesTheOldResult) {
  Begin(0);
  SendState(0, 0);
  SendContacts(0, 0);
  SendState(1, 0);
  Begin(0, 1);
  SendState(0, 0);
  SendContacts(0, 0);
  End(0, 0);
  ASSERT_EQ(summaries_.size(), 1);
  EXPECT_EQ(summaries_[0].header.attempt, 1);
  EXPECT_TRUE(summaries_[0].complete);
  Begin(0, 2);
  SendState(0, 0);
  SendContacts(0, 0);
  End(0, 0);
  EXPECT_EQ(runs_.back().num_episodes, 1);
}

TEST_F(MetricsComponentTest, CountsForeignMessagesAndDuplicates) {
  SendState(0, 0);
  SendContacts(3, 7);
  End(0, 0);
  EXPECT_EQ(dut_.status().foreign_messages, 3);
  Begin(0);
  SendState(0, 0);
  SendState(0, 0);   // duplicate
  SendState(0, 1);   // another episode
  SendState(-5, 0);  // there is no tick with this number
  EXPECT_EQ(dut_.status().foreign_messages, 6);
  SendContacts(0, 0);
  End(0, 0);
  End(0, 0);
  EXPECT_EQ(dut_.status().foreign_messages, 7);
  ASSERT_EQ(summaries_.size(), 2);  // a repetition
  EXPECT_TRUE(summaries_[0].complete);
}

TEST_F(MetricsComponentTest, WaitsABoundedTimeForTheLastTicks) {
  Begin(0);
  for (int64_t tick : {0, 1, 3, 4}) {
    SendState(tick, 0);
    SendContacts(tick, 0);
  }
  EXPECT_EQ(partials_.size(), 2);
  End(5, 0);
  auto now = PollFor(&dut_, std::chrono::steady_clock::now(), MetricsComponent::kMaxWait / 2);
  Drain();
  EXPECT_TRUE(summaries_.empty());
  SendState(5, 0);
  SendContacts(5, 0);
  EXPECT_TRUE(summaries_.empty());
  now = PollFor(&dut_, now, MetricsComponent::kMaxWait);
  Drain();
  ASSERT_EQ(summaries_.size(), 1);
  EXPECT_EQ(partials_.size(), 5);
  EXPECT_EQ(summaries_[0].extended.missing_ticks, 1);
  EXPECT_FALSE(summaries_[0].complete);
  EXPECT_EQ(runs_[0].num_complete, 0);
  EXPECT_EQ(dut_.status().missing_ticks, 1);

  // The count of the process continues, and the count of the episode restarts.
  Begin(1);
  End(0, 1);
  PollFor(&dut_, now, 2 * MetricsComponent::kMaxWait);
  Drain();
  ASSERT_EQ(summaries_.size(), 2);
  EXPECT_EQ(summaries_[1].extended.missing_ticks, 1);
  EXPECT_EQ(dut_.status().missing_ticks, 2);
}

TEST_F(MetricsComponentTest, AnEndThatIsRepeatedIsAnsweredAgain) {
  Begin(0);
  SendState(0, 0);
  SendContacts(0, 0);
  End(0, 0);
  End(0, 0);
  ASSERT_EQ(summaries_.size(), 2);
  EXPECT_EQ(summaries_[1].metrics.num_samples, summaries_[0].metrics.num_samples);
  EXPECT_EQ(runs_.back().num_episodes, 1);
  Begin(1);
  End(0, 0);
  EXPECT_EQ(summaries_.size(), 2);
}

TEST_F(MetricsComponentTest, WaitsForTicksThatComeAfterTheEnd) {
  Begin(0);
  SendState(0, 0);
  End(0, 0, "unstable");
  EXPECT_TRUE(summaries_.empty());
  SendContacts(0, 0);
  ASSERT_EQ(summaries_.size(), 1);
  EXPECT_TRUE(summaries_[0].complete);
  EXPECT_EQ(summaries_[0].failure_reason, "unstable");
}

TEST_F(MetricsComponentTest, ABadTaskIsAnInputErrorWithTheLine) {
  std::string& yaml = model_.task_yaml;
  yaml.replace(yaml.find("object: pot}}"), 13, "object: pan}}");
  try {
    Begin(0);
    FAIL() << "accepted";
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()).rfind("small.yaml:20: nothing has the name 'pan'", 0), 0)
        << error.what();
  }
}

TEST_F(MetricsComponentTest, TakesTheNewModelOfANewRun) {
  Begin(0);
  model_.num_objects = 0;
  model_.object_name.clear();
  model_.object_entity.clear();
  model_.object_is_tracked.clear();
  Begin(1);
  SendState(0, 1);
  SendContacts(0, 1);
  ASSERT_EQ(partials_.size(), 1);
  EXPECT_EQ(partials_[0].metrics.num_objects, 0);
}

TEST_F(MetricsComponentTest, TwoStatesOfATickMakeTheEpisodeAborted) {
  for (const bool ours_first : {true, false}) {
    const int32_t episode = ours_first ? 0 : 1;
    Begin(episode);
    SendState(0, episode);
    SendContacts(0, episode);
    SendState(1, episode, ours_first ? 1 : 1.2);
    SendContacts(1, episode);
    SendState(1, episode, ours_first ? 1.2 : 1);
    End(1, episode);
    ASSERT_EQ(summaries_.size(), ours_first ? 1 : 2);
    EXPECT_FALSE(summaries_.back().complete);
    EXPECT_EQ(summaries_.back().end_reason, "aborted");
    EXPECT_EQ(summaries_.back().end_detail,
              "two different messages on EVALBUS_STATE for tick 1: is a second publisher on this bus?");
  }
}

TEST_F(MetricsComponentTest, TwoContactsOrEndsMakeTheEpisodeAborted) {
  Begin(0);
  SendState(0, 0);
  SendContacts(0, 0);
  SendContacts(0, 0, {});
  End(0, 0);
  EXPECT_EQ(summaries_.back().end_reason, "aborted");
  Begin(1);
  SendState(0, 1);
  End(1, 1);
  End(0, 1, "policy_error");
  ASSERT_EQ(summaries_.size(), 2);
  EXPECT_EQ(summaries_.back().end_reason, "aborted");
  EXPECT_NE(summaries_.back().end_detail.find("EVALBUS_EPISODE_END"), std::string::npos);
}

TEST_F(MetricsComponentTest, AnEndThatIsNotTheVerdictsIsAborted) {
  model_.clock = "lockstep";
  const auto play = [&](bool lifted, const std::string& end_reason) {
    const auto episode = static_cast<int32_t>(summaries_.size());
    Begin(episode);
    SendState(0, episode);
    SendContacts(0, episode);
    SendState(1, episode, lifted ? 1.2 : 1);
    SendContacts(1, episode, {});
    End(1, episode, end_reason);
    return summaries_.back();
  };
  EXPECT_TRUE(play(true, "success").complete);
  EXPECT_TRUE(play(false, "time_limit").complete);
  EXPECT_TRUE(play(false, "policy_error").complete);
  // The server failed while the episode continued after its success.
  for (const bool succeeds : {false, true})
    EXPECT_EQ(play(succeeds, "server_error").end_reason, "server_error");
  for (const auto& [lifted, end_reason] : {std::pair(false, "success"), std::pair(false, "failure"),
                                           std::pair(true, "time_limit"), std::pair(true, "failure")}) {
    const episode_summary_t summary = play(lifted, end_reason);
    EXPECT_FALSE(summary.complete) << end_reason;
    EXPECT_EQ(summary.end_reason, "aborted");
    EXPECT_EQ(summary.end_detail, std::string("the sim ended the episode with ") + end_reason +
                                      ", but the verdict was " + (lifted ? "success" : "undecided") +
                                      ": is a second metrics process on this bus?");
  }
  // In real time, a verdict counts whenever it arrives.
  model_.clock = "realtime";
  EXPECT_EQ(play(true, "time_limit").end_reason, "time_limit");
}

TEST_F(MetricsComponentTest, NamesOfFilesInModelAreTextOnly) {
  const TemporaryFolder folder;
  // Opening the pipe would wait for a writer.
  const std::string pipe = folder.path() / "pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const std::string robot = "robot.yaml";
  const size_t at = model_.task_yaml.find(robot);
  ASSERT_NE(at, std::string::npos);
  int32_t episode = 0;
  for (const std::string& name :
       {pipe, std::string("/dev/zero"), std::string("../../../etc/passwd"), std::string(5000, 'x')}) {
    model_.task_file = model_.physics_file = model_.visual_file = model_.run_id = model_.robot = name;
    model_.task_yaml = std::string(kTask).replace(at, robot.size(), name);
    Begin(episode++);
    EXPECT_EQ(said_.state, component_status_t::READY) << name;
    EXPECT_EQ(said_.episode, episode - 1);
  }
  model_.task_file.clear();
  EXPECT_NO_THROW(Begin(episode));
}

TEST_F(MetricsComponentTest, RepeatsAScoreWhenItsStateIsRepeated) {
  Begin(0);
  SendState(0, 0);
  SendContacts(0, 0);
  SendState(0, 0);
  ASSERT_EQ(partials_.size(), 2);
  EXPECT_EQ(partials_[1].header.tick, 0);
  End(0, 0);
  EXPECT_TRUE(summaries_.back().complete);
}

TEST_F(MetricsComponentTest, TicksFarAheadAreNotKept) {
  Begin(0);
  SendState(0, 0);
  SendContacts(0, 0);
  for (const int64_t tick : {TickMerger::kMaxAhead + 1, int64_t{1} << 62}) {
    SendState(tick, 0);
    SendContacts(tick, 0);
  }
  EXPECT_EQ(dut_.status().foreign_messages, 4);
  End(0, 0);
  EXPECT_TRUE(summaries_.back().complete);
}

}  // namespace evalbus::metrics::metrics_component_test
