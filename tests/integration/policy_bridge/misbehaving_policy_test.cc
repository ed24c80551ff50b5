// Tests external policies (--policy lcm) that misbehave in various ways.
#include <signal.h>

#include <cmath>
#include <limits>
#include <thread>
#include <utility>

#include "base/json_file.h"
#include "bus/channels.h"
#include "evalbus/action_t.hpp"
#include "evalbus/component_status_t.hpp"
#include "evalbus/episode_begin_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "evalbus/state_t.hpp"
#include "tests/integration/harness.h"

namespace evalbus::misbehaving_policy_test {

namespace fs = std::filesystem;

// A policy that holds the robot still. Each episode has its own fault, or none.
class Guest {
 public:
  // Episodes by their index, named after their faults.
  enum Episode {
    kHonest,
    kNan,
    kInfinite,
    kWrongSize,
    kWrongMode,
    kOutOfRange,
    kNever,
    kWrongTick,
    kLate,
    kFailed,
    kSaysWhy,
    kDies,
    kHonestAgain,
    kServerFailsOnce,
    kServerIsGone,
    kNumEpisodes
  };

  explicit Guest(const std::string& url, bool server_is_back = false)
      : bus_(url), server_is_back_(server_is_back) {
    bus_.Subscribe(channels::kModel, [this](const model_info_t& m) { model_ = m; });
    bus_.Subscribe(channels::kEpisodeBegin, [this](const episode_begin_t& begin) {
      if (begin.header.attempt > 0) dead_ = false;  // another process has restarted the policy
      if (late_) bus_.Publish(channels::kAction, *late_);
      late_.reset();
      status_.component = "policy";
      status_.instance = 7 + begin.header.attempt;
      status_.session = begin.header.session;
      status_.state = component_status_t::READY;
      status_.episode = begin.header.episode;
      status_.attempt = begin.header.attempt;
      PublishStatus();
    });
    bus_.Subscribe(channels::kState, [this](const state_t& state) {
      if (state.header.tick < holds_from_) return Answer(state);
      unanswered_ = state;
    });
  }

  bool is_computing() const { return unanswered_.has_value(); }
  // Answers STATEs until a STATE of `tick` waits for its answer.
  void Work(int64_t tick = std::numeric_limits<int64_t>::max()) {
    holds_from_ = tick;
    if (unanswered_ && unanswered_->header.tick < tick) Answer(*std::exchange(unanswered_, {}));
    while (bus_.Handle()) {
    }
    if (std::chrono::steady_clock::now() - said_ > std::chrono::milliseconds(300)) PublishStatus();
  }

 private:
  void PublishStatus() {
    said_ = std::chrono::steady_clock::now();
    if (!dead_ && !status_.component.empty()) bus_.Publish(channels::kStatus, status_);
  }
  void Answer(const state_t& state) {
    if (dead_) return;
    constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
    action_t action{};
    action.header = state.header;
    action.mode = action_t::JOINT_POSITION;
    for (const arm_info_t& arm : model_.arm) {
      action.joint_position_rad.insert(action.joint_position_rad.end(), arm.joint_home_rad.begin(),
                                       arm.joint_home_rad.end());
    }
    action.gripper_closing.assign(model_.gripper.size(), 0);
    // The policy behaves correctly until tick 5.
    if (state.header.tick >= 5) {
      switch (state.header.episode) {
        case kNan:
          action.joint_position_rad[3] = kNaN;
          break;
        case kInfinite:
          action.gripper_closing[0] = -std::numeric_limits<double>::infinity();
          break;
        case kWrongSize:
          action.joint_position_rad.pop_back();
          break;
        case kWrongMode:
          action.mode = 99;
          break;
        case kOutOfRange:
          action.joint_position_rad[0] = 1e300;
          break;
        case kNever:
          return;
        case kWrongTick:
          ++action.header.tick;
          break;
        case kLate:
          late_ = action;
          return;
        case kFailed:
          status_.state = component_status_t::FAILED;
          status_.error = "out of GPU memory";
          PublishStatus();
          return;
        case kSaysWhy:
          action.error = "no such grasp";
          break;
        case kDies:
          if (status_.attempt == 0) {
            dead_ = true;
            return;
          }
          break;
        case kServerFailsOnce:
        case kServerIsGone:
          action.is_server_error =
              state.header.episode == kServerIsGone ? !server_is_back_ : state.header.attempt == 0;
          if (action.is_server_error) action.error = "connection closed";
          break;
        default:
          break;
      }
    }
    action.num_joints = static_cast<int32_t>(action.joint_position_rad.size());
    action.num_grippers = static_cast<int32_t>(action.gripper_closing.size());
    bus_.Publish(channels::kAction, action);
  }

