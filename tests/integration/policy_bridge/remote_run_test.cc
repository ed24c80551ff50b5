// Tests whole runs of policies behind a server: scores, replays from the log alone, and the effect of a
// failing server.
#include <algorithm>
#include <atomic>
#include <csignal>
#include <limits>
#include <regex>

#include "bus/channels.h"
#include "tests/doubles/groot_server.h"
#include "tests/doubles/policy_server.h"
#include "tests/integration/harness.h"

namespace evalbus::remote_run_test {

namespace fs = std::filesystem;
using policy::Array;
using policy::FloatArray;
using policy::Map;
using policy::Numbers;
using policy::PolicyServerDouble;
using policy::Value;
using Answer = PolicyServerDouble::Answer;

constexpr int kSteps = 4;

// Moves the left arm a little, depending on the images and the state, so that a wrong input changes scores.
Value Forward(const Value& observation) {
  const std::vector<double> joints = Numbers(*observation.Find("state")->As<Array>());
  double brightness = 0;
  for (const double level : Numbers(*observation.Find("image")->As<Array>())) brightness += level;
  std::vector<double> rows;
  for (int k = 0; k < kSteps; ++k) {
    for (const double joint : joints) rows.push_back(joint + 1e-8 * brightness);
    rows.push_back(0.5);
  }
  return Map{{"actions", FloatArray(rows, {kSteps, static_cast<int64_t>(rows.size()) / kSteps})}};
}

class RemoteRun : public testing::Test {
 protected:
  void Serve(std::function<Answer(const Value&)> answer) {
    server_.emplace(PolicyServerDouble::Options{.answer = std::move(answer)});
  }
  // Writes a contract file for the server; returns its path.
  std::string Contract(const std::string& kind = "joint_position", const std::string& rate_hz = "20") {
    const std::string file = folder_.path() / "mine.yaml";
    WriteText(file, "wire: openpi\nurl: " + server_->url() + "\nrate_hz: " + rate_hz +
                        "\ndeadlines: {connect_s: 900, first_reply_s: 900, reply_s: 900, return_s: 900}\n"
                        "observation:\n"
                        "  - {key: image, camera: roboeval/head, size_px: [48, 32]}\n"
                        "  - {key: state, state: left.joint_position_rad}\n"
                        "  - {key: prompt, prompt: true}\n"
                        "action:\n  kind: " +
                        kind + "\n  values: 8\n  execute_steps: 3\n" +
                        (kind == "joint_delta" ? "  delta_on: target\n" : "  first_step_rad: 0.5\n") +
                        "  arms: [{arm: left, indices: 0-6, gripper: {index: 7, open: 0, closed: 1}}]\n");
    return file;
  }
  std::vector<std::string> Arguments(const std::string& policy, int episodes) const {
    return {task_, "--policy", policy, "--episodes", std::to_string(episodes), "--seed", "5"};
  }
  static std::vector<std::string> With(std::vector<std::string> arguments,
                                       const std::vector<std::string>& more) {
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }
  Result Run(const std::string& policy, int episodes, const fs::path& out) {
    return RunProgram(With({"evalbus", "run"}, With(Arguments(policy, episodes), {"--out", out.string()})));
  }

