// Tests that equal seeds give equal bytes: in one process and in several, repeatedly, at three control rates,
// and for an episode within a run and alone.
#include <set>

#include "bus/channels.h"
#include "evalbus/command_t.hpp"
#include "evalbus/episode_begin_t.hpp"
#include "evalbus/state_t.hpp"
#include "tests/integration/harness.h"

namespace evalbus::determinism_test {

TEST(Determinism, OneProcessAndSeveralGiveTheSameBytes) {
  EVALBUS_NEEDS_BUS();
  TemporaryFolder folder;
  const std::vector<std::string> arguments = {"lift_pot/position_and_orientation", "--policy", "noisy_expert",
                                              "--episodes", "2"};
  std::vector<std::string> in_process = arguments;
  in_process.push_back("--in-process");
  Evaluate(arguments, folder.path() / "processes");
  Evaluate(arguments, folder.path() / "again");
  Evaluate(in_process, folder.path() / "one");
  Evaluate(in_process, folder.path() / "one_again");
  for (const char* other : {"again", "one", "one_again"}) {
    SCOPED_TRACE(other);
    ExpectSameScores(folder.path() / "processes", folder.path() / other);
    for (int episode = 0; episode < 2; ++episode) {
      ExpectSameTicks(ReadLog(LogFile(folder.path() / "processes", episode)),
                      ReadLog(LogFile(folder.path() / other, episode)));
    }
  }
}

class DeterminismAt : public testing::TestWithParam<const char*> {};

TEST_P(DeterminismAt, OneProcessAndSeveralGiveTheSameBytes) {
  EVALBUS_NEEDS_BUS();
  TemporaryFolder folder;
  const std::vector<std::string> arguments = {ShortTask(folder.path(), 0.5) + "/position",
                                              "--policy",
                                              "random",
                                              "--episodes",
                                              "1",
                                              "--control-hz",
                                              GetParam()};
  std::vector<std::string> in_process = arguments;
  in_process.push_back("--in-process");
  Evaluate(arguments, folder.path() / "a");
  Evaluate(in_process, folder.path() / "b");
  ExpectSameScores(folder.path() / "a", folder.path() / "b");
  const RecordedLog log = ReadLog(LogFile(folder.path() / "a", 0));
  ExpectSameTicks(log, ReadLog(LogFile(folder.path() / "b", 0)));
  // The log has the reset state and the ticks of half a second.
  EXPECT_EQ(log.Payloads(channels::kState).size(), static_cast<size_t>(std::stoi(GetParam())) / 2 + 1);
}

INSTANTIATE_TEST_SUITE_P(Rates, DeterminismAt, testing::Values("20", "50", "500"),
                         [](const auto& test) { return std::string(test.param) + "Hz"; });

TEST(Determinism, AnEpisodeDoesNotDependOnTheEpisodesBeforeIt) {
  TemporaryFolder folder;
  const std::string task = ShortTask(folder.path(), 0.4) + "/position_and_orientation";
  const auto evaluate = [&](const char* name, const char* episodes, const char* seed) {
    Evaluate({task, "--policy", "random", "--in-process", "--episodes", episodes, "--seed", seed},
             folder.path() / name);
  };
  evaluate("one", "1", "7");
  evaluate("three", "3", "7");
  evaluate("five", "5", "7");
  const auto one = Episodes(folder.path() / "one"), three = Episodes(folder.path() / "three"),
             five = Episodes(folder.path() / "five");
  ASSERT_EQ(three.size(), 3u);
  ASSERT_EQ(five.size(), 5u);
  EXPECT_EQ(one[0], three[0]);
  for (size_t i = 0; i < 3; ++i) EXPECT_EQ(three[i], five[i]);
  ExpectSameTicks(ReadLog(LogFile(folder.path() / "three", 2)), ReadLog(LogFile(folder.path() / "five", 2)));
}

TEST(Determinism, TheLastOfThreeEpisodesIsTheSameAlone) {
  EVALBUS_NEEDS_BUS();
  TemporaryFolder folder;
  const std::string task = ShortTask(folder.path(), 0.4) + "/position_and_orientation";
  Evaluate({task, "--policy", "random", "--in-process", "--episodes", "3", "--seed", "7"},
           folder.path() / "three");
  const auto begin = ReadLog(LogFile(folder.path() / "three", 2)).Messages(channels::kEpisodeBegin).at(0);
  // The episode with the same seed and index is commanded to a pipeline that has not run any episode before.
  const std::string url = UniqueUrl();
  const std::string out = folder.path() / "alone";
  Program sim({"evalbus-sim", task, "--out", out, "--url", url});
  Program collision({"evalbus-collision", "--url", url}), metrics({"evalbus-metrics", "--url", url}),
      policy({"evalbus-policy", "--policy", "random", "--url", url}),
      recorder({"evalbus-recorder", "--out", out, "--url", url});
  command_t command{};
  command.kind = command_t::START_EPISODE;
  command.episode = begin.header.episode;
  command.seed = begin.seed;
  command.required_component = {"collision", "metrics", "policy", "recorder"};
  command.num_required = 4;
  command.required_instance.assign(command.required_component.size(), 0);
  Bus bus(url);
  auto commanded = SteadyTime::min();
  ASSERT_TRUE(WaitFor([&] {
    const auto now = std::chrono::steady_clock::now();
    if (commanded == SteadyTime::min() || now - commanded > std::chrono::milliseconds(200)) {
      bus.Publish(channels::kCommand, command);
      commanded = now;
    }
    return std::filesystem::exists(LogFile(out, 2));
  }));
  ExpectSameTicks(ReadLog(LogFile(folder.path() / "three", 2)), ReadLog(LogFile(out, 2)));
}

TEST(Determinism, SeedsDiffer) {
  TemporaryFolder folder;
  const std::string task = ShortTask(folder.path(), 0.1) + "/position";
  std::set<std::vector<uint8_t>> starts;
  for (const char* seed : {"0", "1", "-5"}) {
    const auto out = folder.path() / ("seed" + std::string(seed));
    Evaluate({task, "--policy", "hold", "--in-process", "--episodes", "3", "--seed", seed}, out);
    for (int episode = 0; episode < 3; ++episode) {
      auto state = ReadLog(LogFile(out, episode)).Messages(channels::kState).at(0);
      state.header.episode = 0;
      std::vector<uint8_t> bytes(static_cast<size_t>(state.getEncodedSize()));
      state.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
      starts.insert(bytes);
    }
  }
  EXPECT_EQ(starts.size(), 9u);
}

}  // namespace evalbus::determinism_test
