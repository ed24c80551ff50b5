// LCM's own tools work with a run and with its logs.
#include <signal.h>

#include <algorithm>
#include <sstream>

#include "bus/channels.h"
#include "evalbus/component_status_t.hpp"
#include "evalbus/episode_summary_t.hpp"
#include "evalbus/state_t.hpp"
#include "tests/integration/harness.h"

namespace evalbus::stock_tools_test {

namespace fs = std::filesystem;

// lcm-logger queues thirty messages and drops newer ones, so its log may lack some on a loaded machine.
TEST(StockTools, LoggerReceivesWhatTheRecorderRecords) {
  EVALBUS_NEEDS_BUS();
  TemporaryFolder folder;
  const std::string url = UniqueUrl(), file = folder.path() / "logger.lcmlog";
  Program logger(
      {"lcm-logger", "--lcm-url", url + "&recv_buf_size=4194304", "--flush-interval", "10", "--quiet", file});
  {
    // The logger is listening once a published message is in its file.
    Bus bus(url);
    auto said = SteadyTime::min();
    ASSERT_TRUE(WaitFor([&] {
      const auto now = std::chrono::steady_clock::now();
      if (said == SteadyTime::min() || now - said > std::chrono::milliseconds(20)) {
        bus.PublishRaw("HELLO", Encode(header_t{}));
        said = now;
      }
      return fs::exists(file) && fs::file_size(file) > 0;
    })) << logger.err();
  }
  const fs::path run = folder.path() / "run";
  Evaluate({"lift_pot/position", "--episodes", "2", "--realtime", "--rtf", "4", "--url", url}, run);
  logger.Signal(SIGINT);
  EXPECT_EQ(logger.Wait(), 0) << logger.err();
  std::vector<std::vector<uint8_t>> recorded;
  for (int i = 0; i < 2; ++i) {
    const auto states = ReadLog(LogFile(run, i)).Payloads(channels::kState);
    recorded.insert(recorded.end(), states.begin(), states.end());
  }
  EXPECT_GT(recorded.size(), 200u);
  auto logged = ReadLog(file).Payloads(channels::kState);
  EXPECT_FALSE(logged.empty());
  // The messages have the same order and bytes, except for the session, which is recorded as 0.
  auto next = recorded.begin();
  for (auto& state : logged) {
    EXPECT_NE(SessionOf(state), 0);
    SetSession(0, state);
    next = std::find(next, recorded.end(), state);
    ASSERT_NE(next, recorded.end()) << "the logger has a STATE that the recorder does not have";
    ++next;
  }
}

TEST(StockTools, PlayerBringsMetricsToTheSameSummary) {
  EVALBUS_NEEDS_BUS();
  TemporaryFolder folder;
  const fs::path run = folder.path() / "run";
  Evaluate({"lift_pot/position", "--episodes", "1", "--in-process"}, run);
  const auto recorded = ReadLog(LogFile(run, 0)).Payloads(channels::kEpisodeSummary);
  ASSERT_EQ(recorded.size(), 1u);

  const std::string url = UniqueUrl();
  Bus bus(url);
  std::vector<std::vector<uint8_t>> summaries;
  int64_t missing_ticks = 0;
  bus.SubscribeRaw(channels::kEpisodeSummary.name,
                   [&](std::string_view, std::span<const uint8_t> data, int64_t) {
                     summaries.emplace_back(data.begin(), data.end());
                   });
  bus.Subscribe(channels::kStatus,
                [&](const component_status_t& status) { missing_ticks += status.missing_ticks; });
  Program metrics({"evalbus-metrics", "--url", url});
  ASSERT_TRUE(WaitFor([&] { return metrics.out() == "metrics ready\n"; })) << metrics.err();
  Program player({"lcm-logplayer", "--lcm-url", url, "--regexp",
                  "EVALBUS_(MODEL|EPISODE_BEGIN|STATE|CONTACTS|EPISODE_END)", LogFile(run, 0)});
  EXPECT_TRUE(WaitFor([&] {
    bus.Handle();
    return !summaries.empty();
  })) << player.err();
  EXPECT_EQ(player.Wait(), 0) << player.err();
  EXPECT_EQ(summaries, recorded);
  EXPECT_EQ(missing_ticks, 0);
}

constexpr char kReader[] = R"(import struct, sys
sys.path.insert(0, sys.argv[1])
import evalbus
log = open(sys.argv[2], 'rb').read()
at, state = 0, None
while at < len(log):
    magic, number, time_us, channel_size, data_size = struct.unpack_from('>IqqII', log, at)
    assert magic == 0xEDA1DA01
    at += 28
    channel = log[at:at + channel_size].decode()
    data = log[at + channel_size:at + channel_size + data_size]
    at += channel_size + data_size
    if channel == 'EVALBUS_STATE':
        state = evalbus.state_t.decode(data)
        assert state.encode() == data
print(state.header.tick, *state.arm[1].wrist_position_m)
)";

