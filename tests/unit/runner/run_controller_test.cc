// Tests the launcher's view of a run with orders of messages that are rare with real processes.
#include "runner/run_controller.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/errors.h"
#include "base/random.h"
#include "base/run_layout.h"
#include "tests/unit/poll_for.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::runner::run_controller_test {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class Listener : public RunListener {
 public:
  void OnEpisodeDone(const nlohmann::ordered_json& episode) override { done.push_back(episode); }
  void OnRemark(const std::string& text) override { remarks.push_back(text); }

  std::vector<nlohmann::ordered_json> done;
  std::vector<std::string> remarks;
};

class RunControllerTest : public testing::Test {
 protected:
  RunControllerTest() {
    Log::SetFiles([this](const std::string& name) { return folder_.path() / (name + ".log"); });
    plan_.episodes = {0, 1};
    plan_.required = {"metrics", "recorder"};
    plan_.model_hashes = ModelHashes::Of({});
    bus_.Subscribe(channels::kCommand, [this](const command_t& command) { commands_.push_back(command); });
  }
  ~RunControllerTest() override { Log::SetFiles({}); }

  RunController& Dut() {
    if (!dut_) dut_.emplace(&bus_, plan_, run_, &listener_);
    return *dut_;
  }
  void HandleAll() {
    while (bus_.Handle()) {
    }
  }
  template <class Message>
  void Publish(const Channel<Message>& channel, const Message& message) {
    Dut();
    bus_.Publish(channel, message);
    HandleAll();
  }

  header_t Header(int attempt) const { return {0, episode_, attempt, 5, 100000}; }
  int64_t Seed() const { return plan_.seeds().OfEpisode(episode_); }
  model_info_t Model() const {
    model_info_t model{};
    model.physics_file = (run_.path() / kModelFolder / kPhysicsModel).string();
    model.task_file = "pot.yaml";
    return model;
  }
  void PublishModel(const std::string& file = "") {
    model_info_t model = Model();
    if (!file.empty()) model.physics_file = file;
    Publish(channels::kModel, model);
  }
  void PublishBegin(int attempt = 0) {
    episode_begin_t begin{};
    begin.header = {0, episode_, attempt, 0, 0};
    begin.seed = Seed();
    Publish(channels::kEpisodeBegin, begin);
  }
  void Begin(int attempt = 0) {
    PublishModel();
    PublishBegin(attempt);
  }
  void PublishEnd(int attempt = 0, const std::string& reason = "success", const std::string& detail = "") {
    episode_end_t end{};
    end.header = Header(attempt);
    end.end_reason = reason;
    end.detail = detail;
    Publish(channels::kEpisodeEnd, end);
  }
  void PublishSummary(int attempt = 0, int64_t slips = 0, const std::string& reason = "success",
                      const std::string& detail = "") {
    episode_summary_t summary{};
    summary.header = Header(attempt);
    summary.seed = Seed();
    summary.end_reason = reason;
    summary.end_detail = detail;
    summary.complete = reason == "success";
    summary.metrics.slip_count = slips;
    summary.metrics.completion_time_s = 0.1;
    Publish(channels::kEpisodeSummary, summary);
  }
  void PublishFinished(const std::string& component, int attempt = 0) {
    component_status_t status{};
    status.component = component;
    status.episode = status.last_finished_episode = episode_;
    status.attempt = attempt;
    Publish(channels::kStatus, status);
  }
  SteadyTime In(seconds time) { return std::chrono::steady_clock::now() + time; }

  TemporaryFolder folder_;
  const results::RunFolder run_ = results::RunFolder::OfWorker(folder_.path());
  RunPlan plan_;
  Listener listener_;
  static constexpr int64_t kSession = 7;
  Bus bus_{"memq://", kSession};
  std::optional<RunController> dut_;
  std::vector<command_t> commands_;
  int episode_ = 0;
};

// The new sim receives the command immediately, not half a second later with the next repetition.
TEST_F(RunControllerTest, ANewSimReceivesTheCommand) {
  component_status_t status{};
  status.component = "sim";
  status.episode = status.last_finished_episode = -1;
  status.instance = 3;
  Publish(channels::kStatus, status);
  ASSERT_EQ(commands_.size(), 1u);
  EXPECT_EQ(commands_[0].kind, command_t::START_EPISODE);
  EXPECT_EQ(commands_[0].episode, 0);
  Publish(channels::kStatus, status);
  EXPECT_EQ(commands_.size(), 1u);
  status.instance = 4;
  Publish(channels::kStatus, status);
  EXPECT_EQ(commands_.size(), 2u);
  Begin();
  status.instance = 5;
  Publish(channels::kStatus, status);
  EXPECT_EQ(commands_.size(), 2u);
}