  Bus bus_;
  const bool server_is_back_;
  model_info_t model_{};
  component_status_t status_{};
  std::optional<action_t> late_;
  int64_t holds_from_ = 0;
  std::optional<state_t> unanswered_;
  bool dead_ = false;
  SteadyTime said_{};
};

class MisbehavingPolicy : public testing::Test {
 protected:
  // Runs episodes `first` to `last` of the guest; returns the output of the run.
  std::string Run(int first, int last, const char* policy_timeout_s, bool continues = false,
                  bool is_quiet = false) {
    std::string only;
    for (int i = first; i <= last; ++i) only += (i > first ? "," : "") + std::to_string(i);
    const std::string url = UniqueUrl();
    Guest guest(url, continues);
    std::vector<std::string> command = {"evalbus",
                                        "run",
                                        task_,
                                        "--policy",
                                        "lcm",
                                        "--url",
                                        url,
                                        "--episodes",
                                        std::to_string(Guest::kNumEpisodes),
                                        "--only",
                                        only,
                                        "--policy-timeout-s",
                                        policy_timeout_s,
                                        "--out",
                                        run_};
    if (continues) command.push_back("--resume");
    if (is_quiet) command.push_back("--quiet");
    Program launcher(command);
    EXPECT_TRUE(WaitFor([&] {
      guest.Work();
      return !launcher.running();
    }));
    EXPECT_EQ(launcher.Wait(), 0) << launcher.err() << launcher.out();
    err_ = launcher.err();
    return launcher.out();
  }