TEST(StockTools, GeneratedPythonDecodesTheLog) {
  TemporaryFolder folder;
  const fs::path run = folder.path() / "run", python = folder.path() / "python";
  Evaluate({ShortTask(folder.path(), 0.5), "--policy", "random", "--episodes", "1", "--in-process"}, run);
  std::vector<std::string> generate = {"lcm-gen", "--python", "--ppath", python};
  for (const auto& entry : fs::directory_iterator(EVALBUS_SOURCE_DIR "/lcmtypes")) {
    if (entry.path().extension() == ".lcm") generate.push_back(entry.path());
  }
  fs::create_directory(python);
  ASSERT_EQ(RunProgram(generate).code, 0);
  WriteText(folder.path() / "read.py", kReader);
  const Result result = RunProgram({"python3", "-B", folder.path() / "read.py", python, LogFile(run, 0)});
  ASSERT_EQ(result.code, 0) << result.err;

  const state_t last = ReadLog(LogFile(run, 0)).Messages(channels::kState).back();
  std::istringstream words(result.out);
  int64_t tick = -1;
  double position[3] = {};
  words >> tick >> position[0] >> position[1] >> position[2];
  EXPECT_EQ(tick, last.header.tick);
  for (int k = 0; k < 3; ++k) EXPECT_EQ(position[k], last.arm[1].wrist_position_m[k]) << k;
}

// Checks that LCM's spy finds our types in the jar of scripts/spy by the fingerprints that identify messages.
constexpr char kTypes[] = R"(public class Types {
  public static void main(String[] names) throws Exception {
    for (String name : names) {
      long hash = Class.forName("evalbus." + name).getField("LCM_FINGERPRINT").getLong(null);
      System.out.println(name + " " + String.format("%016x", hash));
    }
  }
}
)";

TEST(StockTools, SpyKnowsOurTypes) {
  const Result jar = RunProgram({EVALBUS_SOURCE_DIR "/scripts/spy", "--jar"});
  if (jar.code == 2) GTEST_SKIP() << jar.err;
  ASSERT_EQ(jar.code, 0) << jar.err;
  TemporaryFolder folder;
  WriteText(folder.path() / "Types.java", kTypes);
  const std::string pinned = ReadText(EVALBUS_SOURCE_DIR "/tests/data/fingerprints.txt");
  std::vector<std::string> command = {"java", "-cp",
                                      jar.out.substr(0, jar.out.find('\n')) + ":/usr/share/java/lcm.jar",
                                      folder.path() / "Types.java"};
  std::istringstream lines(pinned);
  for (std::string name, hash; lines >> name >> hash;) command.push_back(name);
  const Result types = RunProgram(command);
  EXPECT_EQ(types.code, 0) << types.err;
  EXPECT_EQ(types.out, pinned);
}

}  // namespace evalbus::stock_tools_test