TEST_F(RunControllerTest, AnEpisodeIsDoneInWhateverOrderItsEndIsReceived) {
  const std::function<void()> parts[] = {[this] { PublishEnd(); }, [this] { PublishSummary(); },
                                         [this] { PublishFinished("sim"); },
                                         [this] { PublishFinished("recorder"); }};
  // The recorder closes its log after it has received EPISODE_END, so EPISODE_END is always sent earlier.
  for (std::vector<int> order : {std::vector{0, 1, 2, 3},
                                 {0, 1, 3, 2},
                                 {0, 3, 1, 2},
                                 {1, 0, 3, 2},
                                 {1, 2, 0, 3},
                                 {2, 1, 3, 0},
                                 {2, 3, 0, 1},
                                 {1, 2, 3, 0},
                                 {0, 2, 3, 1}}) {
    listener_.done.clear();
    dut_.reset();
    std::filesystem::remove_all(run_.path() / kEpisodesFolder);
    Begin();
    for (const int part : order) parts[part]();
    EXPECT_EQ(listener_.done.size(), 1u) << testing::PrintToString(order);
    EXPECT_THAT(listener_.remarks, IsEmpty()) << testing::PrintToString(order);
  }
}

TEST_F(RunControllerTest, GoesThroughItsPlan) {
  for (episode_ = 0; episode_ < 2; ++episode_) {
    EXPECT_FALSE(Dut().done());
    Begin();
    PublishEnd();
    PublishSummary();
    PublishFinished("recorder");
  }
  EXPECT_TRUE(Dut().done());
  ASSERT_EQ(commands_.size(), 1u);  // the command of episode 0 is sent only when the launcher polls
  EXPECT_EQ(commands_[0].episode, 1);
  EXPECT_EQ(results::EpisodeLines(run_.path() / kEpisodesJsonl).Next().size(), 2u);
}

TEST_F(RunControllerTest, RepeatsTheCommandUntilTheEpisodeBegins) {
  Dut().Poll(In(seconds(0)));
  Dut().Poll(In(seconds(1)));
  HandleAll();
  ASSERT_EQ(commands_.size(), 2u);
  EXPECT_EQ(commands_[1].seed, plan_.seeds().OfEpisode(0));
  EXPECT_THAT(commands_[1].required_component, ElementsAre("metrics", "recorder"));
  Begin();
  Dut().Poll(In(seconds(2)));
  HandleAll();
  EXPECT_EQ(commands_.size(), 2u);
}

TEST_F(RunControllerTest, AnAbortedEpisodeIsBegunAgain) {
  Begin();
  PublishEnd(0, "aborted", "two different actions for tick 3");
  EXPECT_THAT(listener_.remarks, ElementsAre("      0  retrying: two different actions for tick 3"));
  Dut().Poll(In(seconds(1)));
  HandleAll();
  EXPECT_EQ(commands_.back().attempt, 1);
  Begin(1);
  PublishEnd(1);
  PublishSummary(1);
  PublishFinished("recorder", 1);
  EXPECT_EQ(listener_.done.size(), 1u);
}

TEST_F(RunControllerTest, LateMessagesOfAnEarlierAttemptAreIgnored) {
  Begin();
  PublishEnd(0, "aborted", "lost");
  Begin(1);
  PublishEnd(0, "success");
  PublishSummary(0, 99);
  PublishFinished("recorder", 0);
  EXPECT_THAT(listener_.done, IsEmpty());
  PublishEnd(1);
  PublishSummary(1, 2);
  PublishFinished("recorder", 1);
  ASSERT_EQ(listener_.done.size(), 1u);
  EXPECT_EQ(listener_.done[0]["metrics"]["slip_count"], 2);
}

TEST_F(RunControllerTest, NothingOfAnAttemptIsLeftInTheNext) {
  // Attempt 0 has a summary and then aborts. Its summary must not count for attempt 1.
  Begin();
  PublishSummary();
  PublishEnd(0, "aborted", "lost");
  PublishModel();
  PublishBegin(1);
  PublishFinished("sim", 1);
  EXPECT_THAT(listener_.done, IsEmpty());
  PublishFinished("recorder", 1);
  EXPECT_THAT(listener_.done, IsEmpty()) << "scored with the summary of the attempt before";
  PublishSummary(1);
  EXPECT_EQ(listener_.done.size(), 1u);
}