  TemporaryFolder folder_;
  const std::string task_ = ShortTask(folder_.path(), 0.4);
  const fs::path run_ = folder_.path() / "run";
  std::string err_;
};

TEST_F(MisbehavingPolicy, EndsItsEpisodeAndTheNextOneBegins) {
  EVALBUS_NEEDS_BUS();
  const std::string out = Run(Guest::kHonest, Guest::kSaysWhy, "3");
  const std::string size = "action has 13 joint and 2 gripper values, expected 14 and 2";
  const std::vector<std::pair<std::string, std::string>> expected = {
      {"time_limit", ""},
      {"policy_error", "the action contains NaN or infinity"},
      {"policy_error", "the action contains NaN or infinity"},
      {"policy_error", size},
      {"policy_error", "action mode 99 is unknown, expected 1 (JOINT_POSITION)"},
      {"time_limit", ""},
      {"policy_timeout", "no ACTION for tick 5 from policy within 3 s"},
      {"policy_timeout", "no ACTION for tick 5 from policy within 3 s"},
      {"policy_timeout", "no ACTION for tick 5 from policy within 3 s"},
      {"policy_error", "out of GPU memory"},
      {"policy_error", "no such grasp"}};
  const auto episodes = Episodes(run_);
  ASSERT_EQ(episodes.size(), expected.size()) << out;
  for (size_t i = 0; i < expected.size(); ++i) {
    EXPECT_EQ(episodes[i]["end_reason"], expected[i].first) << i;
    EXPECT_EQ(episodes[i]["end_detail"], expected[i].second) << i;
    EXPECT_EQ(episodes[i]["complete"], true) << i;
    // The reason is also printed.
    EXPECT_NE(out.find(expected[i].second), std::string::npos) << out;
  }
  EXPECT_EQ(episodes[Guest::kHonest]["extended"]["action_clips"], 0);
  EXPECT_GT(episodes[Guest::kOutOfRange]["extended"]["action_clips"], 0);
}

TEST_F(MisbehavingPolicy, ThatDiedAndIsBackBeginsItsEpisodeAgain) {
  EVALBUS_NEEDS_BUS();
  const std::string out = Run(Guest::kDies, Guest::kHonestAgain, "40");
  EXPECT_NE(out.find("retrying: policy hangs"), std::string::npos) << out;
  // The built-in policy that holds still has the same results in both episodes.
  const fs::path hold = folder_.path() / "hold";
  Evaluate({task_, "--policy", "hold", "--in-process", "--episodes", std::to_string(Guest::kNumEpisodes),
            "--only", std::to_string(Guest::kDies) + "," + std::to_string(Guest::kHonestAgain)},
           hold);
  ExpectSameScores(run_, hold);
  for (const int i : {Guest::kDies, Guest::kHonestAgain}) {
    ExpectSameTicks(ReadLog(LogFile(run_, i)), ReadLog(LogFile(hold, i)));
  }
}

TEST_F(MisbehavingPolicy, AServersFaultIsNotItsOwn) {
  EVALBUS_NEEDS_BUS();
  const std::string out = Run(Guest::kHonestAgain, Guest::kServerIsGone, "40");
  const auto count = [&out](const std::string& text) {
    int found = 0;
    for (size_t at = 0; (at = out.find(text, at)) != std::string::npos; ++at) ++found;
    return found;
  };
  EXPECT_EQ(count("13  retrying: the policy's server failed: connection closed\n"), 1) << out;
  EXPECT_EQ(count("14  retrying: the policy's server failed: connection closed\n"), 2) << out;
  EXPECT_EQ(count("14  invalid after 3 attempts: the policy's server failed: connection closed\n"), 1) << out;
  EXPECT_EQ(count("1 of 3 episodes invalid: excluded from all numbers here\n"), 1) << out;
  EXPECT_EQ(count("1 episode is invalid because the policy's server failed; the same command with --out "), 1)
      << out;
  auto episodes = Episodes(run_);
  ASSERT_EQ(episodes.size(), 3u);
  EXPECT_EQ(episodes[1]["end_reason"], "time_limit");
  EXPECT_EQ(episodes[1]["complete"], true);
  EXPECT_EQ(episodes[2]["end_reason"], "server_error");
  EXPECT_EQ(episodes[2]["end_detail"], "connection closed");
  EXPECT_EQ(episodes[2]["complete"], false);
  auto summary = ReadJsonFile(run_ / "summary.json");
  EXPECT_EQ(summary["episodes"], 3);
  EXPECT_EQ(summary["complete"], 2);
  EXPECT_EQ(summary["invalid"], 1);
  // The log exists and agrees with the results.
  const Result rescored = RunProgram({"evalbus", "rescore", run_});
  EXPECT_EQ(rescored.code, 0) << rescored.out << rescored.err;

  // A resume that requests only the other episodes leaves this one unchanged.
  Run(Guest::kHonestAgain, Guest::kServerFailsOnce, "40", true);
  ASSERT_EQ(Episodes(run_).size(), 3u);
  EXPECT_EQ(Episodes(run_)[2], episodes[2]);

  const std::string resumed = Run(Guest::kHonestAgain, Guest::kServerIsGone, "40", true);
  EXPECT_NE(resumed.find("1 episode in "), std::string::npos) << resumed;
  EXPECT_EQ(resumed.find("invalid"), std::string::npos) << resumed;
  EXPECT_EQ(Episodes(run_)[0], episodes[0]);
  EXPECT_FALSE(ReadJsonFile(run_ / "summary.json").contains("invalid"));
  // All results are the same as if no server had failed.
  const fs::path hold = folder_.path() / "hold";
  Evaluate({task_, "--policy", "hold", "--in-process", "--episodes", std::to_string(Guest::kNumEpisodes),
            "--only", "12,13,14"},
           hold);
  ExpectSameScores(run_, hold);
}

TEST_F(MisbehavingPolicy, AServersFaultIsReportedByAQuietRun) {
  EVALBUS_NEEDS_BUS();
  EXPECT_EQ(Run(Guest::kServerIsGone, Guest::kServerIsGone, "40", false, true), "");
  EXPECT_NE(err_.find("1 episode is invalid because the policy's server failed; "), std::string::npos)
      << err_;
}

// As in a frozen container or a suspended machine: no process runs for longer than the policy's timeout.
TEST_F(MisbehavingPolicy, APauseOfAllIsNotItsTime) {
  EVALBUS_NEEDS_BUS();
  const std::string url = UniqueUrl();
  Guest guest(url);
  Program launcher({"evalbus", "run", task_, "--policy", "lcm", "--url", url, "--episodes", "1",
                    "--policy-timeout-s", "10", "--out", run_});
  ASSERT_TRUE(WaitFor([&] {
    guest.Work(5);
    return guest.is_computing();
  })) << launcher.err();
  std::vector<pid_t> all = ChildrenOf(launcher.pid());
  all.push_back(launcher.pid());
  {
    const Stopped stopped(all);
    // The test has to wait, because the pause itself is tested.
    std::this_thread::sleep_for(std::chrono::seconds(11));
  }
  ASSERT_TRUE(WaitFor([&] {
    guest.Work();
    return !launcher.running();
  }));
  EXPECT_EQ(launcher.Wait(), 0) << launcher.err();
  const auto episodes = Episodes(run_);
  ASSERT_EQ(episodes.size(), 1u);
  EXPECT_EQ(episodes[0]["end_reason"], "time_limit");
  EXPECT_EQ(launcher.out().find("retrying"), std::string::npos) << launcher.out();
}

TEST_F(MisbehavingPolicy, AMissingComponentIsWaitedForUntilTheTimeout) {
  EVALBUS_NEEDS_BUS();
  const Result result = RunProgram({"evalbus", "run", "lift_pot", "--policy", "lcm", "--url", UniqueUrl(),
                                    "--policy-timeout-s", "2", "--out", run_});
  EXPECT_EQ(result.code, 2);
  EXPECT_EQ(result.err,
            "error: no policy reported that it is ready for episode 0 within 2 s (--policy-timeout-s)\n");
  EXPECT_FALSE(fs::exists(run_));
}

TEST_F(MisbehavingPolicy, NeedsABusThatItKnows) {
  const std::vector<std::vector<std::string>> wrong = {
      {"lift_pot"}, {"lift_pot", "--in-process"}, {"lift_pot/all", "--url", "x"}};
  for (const auto& arguments : wrong) {
    std::vector<std::string> command = {"evalbus", "run", "--policy", "lcm"};
    command.insert(command.end(), arguments.begin(), arguments.end());
    const Result result = RunProgram(command);
    EXPECT_EQ(result.code, 1);
    EXPECT_EQ(
        result.err,
        "error: --policy lcm: expected one task, one worker, no --in-process, and the bus of the policy in "
        "--url or EVALBUS_URL, for example udpm://239.255.76.67:7667?ttl=0\n");
  }
}

}  // namespace evalbus::misbehaving_policy_test