  TemporaryFolder folder_;
  const std::string task_ = ShortTask(folder_.path(), 1) + "/position";
  std::optional<PolicyServerDouble> server_;
};

TEST_F(RemoteRun, IsTheSameInOneProcessInManyAndWithManyWorkers) {
  EVALBUS_NEEDS_BUS();
  Serve(Forward);
  const std::string contract = Contract();
  const fs::path together = folder_.path() / "together", apart = folder_.path() / "apart",
                 workers = folder_.path() / "workers";
  Evaluate(With(Arguments(contract, 3), {"--in-process"}), together);
  Evaluate(Arguments(contract, 3), apart);
  Evaluate(With(Arguments(contract, 3), {"--workers", "2"}), workers);
  ExpectSameScores(together, apart);
  ExpectSameScores(together, workers);
  for (int episode = 0; episode < 3; ++episode) {
    const RecordedLog log = ReadLog(LogFile(apart, episode));
    ExpectSameTicks(ReadLog(LogFile(together, episode)), log);
    // The policy was called once at each of the ticks 0, 3, 6, ..., and observed exactly these ticks.
    const auto saw = log.Messages(channels::kObservation);
    const auto said = log.Messages(channels::kPolicyAction);
    ASSERT_EQ(saw.size(), 7u);
    ASSERT_EQ(said.size(), 7u);
    const auto states = log.Messages(channels::kState);
    const auto same = ReadLog(LogFile(together, episode)).Messages(channels::kObservation);
    for (size_t i = 0; i < saw.size(); ++i) {
      EXPECT_EQ(saw[i].header.tick, static_cast<int64_t>(3 * i));
      EXPECT_EQ(said[i].header.tick, saw[i].header.tick);
      EXPECT_EQ(saw[i].prompt, "lift the pot by the handles");
      ASSERT_EQ(saw[i].array.size(), 1u);
      EXPECT_EQ(saw[i].array[0].value_mixed[0],
                static_cast<float>(states[3 * i].arm[0].joint_position_rad[0]));
      ASSERT_EQ(saw[i].image.size(), 1u);
      EXPECT_EQ(saw[i].image[0].sent_bytes, 48 * 32 * 3);
      EXPECT_EQ(saw[i].image[0].sha256, same[i].image[0].sha256);
      EXPECT_EQ(said[i].execute_steps, 3);
      EXPECT_EQ(said[i].num_steps, kSteps);
    }
    EXPECT_NE(saw[0].image[0].sha256, saw[6].image[0].sha256);
    EXPECT_TRUE(fs::exists(apart / "episodes" / ("000" + std::to_string(episode)) / "policy_calls.json"));
  }
  // Rescores without the server, from the log alone.
  server_->Stop();
  const fs::path replayed = folder_.path() / "replayed";
  Evaluate(With(Arguments("replay:" + apart.string(), 3), {"--control-hz", "20"}), replayed);
  auto scores = Episodes(apart);
  for (auto& line : scores) {
    // Only a policy behind a server has these metrics.
    for (const char* name : {"stale_action_ratio", "effective_hz", "action_age_s"})
      EXPECT_EQ(line["extended"].erase(name), 1u) << name;
  }
  EXPECT_EQ(scores, Episodes(replayed));
}

// The policy is also called at the last tick. Meanwhile the tick is scored, so it is a race whether the
// answer arrives in time.
TEST_F(RemoteRun, CallsAreAsManyInOneProcessAsInMany) {
  EVALBUS_NEEDS_BUS();
  Serve(Forward);
  const fs::path contract = Contract();
  std::string text = ReadText(contract);
  const std::string three = "execute_steps: 3";
  WriteText(contract, text.replace(text.find(three), three.size(), "execute_steps: 2"));
  const fs::path apart = folder_.path() / "apart", same = folder_.path() / "same";
  Evaluate(Arguments(contract, 1), apart);
  Evaluate(With(Arguments(contract, 1), {"--in-process"}), same);
  for (const fs::path& run : {apart, same}) {
    const auto calls = nlohmann::json::parse(ReadText(run / "episodes/0000/policy_calls.json"));
    // The episode ends at tick 20, at which the policy is also called.
    EXPECT_EQ(calls["tick"].dump(), "[0,2,4,6,8,10,12,14,16,18]") << run;
  }
}

// Each episode is one trial. The trial is ended even after the last episode, and although the policy is also
// called at the last tick.
TEST_F(RemoteRun, EachEpisodeIsOneTrialOfXPolicyLab) {
  EVALBUS_NEEDS_BUS();
  server_.emplace(PolicyServerDouble::Options{
      .wire = policy::Wire::kXPolicyLab, .answer = [](const Value& observation) {
        const Value joints = *observation.Find("state")->Find("left_arm_joint_state");
        return Map{{"actions", policy::List(2, Map{{"left_arm_joint_state", joints},
                                                   {"left_ee_joint_state", policy::List{0.5}}})}};
      }});
  const fs::path contract = folder_.path() / "trials.yaml";
  WriteText(contract, "wire: xpolicylab\nurl: " + server_->url() +
                          "\nrate_hz: 20\n"
                          "deadlines: {connect_s: 900, first_reply_s: 900, reply_s: 900, return_s: 900}\n"
                          "observation:\n"
                          "  - {key: [state, left_arm_joint_state], state: left.joint_position_rad}\n"
                          "  - {key: env_idx, constant: {integer: 0}}\n"
                          "action:\n  keys: [left_arm_joint_state, left_ee_joint_state]\n"
                          "  kind: joint_position\n  values: 8\n  execute_steps: 2\n"
                          "  arms: [{arm: left, indices: 0-6, gripper: {index: 7, open: 1, closed: 0}}]\n");
  const fs::path apart = folder_.path() / "apart", together = folder_.path() / "together";
  for (const fs::path& run : {apart, together}) {
    const size_t begin = server_->Requests().size();
    auto arguments = Arguments(contract, 2);
    if (run == together) arguments.emplace_back("--in-process");
    Evaluate(arguments, run);
    std::string types;
    const std::vector<Value> requests = server_->Requests();
    for (size_t i = begin; i < requests.size(); ++i) {
      types += *requests[i].Find("message_type")->As<std::string>() + ' ';
    }
    const std::string trial = "reset( infer){10,11} trial_end ";
    EXPECT_TRUE(std::regex_match(types, std::regex("hello prepare_case " + trial + trial + "close ")))
        << run << ": " << types;
  }
  ExpectSameScores(apart, together);
}

// Requests that the workers send at the same time form one batch. A single worker has the same results.
TEST_F(RemoteRun, ManyWorkersAreOneBatch) {
  EVALBUS_NEEDS_BUS();
  doubles::GrootServer::Options options;
  options.dialect = policy::ClientOptions::GrootDialect::kN15;
  options.horizon = kSteps;
  options.step = 1e-3;
  options.per_level = 1e-8;
  // The delay leaves time for requests of other workers.
  options.least_delay = std::chrono::milliseconds(100);
  const doubles::GrootServer server(options);
  const fs::path contract = folder_.path() / "groot.yaml";
  WriteText(contract, "wire: groot\nurl: " + server.url() +
                          "\nrate_hz: 20\nbatch_size: 8\n"
                          "observation:\n"
                          "  - {key: video.front, camera: head, size_px: [48, 32], history_ticks: [0]}\n"
                          "  - {key: state.arm, state: left.joint_position_rad, history_ticks: [0]}\n"
                          "  - {key: state.gripper, state: left.gripper_opening, history_ticks: [0]}\n"
                          "  - {key: annotation.human.task_description, prompt: true}\n"
                          "action:\n  keys: [arm, gripper]\n  kind: joint_position\n  values: 8\n"
                          "  execute_steps: 3\n"
                          "  arms: [{arm: left, indices: 0-6, gripper: {index: 7, open: 0, closed: 4}}]\n");
  const Result check =
      RunProgram({"evalbus", "policy", "check", contract, "--out", (folder_.path() / "check").string()});
  EXPECT_NE(
      check.out.find("two observations in one request: the answers are the same as in separate requests"),
      std::string::npos)
      << check.out << check.err;
  std::vector<fs::path> runs;
  for (const char* workers : {"1", "2", "4"}) {
    runs.push_back(folder_.path() / workers);
    const size_t before = server.batches().size();
    Evaluate(With(Arguments(contract, 8), {"--workers", workers}), runs.back());
    const std::vector<int> batches = server.batches();
    const int largest =
        *std::max_element(batches.begin() + static_cast<std::ptrdiff_t>(before), batches.end());
    EXPECT_EQ(largest > 1, std::string(workers) != "1") << largest;
    ExpectSameScores(runs.front(), runs.back());
  }
  for (int episode = 0; episode < 8; ++episode) {
    ExpectSameTicks(ReadLog(LogFile(runs.front(), episode)), ReadLog(LogFile(runs.back(), episode)));
  }
}

// A restarted policy process reads its contract again, so a contract that changed during the run is an error.
TEST_F(RemoteRun, IsOfOneContract) {
  EVALBUS_NEEDS_BUS();
  Serve(Forward);
  const std::string contract = Contract(), before = ReadText(contract);
  const fs::path run = folder_.path() / "run";
  const auto command = [&](const std::vector<std::string>& more) {
    return With({"evalbus", "run"}, With(With(Arguments(contract, 16), {"--out", run.string()}), more));
  };
  Program launcher(command({}));
  ASSERT_TRUE(WaitFor([&] { return fs::exists(run / "episodes.jsonl"); })) << launcher.err();
  launcher.Signal(SIGSTOP);
  const auto policies = ChildrenOf(launcher.pid(), "evalbus-policy");
  ASSERT_EQ(policies.size(), 1u);
  WriteText(contract, std::regex_replace(before, std::regex("execute_steps: 3"), "execute_steps: 2"));
  kill(policies[0], SIGKILL);
  launcher.Signal(SIGCONT);
  EXPECT_EQ(launcher.Wait(), 1);
  EXPECT_EQ(launcher.err(), "error: " + contract +
                                " changed during the run; restore it and use --resume, or start a new run\n");
  EXPECT_LT(Episodes(run).size(), 16u);
  const Result other = RunProgram(command({"--resume"}));
  EXPECT_EQ(other.code, 1);
  EXPECT_NE(other.err.find("the run was made with another policy contract"), std::string::npos) << other.err;
  // Changes that do not affect results are allowed between two launches.
  WriteText(contract, before + "# a comment\n");
  const Result resumed = RunProgram(command({"--resume"}));
  EXPECT_EQ(resumed.code, 0) << resumed.err;
  EXPECT_EQ(Episodes(run).size(), 16u);
}

// The simulation continues while the policy receives images and computes. All images of an observation still
// belong to the same tick.
TEST_F(RemoteRun, FollowsARealtimeClock) {
  EVALBUS_NEEDS_BUS();
  Serve(Forward);
  const fs::path run = folder_.path() / "run";
  Evaluate(With(Arguments(Contract(), 1), {"--realtime"}), run);
  const RecordedLog log = ReadLog(LogFile(run, 0));
  const auto saw = log.Messages(channels::kObservation);
  const auto states = log.Messages(channels::kState);
  ASSERT_GE(saw.size(), 2u);
  // The episode may end while the policy computes its last answer.
  const size_t answers = log.Messages(channels::kPolicyAction).size();
  EXPECT_LE(answers, saw.size());
  EXPECT_GE(answers + 1, saw.size());
  for (const observation_t& observation : saw) {
    const auto tick = static_cast<size_t>(observation.header.tick);
    ASSERT_LT(tick, states.size());
    EXPECT_EQ(observation.array.at(0).value_mixed.at(0),
              static_cast<float>(states[tick].arm[0].joint_position_rad[0]));
  }
}

TEST_F(RemoteRun, ReportsHowItWasMade) {
  EVALBUS_NEEDS_BUS();
  Serve(Forward);
  const fs::path run = folder_.path() / "run";
  const Result result = Run(Contract(), 1, run);
  ASSERT_EQ(result.code, 0) << result.err;
  for (const char* words :
       {"policy mine ", "20 Hz", "contract mine (openpi): joint_position, 3 steps",
        "simulated time was paused during the policy's computation", "Its server was called 7 times"}) {
    EXPECT_NE(result.out.find(words), std::string::npos) << words << "\n" << result.out;
  }
  const auto info = nlohmann::json::parse(ReadText(run / "run.json"));
  EXPECT_EQ(info["policy_contract"]["action"]["execute_steps"], 3);
  ASSERT_EQ(RunProgram({"evalbus", "report", run}).code, 0);
  EXPECT_NE(ReadText(run / "report.html").find("Its server was called 7 times"), std::string::npos);
}

// 30 Hz is not a whole number of physics steps of 2 ms, and no rate was given on the command line.
TEST_F(RemoteRun, ReportsTheRateAtWhichTheContractIsRun) {
  EVALBUS_NEEDS_BUS();
  Serve(Forward);
  const Result result = Run(Contract("joint_position", "30"), 1, folder_.path() / "run");
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_TRUE(result.out.starts_with(
      "control rate: 29.412 Hz instead of 30 Hz; a tick is 17 physics steps of 2 ms\n"))
      << result.out;
  EXPECT_NE(result.out.find("29.4118 Hz"), std::string::npos) << result.out;
}

// The server fails once in each episode, in a different way each time. The episode is retried from its seed.
TEST_F(RemoteRun, AFailingServerIsNoFailingPolicy) {
  EVALBUS_NEEDS_BUS();
  const std::vector<Answer> faults = {
      PolicyServerDouble::Error{"Traceback\n  File x\nRuntimeError: out of GPU memory"},
      PolicyServerDouble::Gone(), PolicyServerDouble::HalfFrame(), PolicyServerDouble::Announced2GB(),
      Value(Map{{"nothing", 1}})};
  const std::vector<std::string> words = {"RuntimeError: out of GPU memory", "", "", "",
                                          "the answer has no 'actions'"};
  // Each fault occurs at the third call of its episode. The next attempt makes seven calls.
  std::atomic<int> calls = 0, failed = 0;
  Serve([&](const Value& observation) -> Answer {
    if (++calls == 3 + 10 * failed && failed < static_cast<int>(faults.size())) {
      return faults[static_cast<size_t>(failed++)];
    }
    return Forward(observation);
  });
  const std::string contract = Contract();
  const int episodes = static_cast<int>(faults.size());
  const fs::path run = folder_.path() / "run", well = folder_.path() / "well";
  const Result result = Run(contract, episodes, run);
  ASSERT_EQ(result.code, 0) << result.err << result.out;
  EXPECT_EQ(failed, episodes) << result.out;
  for (const std::string& said : words)
    EXPECT_NE(result.out.find(said), std::string::npos) << said << result.out;
  Evaluate(Arguments(contract, episodes), well);
  ExpectSameScores(run, well);
  // The server must stop now, because its thread uses variables of this test.
  server_->Stop();
}

// The policy waits for return_s once, not once in each of three attempts.
TEST_F(RemoteRun, AServerThatIsNotRunningEndsTheRun) {
  EVALBUS_NEEDS_BUS();
  Serve(Forward);
  const std::string contract = Contract();
  WriteText(contract, std::regex_replace(ReadText(contract), std::regex("return_s: 900"), "return_s: 0.1"));
  server_->Stop();
  const fs::path run = folder_.path() / "run";
  const Result result = Run(contract, 1, run);
  EXPECT_EQ(result.code, 2) << result.out;
  EXPECT_NE(result.err.find("error: waited 0.1 s for the policy's server (return_s): "), std::string::npos)
      << result.err;
  EXPECT_NE(result.out.find("waiting up to 0.1 s for the policy's server: "), std::string::npos)
      << result.out;
  EXPECT_EQ(result.out.find("retrying"), std::string::npos) << result.out;
  EXPECT_FALSE(fs::exists(run));
}

TEST_F(RemoteRun, NanIsThePolicysOwn) {
  EVALBUS_NEEDS_BUS();
  std::atomic<int> calls = 0;
  Serve([&](const Value& observation) -> Value {
    if (++calls != 2) return Forward(observation);
    return Map{
        {"actions",
         FloatArray(std::vector<double>(8 * kSteps, std::numeric_limits<double>::quiet_NaN()), {kSteps, 8})}};
  });
  const fs::path run = folder_.path() / "run";
  const Result result = Run(Contract(), 2, run);
  ASSERT_EQ(result.code, 0) << result.err;
  const auto episodes = Episodes(run);
  ASSERT_EQ(episodes.size(), 2u);
  EXPECT_EQ(episodes[0]["end_reason"], "policy_error");
  EXPECT_EQ(episodes[0]["complete"], true);
  EXPECT_EQ(episodes[1]["end_reason"], "time_limit");
}

TEST_F(RemoteRun, ReportsWhichStartsWereSeenInTraining) {
  EVALBUS_NEEDS_BUS();
  Serve(Forward);
  const fs::path contract = Contract();
  const std::string text = ReadText(contract), other = folder_.path() / "other.yaml";
  WriteText(other, text);
  // Two of the three initial states also occur in a run with the same seed.
  const fs::path demos = folder_.path() / "demos", moved = folder_.path() / "moved";
  Evaluate(
      {task_, "--policy", "hold", "--episodes", "2", "--seed", "5", "--control-hz", "20", "--in-process"},
      demos);
  WriteText(contract, "trained_on: demos\n" + text);
  const fs::path run = folder_.path() / "run", workers = folder_.path() / "workers";
  Result result = Run(contract, 3, run);
  ASSERT_EQ(result.code, 0) << result.err;
  ASSERT_EQ(RunProgram({"evalbus", "export", demos, "--hdf5", folder_.path() / "set.hdf5"}).code, 0);
  const std::string note = "2 of 3 starts were seen in training";
  EXPECT_NE(result.out.find("\nNote: " + note + "\n"), std::string::npos) << result.out;
  const auto episodes = Episodes(run);
  for (size_t i = 0; i < episodes.size(); ++i) EXPECT_EQ(episodes[i].at("seen_in_training"), i < 2) << i;
  EXPECT_EQ(nlohmann::json::parse(ReadText(run / "summary.json"))["seen_in_training"], 2);
  EXPECT_EQ(nlohmann::json::parse(ReadText(run / "run.json"))["trained_on"]["starts"], 2);
  Evaluate(With(Arguments(contract, 3), {"--workers", "2"}), workers);
  ExpectSameScores(run, workers);
  EXPECT_EQ(SchemaError("run", run / "run.json"), "");
  EXPECT_EQ(SchemaError("summary", run / "summary.json"), "");
  EXPECT_EQ(SchemaError("episode", run / "episodes.jsonl"), "");
  EXPECT_EQ(SchemaError("policy_calls", run / "episodes/0000/policy_calls.json"), "");

  // A different training set is refused when the run is resumed; nothing is changed.
  WriteText(contract, "trained_on: [demos, run]\n" + text);
  result =
      RunProgram(With({"evalbus", "run"}, With(Arguments(contract, 4), {"--out", run.string(), "--resume"})));
  EXPECT_EQ(result.code, 1);
  EXPECT_NE(result.err.find("the run was made with another training set (trained_on)"), std::string::npos)
      << result.err;

  // The flags do not depend on whether the training run still exists.
  fs::rename(demos, moved);
  for (const char* command : {"verify", "rescore"}) {
    result = RunProgram({"evalbus", command, run});
    EXPECT_EQ(result.code, 0) << result.out << result.err;
  }
  result = RunProgram({"evalbus", "compare", run, workers});
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_NE(result.out.find("note: run: " + note), std::string::npos) << result.out;
  result = RunProgram({"evalbus", "report", run});
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_NE(ReadText(run / "report.html").find(note), std::string::npos);

  // A missing training run is reported before the first episode.
  WriteText(contract, "trained_on: demos\n" + text);
  result = Run(contract, 3, folder_.path() / "none");
  EXPECT_EQ(result.code, 1);
  EXPECT_EQ(result.err, "error: " + contract.string() + ":1: key 'trained_on': " + demos.string() +
                            ": no such run folder\n");
  EXPECT_FALSE(fs::exists(folder_.path() / "none"));
  // The exported training set has the same initial states.
  WriteText(contract, "trained_on: set.hdf5\n" + text);
  result = Run(contract, 3, folder_.path() / "of_set");
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_NE(result.out.find("\nNote: " + note + "\n"), std::string::npos) << result.out;
  // Nothing is reported for a contract that names no training set.
  result = Run(other, 1, folder_.path() / "untold");
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(result.out.find("training"), std::string::npos) << result.out;
}

TEST_F(RemoteRun, WhatIsMisunderstoodStopsTheRunBeforeItsFirstEpisode) {
  EVALBUS_NEEDS_BUS();
  Serve([](const Value&) -> Value {
    return Map{{"actions", FloatArray(std::vector<double>(7, 0), {1, 7})}};
  });
  const fs::path run = folder_.path() / "run";
  Result result = Run(Contract(), 1, run);
  EXPECT_EQ(result.code, 1) << result.out;
  EXPECT_NE(
      result.err.find("the answer has 1 step of 7 values, the contract expects 8 values (action.values)"),
      std::string::npos)
      << result.err;
  EXPECT_FALSE(fs::exists(run));
  // The policy returns degrees instead of radians.
  Serve([](const Value&) -> Value {
    return Map{{"actions", FloatArray(std::vector<double>(8 * kSteps, 30), {kSteps, 8})}};
  });
  result = Run(Contract(), 1, run);
  EXPECT_EQ(result.code, 1);
  EXPECT_NE(result.err.find("the policy's first action moves joint"), std::string::npos) << result.err;
  result = RunProgram({"evalbus", "run", task_, "--policy", Contract(), "--control-hz", "50", "--out", run});
  EXPECT_EQ(result.code, 1);
  EXPECT_NE(result.err.find("rate_hz: the policy acts at 20 Hz, but the run has 50 Hz"), std::string::npos)
      << result.err;
  EXPECT_FALSE(fs::exists(run));
}

TEST_F(RemoteRun, CheckDistinguishesCauses) {
  const auto check = [&](const std::string& contract) {
    return RunProgram({"evalbus", "policy", "check", contract, "--out", (folder_.path() / "check").string()});
  };
  Serve(Forward);
  Result result = check(Contract());
  EXPECT_EQ(result.code, 0) << result.out << result.err;
  EXPECT_NE(result.out.find("the same observation 6 times: the same answer"), std::string::npos)
      << result.out;
  EXPECT_TRUE(fs::exists(folder_.path() / "check/image.png"));
  EXPECT_EQ(SchemaError("check", folder_.path() / "check/check.json"), "");
  EXPECT_EQ(nlohmann::json::parse(ReadText(folder_.path() / "check/check.json"))["verdict"], "good");
  const std::string with_typo = Contract();
  WriteText(with_typo, ReadText(with_typo) + "prompts: {lift_pt: pick it up}\n");
  result = check(with_typo);
  EXPECT_EQ(result.code, 6) << result.out;
  EXPECT_NE(result.out.find("the contract has 'prompts', but none for the task lift_pot\n"),
            std::string::npos)
      << result.out;
  // The range of a gripper applies to the scaled value.
  const std::string scaled = Contract();
  WriteText(scaled, ReadText(scaled) + "  scale: [1, 1, 1, 1, 1, 1, 1, 10]\n");
  result = check(scaled);
  EXPECT_EQ(result.code, 6) << result.out;
  EXPECT_NE(result.out.find("gripper left: values 5 to 5, the contract expects 0 (open) to 1 (closed)\n"),
            std::string::npos)
      << result.out;
  // Interpreted as deltas, these values are half a turn.
  result = check(Contract("joint_delta"));
  EXPECT_EQ(result.code, 6) << result.out;
  EXPECT_NE(result.out.find("absolute positions used as deltas"), std::string::npos) << result.out;

  // Valid targets differ from the robot's position, as an early checkpoint or a different initial pose may
  // cause.
  Serve([](const Value& observation) -> Value {
    std::vector<double> row = Numbers(*observation.Find("state")->As<Array>());
    for (double& joint : row) joint += 0.65;
    row.push_back(0.5);
    std::vector<double> rows;
    for (int k = 0; k < kSteps; ++k) rows.insert(rows.end(), row.begin(), row.end());
    return Map{{"actions", FloatArray(rows, {kSteps, 8})}};
  });
  const std::string elsewhere = Contract();
  result = check(elsewhere);
  EXPECT_EQ(result.code, 6) << result.out;
  EXPECT_NE(result.out.find("; expected at most 0.5 rad (first_step_rad)"), std::string::npos) << result.out;
  EXPECT_NE(result.out.find("set 'first_step_rad: 0.7' in the contract's action, or pass --first-step 0.7"),
            std::string::npos)
      << result.out;
  EXPECT_NE(RunProgram({"evalbus", "policy", "check", elsewhere, "--first-step", "nan"})
                .err.find("--first-step: Value nan is not a number"),
            std::string::npos);
  result = RunProgram({"evalbus", "policy", "check", elsewhere, "--first-step", "0.75", "--out",
                       (folder_.path() / "check").string()});
  EXPECT_EQ(result.code, 0) << result.out << result.err;

  // Each answer has one step more than the previous one. The last answers are not numbers.
  Serve([calls = 0](const Value& observation) mutable -> Value {
    std::vector<double> row = Numbers(*observation.Find("state")->As<Array>());
    row.push_back(0.5);
    if (calls > 3) row[0] = std::numeric_limits<double>::quiet_NaN();
    std::vector<double> rows;
    const int steps = kSteps + calls++;
    for (int k = 0; k < steps; ++k) rows.insert(rows.end(), row.begin(), row.end());
    return Map{{"actions", FloatArray(rows, {steps, 8})}};
  });
  result = check(Contract());
  EXPECT_EQ(result.code, 6) << result.out;
  EXPECT_NE(result.out.find("the same observation 6 times: answers have 4 to 9 steps\n"), std::string::npos)
      << result.out;
  EXPECT_NE(result.out.find("a repeated answer has a value that is not a finite number"), std::string::npos)
      << result.out;
  EXPECT_EQ(result.out.find("the same answer"), std::string::npos) << result.out;

  // The third row is a step of 1 rad, and no arm uses its ninth value.
  Serve([](const Value& observation) -> Value {
    std::vector<double> row = Numbers(*observation.Find("state")->As<Array>());
    row.insert(row.end(), {0.5, 0});
    std::vector<double> rows;
    for (int k = 0; k < kSteps; ++k) {
      if (k == 2) row[0] += 1;
      rows.insert(rows.end(), row.begin(), row.end());
    }
    return Map{{"actions", FloatArray(rows, {kSteps, 9})}};
  });
  const std::string nine = Contract();
  std::string text = ReadText(nine);
  text.replace(text.find("values: 8"), 9, "values: 9");
  WriteText(nine, text);
  result = check(nine);
  EXPECT_EQ(result.code, 6) << result.out;
  EXPECT_NE(result.out.find("the contract uses no value at index 8\n"), std::string::npos) << result.out;
  EXPECT_NE(result.out.find("step 2 changes the target of joint left/joint1 by 1 rad; expected at most 0.5 "
                            "rad: are the rows steps of one chunk?"),
            std::string::npos)
      << result.out;

  // Both grippers use the same value, and one value is not used.
  Serve([](const Value&) -> Value {
    return Map{{"actions", FloatArray(std::vector<double>(16 * kSteps, 0), {kSteps, 16})}};
  });
  const std::string same_index = Contract();
  text = ReadText(same_index);
  text.replace(text.find("values: 8"), 9, "values: 16");
  text.replace(text.find("gripper: {index: 7"), 18, "gripper: {index: 14");
  text.replace(text.find("}}]"), 3,
               "}}, {arm: right, indices: 7-13, gripper: {index: 14, open: 0, closed: 1}}]");
  WriteText(same_index, text);
  result = check(same_index);
  EXPECT_EQ(result.code, 6) << result.out << result.err;
  EXPECT_NE(result.out.find("the contract uses the value at index 14 more than once: is an index wrong?\n"),
            std::string::npos)
      << result.out;
  const std::string trained = Contract();
  WriteText(trained, "trained_on: nosuch\n" + ReadText(trained));
  result = check(trained);
  EXPECT_EQ(result.code, 1) << result.out;
  EXPECT_NE(result.err.find("nosuch"), std::string::npos) << result.err;

  const std::string contract = Contract();
  server_->Stop();
  EXPECT_EQ(check(contract).code, 3);
  Serve(
      [](const Value&) -> Answer { return PolicyServerDouble::Error{"no\nValueError: Prompt is required"}; });
  result = check(Contract());
  EXPECT_EQ(result.code, 4);
  EXPECT_NE(result.out.find("ValueError: Prompt is required"), std::string::npos) << result.out;
  Serve([](const Value&) -> Value { return Map{{"actions", FloatArray({0, 0}, {1, 2})}}; });
  EXPECT_EQ(check(Contract()).code, 5);
  WriteText(folder_.path() / "mine.yaml", "wire: openpi\n");
  EXPECT_EQ(check(folder_.path() / "mine.yaml").code, 1);
}

}  // namespace evalbus::remote_run_test