TEST_F(RunControllerTest, GivesUpAfterThreeAttempts) {
  for (int attempt = 0; attempt < 2; ++attempt) {
    Begin(attempt);
    PublishEnd(attempt, "aborted", "lost");
  }
  Begin(2);
  try {
    PublishEnd(2, "aborted", "lost again");
    FAIL();
  } catch (const EnvironmentError& error) {
    EXPECT_STREQ(error.what(), "episode 0 failed 3 times, the last time: lost again");
  }
}

TEST_F(RunControllerTest, AServersFaultBeginsTheEpisodeAgainFromItsSeed) {
  Begin();
  PublishEnd(0, "server_error", "connection closed");
  EXPECT_THAT(listener_.remarks,
              ElementsAre("      0  retrying: the policy's server failed: connection closed"));
  Dut().Poll(In(seconds(1)));
  HandleAll();
  EXPECT_EQ(commands_.back().attempt, 1);
  EXPECT_EQ(commands_.back().episode, 0);
  EXPECT_EQ(commands_.back().seed, Seed());
  // The EPISODE_END of this attempt may be lost.
  Begin(1);
  PublishSummary(1, 0, "server_error", "HTTP 503");
  EXPECT_EQ(listener_.remarks.back(), "      0  retrying: the policy's server failed: HTTP 503");
  Begin(2);
  PublishEnd(2);
  PublishSummary(2);
  PublishFinished("recorder", 2);
  ASSERT_EQ(listener_.done.size(), 1u);
  EXPECT_EQ(listener_.done[0]["complete"], true);
  EXPECT_EQ(listener_.remarks.size(), 2u);
}

TEST_F(RunControllerTest, AnUnreachableServerMakesTheEpisodeInvalidAndTheRunContinues) {
  // Other errors also count as attempts.
  Begin();
  PublishEnd(0, "aborted", "lost");
  Begin(1);
  PublishEnd(1, "server_error", "gone");
  Begin(2);
  PublishEnd(2, "server_error", "still gone");
  PublishSummary(2, 0, "server_error", "still gone");
  EXPECT_THAT(listener_.done, IsEmpty());
  PublishFinished("recorder", 2);
  ASSERT_EQ(listener_.done.size(), 1u);
  EXPECT_EQ(listener_.done[0]["end_reason"], "server_error");
  EXPECT_EQ(listener_.done[0]["end_detail"], "still gone");
  EXPECT_EQ(listener_.done[0]["complete"], false);
  EXPECT_THAT(listener_.remarks,
              ElementsAre("      0  retrying: lost", "      0  retrying: the policy's server failed: gone",
                          "      0  invalid after 3 attempts: the policy's server failed: still gone"));
  EXPECT_EQ(commands_.back().episode, 1);
  EXPECT_EQ(commands_.back().attempt, 0);
  episode_ = 1;
  Begin();
  PublishEnd();
  PublishSummary();
  PublishFinished("recorder");
  EXPECT_TRUE(Dut().done());
}

TEST_F(RunControllerTest, TwoDifferentScoresAreNotChosenFrom) {
  Begin();
  PublishSummary(0, 1);
  PublishSummary(0, 2);
  ASSERT_EQ(listener_.remarks.size(), 1u);
  EXPECT_THAT(listener_.remarks[0], HasSubstr("two different messages on EVALBUS_EPISODE_SUMMARY"));
}

// An old log's summary arrives before the run's own one, which is the only message that is missing.
TEST_F(RunControllerTest, AnOldLogsScoreIsNotTakenForThatOfOurEpisode) {
  Begin();
  PublishSummary(0, 0, "failure");
  PublishEnd(0, "success");
  PublishFinished("recorder");
  EXPECT_TRUE(listener_.done.empty());
  ASSERT_EQ(listener_.remarks.size(), 1u);
  EXPECT_THAT(listener_.remarks[0], HasSubstr("EPISODE_SUMMARY does not match EPISODE_END"));
}

TEST_F(RunControllerTest, ARepeatedScoreIsHandledOnce) {
  Begin();
  PublishSummary();
  PublishSummary();
  PublishEnd();
  PublishEnd();
  PublishFinished("recorder");
  EXPECT_EQ(listener_.done.size(), 1u);
  EXPECT_THAT(listener_.remarks, IsEmpty());
}

TEST_F(RunControllerTest, AnotherSimOnTheBusSpoilsTheEpisode) {
  Begin();
  PublishModel("/elsewhere/model/physics.mjb");
  PublishEnd();
  PublishSummary();
  EXPECT_THAT(listener_.remarks,
              ElementsAre("      0  retrying: a sim or a log of another run publishes on this bus: "
                          "/elsewhere/model/physics.mjb"));
}

TEST_F(RunControllerTest, WhatBeginsBeforeOurSimSpokeWaitsForIt) {
  PublishBegin();
  PublishEnd();
  PublishSummary();
  EXPECT_THAT(listener_.done, IsEmpty());
  PublishModel();
  PublishEnd();
  PublishSummary();
  PublishFinished("recorder");
  EXPECT_EQ(listener_.done.size(), 1u);
}

TEST_F(RunControllerTest, ALogClosedWhileTheSimContinuesIsOfAnotherRun) {
  Begin();
  PublishFinished("recorder");
  EXPECT_THAT(listener_.remarks, IsEmpty());
  component_status_t status{};
  status.component = "sim";
  status.state = component_status_t::READY;
  status.episode = episode_;
  status.last_finished_episode = -1;
  Publish(channels::kStatus, status);
  ASSERT_EQ(listener_.remarks.size(), 1u);
  EXPECT_THAT(listener_.remarks[0], HasSubstr("the episode's log was closed before the episode ended"));
}

TEST_F(RunControllerTest, AnEndThatIsLostUntilTheLogIsClosedCostsNothing) {
  for (const bool is_end_repeated : {false, true}) {
    SCOPED_TRACE(is_end_repeated);
    Begin();
    PublishFinished("recorder");
    PublishSummary();
    EXPECT_EQ(listener_.done.size(), is_end_repeated ? 1u : 0u);
    if (is_end_repeated) {
      PublishEnd();
    } else {
      PublishFinished("sim");
      ++episode_;
    }
  }
  EXPECT_THAT(listener_.remarks, IsEmpty());
  EXPECT_EQ(listener_.done.size(), 2u);
}

TEST_F(RunControllerTest, WaitsTenSecondsForTheScoreAndForTheLog) {
  Begin();
  PublishEnd();
  auto now = PollFor(&Dut(), In(seconds(0)), seconds(9));
  EXPECT_THAT(listener_.remarks, IsEmpty());
  now = PollFor(&Dut(), now, seconds(2));
  ASSERT_EQ(listener_.remarks.size(), 1u);
  EXPECT_THAT(listener_.remarks[0], HasSubstr("no EPISODE_SUMMARY from metrics within 10 s"));

  Begin(1);
  PublishEnd(1);
  PublishSummary(1);
  PollFor(&Dut(), now, seconds(11));
  ASSERT_EQ(listener_.remarks.size(), 2u);
  EXPECT_THAT(listener_.remarks[1], HasSubstr("the recorder did not finish the episode's log"));
}

TEST_F(RunControllerTest, WaitsAMinuteForTheFirstScore) {
  Dut().Poll(In(seconds(0)));
  Begin();
  const auto now = PollFor(&Dut(), In(seconds(0)), seconds(59));
  EXPECT_THAT(listener_.remarks, IsEmpty());
  PollFor(&Dut(), now, seconds(2));
  ASSERT_EQ(listener_.remarks.size(), 1u);
  EXPECT_THAT(listener_.remarks[0], HasSubstr("not all components were ready for the episode within 60 s"));
}

TEST_F(RunControllerTest, APolicyThatDoesNotComeIsNamedWithItsTimeout) {
  plan_.policy_is_external = true;
  plan_.policy_timeout_s = 0.4;
  Dut().Poll(In(seconds(0)));
  component_status_t status{};
  status.component = "policy";
  status.state = component_status_t::FAILED;
  status.error = "no GPU";
  Publish(channels::kStatus, status);
  try {
    PollFor(&Dut(), In(seconds(0)), seconds(2));
    FAIL();
  } catch (const EnvironmentError& error) {
    EXPECT_STREQ(
        error.what(),
        "no policy reported that it is ready for episode 0 within 0.4 s (--policy-timeout-s): no GPU");
  }
}

TEST_F(RunControllerTest, SilentComponentsAreNamed) {
  Dut().ExpectStart();
  EXPECT_EQ(Dut().Silent(In(seconds(0))), "");
  PublishFinished("metrics");
  PublishFinished("recorder");
  const auto start = In(seconds(0));
  std::string silent;
  auto waited = milliseconds(0);
  for (; silent.empty() && waited < seconds(100); waited += milliseconds(100)) {
    silent = Dut().Silent(start + waited);
  }
  EXPECT_EQ(silent, "metrics hangs: no STATUS for 10 s");
  EXPECT_NEAR(static_cast<double>(waited.count()) * 1e-3, 10.5, 1);
}

TEST_F(RunControllerTest, TimeInWhichTheProcessDidNotRunIsNotCountedAsSilence) {
  Dut().ExpectStart();
  EXPECT_EQ(Dut().Silent(In(seconds(0))), "");
  EXPECT_EQ(Dut().Silent(In(seconds(3600))), "");
  Begin();
  PublishEnd();
  Dut().Poll(In(seconds(3600)));
  PublishSummary();
  Dut().Poll(In(seconds(7200)));
  EXPECT_THAT(listener_.remarks, IsEmpty());
}

TEST_F(RunControllerTest, AnEpisodeWhoseLogLacksTicksIsRetried) {
  const auto finish = [this](int attempt, int64_t missing) {
    Begin(attempt);
    PublishEnd(attempt);
    PublishSummary(attempt);
    component_status_t status{};
    status.component = "recorder";
    status.episode = status.last_finished_episode = episode_;
    status.attempt = attempt;
    status.last_finished_missing_ticks = missing;
    Publish(channels::kStatus, status);
  };
  finish(0, 195);
  EXPECT_THAT(listener_.remarks,
              ElementsAre("      0  retrying: the log lacks 195 ticks: lost on the way to the recorder"));
  EXPECT_THAT(listener_.done, IsEmpty());
  finish(1, 0);
  EXPECT_EQ(listener_.done.size(), 1u);
  // The scores are correct without a complete log. If no attempt has one, the last log is used, and the
  // recorder's warning reports it.
  episode_ = 1;
  for (int attempt = 0; attempt < 3; ++attempt) finish(attempt, 1);
  EXPECT_EQ(listener_.remarks.size(), 3u);
  EXPECT_EQ(listener_.done.size(), 2u);
}

TEST_F(RunControllerTest, AnEpisodeThatLacksACallOfThePolicyIsRetried) {
  plan_.calls = results::CallSchedule{.execute_steps = 3};
  // In a run, the recorder creates these folders.
  for (const char* episode : {"0000", "0001"})
    std::filesystem::create_directories(run_.path() / "episodes" / episode);
  const auto finish = [this](int attempt, const std::vector<int64_t>& called_ticks) {
    Begin(attempt);
    for (const int64_t tick : called_ticks) {
      policy_action_t action{};
      action.header = {0, episode_, attempt, tick, tick * 20000};
      action.num_steps = 3;
      Publish(channels::kPolicyAction, action);
    }
    PublishEnd(attempt);
    PublishSummary(attempt);
    PublishFinished("recorder", attempt);
  };
  finish(0, {0});
  EXPECT_THAT(
      listener_.remarks,
      ElementsAre(
          "      0  retrying: the message about a call to the policy was lost on the way to the launcher"));
  finish(1, {0, 3});
  ASSERT_EQ(listener_.done.size(), 1u);
  EXPECT_EQ(listener_.done[0]["extended"]["stale_action_ratio"], 0);
  // The scores are correct. Only the metrics that are computed from the calls are unknown.
  episode_ = 1;
  for (int attempt = 0; attempt < 3; ++attempt) finish(attempt, {0});
  ASSERT_EQ(listener_.done.size(), 2u);
  EXPECT_TRUE(listener_.done[1]["extended"]["stale_action_ratio"].is_null());
  EXPECT_THAT(listener_.remarks.back(), HasSubstr("the message about a call was lost"));
}

TEST_F(RunControllerTest, MessagesOfAnotherRunsSimAreIgnored) {
  model_info_t model{};
  model.physics_file = "/elsewhere/model/physics.mjb";
  model.session = kSession + 1;
  Begin();
  bus_.PublishRaw(channels::kModel.name, Encode(model));
  episode_begin_t begin{};
  begin.header.episode = episode_;
  begin.seed = Seed();
  begin.header.session = kSession + 1;
  bus_.PublishRaw(channels::kEpisodeBegin.name, Encode(begin));
  PublishEnd();
  PublishSummary();
  PublishFinished("recorder");
  EXPECT_EQ(listener_.done.size(), 1u);
  EXPECT_THAT(listener_.remarks, IsEmpty());
  EXPECT_EQ(bus_.foreign_messages(), 2);
  for (int i = 0; i < 2; ++i) Dut().Poll(In(seconds(i)));
  EXPECT_THAT(
      listener_.remarks,
      ElementsAre("warning: another run, or a log being played, publishes on this bus: its messages are "
                  "ignored"));
}

TEST_F(RunControllerTest, EpisodesBeginWithTheProcessesThatWereStarted) {
  Dut().ExpectStart({{"metrics", 11}, {"sim", 12}});
  Begin();
  Dut().Poll(In(seconds(0)));
  HandleAll();
  Dut().Retry("a process ended");
  Dut().Poll(In(seconds(10)));
  HandleAll();
  ASSERT_FALSE(commands_.empty());
  EXPECT_THAT(commands_.back().required_component, ElementsAre("metrics", "recorder"));
  EXPECT_THAT(commands_.back().required_instance, ElementsAre(11, 0));
  EXPECT_EQ(commands_.back().session, kSession);
}

TEST_F(RunControllerTest, WarningsOfOthersAreRemarksWithTheirPlace) {
  log_t line{};
  line.header = {0, 4, 0, 12, 240000};
  line.component = "sim";
  line.level = log_t::INFO_LEVEL;
  line.text = "ends, success";
  Publish(channels::kLog, line);
  line.level = log_t::WARN_LEVEL;
  line.text = "no \x1b[2J CONTACTS";
  Publish(channels::kLog, line);
  line.component = "run";
  Publish(channels::kLog, line);
  EXPECT_THAT(listener_.remarks, ElementsAre("      sim  e4 t12: no ?[2J CONTACTS"));
}

// The sim was restarted, and it has read changed files.
TEST_F(RunControllerTest, ASimThatReadOtherFilesEndsTheRun) {
  Begin();
  PublishModel();  // repeated
  const std::pair<const char*, void (*)(model_info_t*)> changes[] = {
      {"pot.yaml changed", [](model_info_t* model) { model->task_yaml = "min_m: 9.096"; }},
      {"a file of the physics model changed", [](model_info_t* model) { model->physics_sha256 = "12"; }},
      {"a file of the visual model changed", [](model_info_t* model) { model->visual_sha256 = "12"; }},
      {"limits.yaml changed",
       [](model_info_t* model) {
         model->limits_file = "limits.yaml";
         model->limits_yaml = "limits: {}";
       }},
      {"robot other changed", [](model_info_t* model) { model->robot = "other"; }},
      {"robot  changed",
       [](model_info_t* model) {
         model->arm.emplace_back();
         model->num_arms = 1;
       }},
  };
  for (const auto& [words, change] : changes) {
    model_info_t model = Model();
    change(&model);
    try {
      Publish(channels::kModel, model);
      ADD_FAILURE() << words;
    } catch (const InputError& error) {
      EXPECT_EQ(error.what(),
                std::string(words) + " during the run; restore it and use --resume, or start a new run");
    }
    // MODEL of another run's sim is ignored, whatever files that sim has read.
    model.physics_file = "/elsewhere.mjb";
    Publish(channels::kModel, model);
  }
  EXPECT_THAT(listener_.done, IsEmpty());
}

TEST_F(RunControllerTest, TheFirstModelToo) {
  plan_.model_hashes.physics_sha256 = "of run.json";
  EXPECT_THROW(PublishModel(), InputError);
}

TEST_F(RunControllerTest, MissedDeadlinesAreInTheEpisodesLine) {
  plan_.episodes = {0};
  plan_.realtime = true;
  Begin();
  PublishEnd();
  episode_summary_t summary{};
  summary.header = Header(0);
  summary.seed = Seed();
  summary.end_reason = "success";
  summary.extended.deadline_misses = 3;
  Publish(channels::kEpisodeSummary, summary);
  PublishFinished("recorder");
  ASSERT_TRUE(Dut().done());
  EXPECT_EQ(listener_.done.at(0)["pacing"]["deadline_misses"], 3);
}

// Users may start the missing component late or use a debugger, so there is no time limit.
TEST_F(RunControllerTest, ByHandThereAreNoTimeouts) {
  plan_.is_by_hand = true;
  for (const seconds after : {seconds(0), seconds(3600), seconds(7200), seconds(10800)})
    Dut().Poll(In(after));
  EXPECT_THAT(listener_.remarks, IsEmpty());
  Begin();
  PublishFinished("policy");
  EXPECT_EQ(Dut().Silent(In(seconds(20000))), "");
  EXPECT_EQ(commands_.back().attempt, 0);
}

}  // namespace evalbus::runner::run_controller_test
