// Tests faults during a run: killed processes, stops, and messages that do not belong to it.
#include <signal.h>

#include <algorithm>
#include <random>
#include <regex>
#include <set>

#include "bus/channels.h"
#include "evalbus/action_t.hpp"
#include "evalbus/command_t.hpp"
#include "evalbus/contacts_t.hpp"
#include "evalbus/episode_begin_t.hpp"
#include "evalbus/episode_end_t.hpp"
#include "evalbus/episode_summary_t.hpp"
#include "evalbus/partial_metrics_t.hpp"
#include "evalbus/state_t.hpp"
#include "tests/integration/harness.h"

namespace evalbus::faults_test {

namespace fs = std::filesystem;

// Runs the expert at 200 Hz, which takes long enough in wall time to be disturbed in the middle.
const std::vector<std::string> kRun = {"lift_pot/position_and_orientation", "--control-hz", "200", "--seed",
                                       "1"};

std::vector<std::string> RunCommand(const fs::path& out, const std::string& episodes,
                                    const std::vector<std::string>& more = {}) {
  std::vector<std::string> command = {"evalbus", "run", "--out", out, "--episodes", episodes};
  command.insert(command.end(), kRun.begin(), kRun.end());
  command.insert(command.end(), more.begin(), more.end());
  return command;
}

// Returns whether the run is in the middle of its second episode.
bool InSecondEpisode(const fs::path& run) {
  std::error_code error;
  return fs::file_size(run / "episodes/0001.partial/events.lcmlog", error) > 100'000 && !error;
}

int CountLines(const std::string& text) {
  return static_cast<int>(std::count(text.begin(), text.end(), '\n'));
}

class KillOf : public testing::TestWithParam<const char*> {};

TEST_P(KillOf, AComponentInMidRunChangesNoScore) {
  EVALBUS_NEEDS_BUS();
  TemporaryFolder folder;
  const fs::path reference = folder.path() / "reference", run = folder.path() / "run";
  ASSERT_EQ(RunProgram(RunCommand(reference, "3", {"--in-process"})).code, 0);
  Program launcher(RunCommand(run, "3"));
  ASSERT_TRUE(WaitFor([&] { return InSecondEpisode(run); })) << launcher.out() << launcher.err();
  const std::string program = std::string("evalbus-") + GetParam();
  const auto children = ChildrenOf(launcher.pid(), program);
  ASSERT_EQ(children.size(), 1u);
  ASSERT_EQ(kill(children[0], SIGKILL), 0);
  EXPECT_EQ(launcher.Wait(), 0) << launcher.err();
  EXPECT_NE(launcher.out().find("retrying: " + std::string(GetParam()) + " was ended by signal Killed"),
            std::string::npos)
      << launcher.out();
  ExpectSameScores(run, reference);
  for (int i = 0; i < 3; ++i) ExpectSameTicks(ReadLog(LogFile(run, i)), ReadLog(LogFile(reference, i)));
  EXPECT_FALSE(fs::exists(run / "episodes/0001.partial"));
  ExpectLogged(run, "run", "warning", "retrying: " + std::string(GetParam()) + " was ended by signal Killed");
  for (int i = 0; i < 3; ++i) {
    ExpectLogged(run, "recorder", "info", "closed and synced " + LogFile(run, i).string());
    ExpectLogged(run, "sim", "info", "e" + std::to_string(i));
  }
}

INSTANTIATE_TEST_SUITE_P(Each, KillOf, testing::Values("sim", "collision", "metrics", "policy", "recorder"),
                         [](const auto& test) { return std::string(test.param); });

TEST(Faults, AComponentThatNeverWorksEndsTheRun) {
  EVALBUS_NEEDS_BUS();
  TemporaryFolder folder;
  const fs::path run = folder.path() / "run";
  Program launcher(RunCommand(run, "1"));
  std::set<pid_t> killed;
  ASSERT_TRUE(WaitFor([&] {
    for (const pid_t child : ChildrenOf(launcher.pid(), "evalbus-collision")) {
      if (killed.insert(child).second) kill(child, SIGKILL);
    }
    return !launcher.running();
  }));
  EXPECT_EQ(launcher.Wait(), 2);
  EXPECT_EQ(killed.size(), 3u);
  EXPECT_EQ(CountLines(launcher.err()), 1) << launcher.err();
  EXPECT_NE(launcher.err().find("collision was ended by signal Killed"), std::string::npos) << launcher.err();
  EXPECT_FALSE(fs::exists(run));
}

TEST(Faults, KilledLauncherLeavesNoProcessesAndWholeEpisodes) {
  EVALBUS_NEEDS_BUS();
  TemporaryFolder folder;
  const fs::path run = folder.path() / "run";
  Program launcher(RunCommand(run, "50"));
  ASSERT_TRUE(WaitFor([&] { return InSecondEpisode(run); })) << launcher.err();
  const auto children = ChildrenOf(launcher.pid());
  EXPECT_EQ(children.size(), 5u);
  launcher.Signal(SIGKILL);
  EXPECT_EQ(launcher.Wait(), 128 + SIGKILL);
  for (const pid_t child : children) {
    EXPECT_TRUE(WaitFor([&] {
      // A dead process without a parent that waits for it may remain as a zombie.
      const std::string stat = ReadText("/proc/" + std::to_string(child) + "/stat");
      return stat.empty() || stat.find(") Z ") != std::string::npos;
    })) << child;
  }
  const auto episodes = Episodes(run);
  ASSERT_GE(episodes.size(), 1u);
  EXPECT_EQ(episodes[0]["episode"], 0);
  EXPECT_EQ(episodes[0]["complete"], true);
  const RecordedLog log = ReadLog(LogFile(run, 0));
  EXPECT_EQ(log.damaged_bytes, 0);
  EXPECT_EQ(log.events.back().channel, channels::kRunSummary);
}

class StopBy : public testing::TestWithParam<std::tuple<int, bool>> {};

TEST_P(StopBy, SignalKeepsWhatIsFinished) {
  const auto [signal, in_process] = GetParam();
  if (!in_process) EVALBUS_NEEDS_BUS();
  TemporaryFolder folder;
  const fs::path run = folder.path() / "run";
  Program launcher(RunCommand(
      run, "50", in_process ? std::vector<std::string>{"--in-process"} : std::vector<std::string>{}));
  ASSERT_TRUE(WaitFor([&] { return InSecondEpisode(run); })) << launcher.err();
  launcher.Signal(signal);
  EXPECT_EQ(launcher.Wait(), 2);
  EXPECT_EQ(CountLines(launcher.err()), 1) << launcher.err();
  EXPECT_TRUE(launcher.err().starts_with("error: stopped after ")) << launcher.err();
  const auto episodes = Episodes(run);
  ASSERT_GE(episodes.size(), 1u);
  const auto summary = nlohmann::json::parse(ReadText(run / "summary.json"));
  EXPECT_EQ(summary["episodes"], episodes.size());
  for (size_t i = 0; i < episodes.size(); ++i) {
    EXPECT_EQ(ReadLog(LogFile(run, static_cast<int>(i))).events.back().channel, channels::kRunSummary);
  }
}

TEST(StopBeforeTheFirstEpisode, LeavesNoFolderWithADefaultName) {
  TemporaryFolder folder;
  const auto has_begun = [&](const fs::path& runs) {
    if (!fs::exists(runs)) return false;
    return std::ranges::any_of(fs::directory_iterator(runs), [](const fs::directory_entry& run) {
      return fs::exists(run.path() / "episodes/0000.partial/events.lcmlog");
    });
  };
  std::vector<std::string> command = {"evalbus",    "run",          "lift_pot/position", "--policy", "hold",
                                      "--realtime", "--in-process", "--episodes",        "2"};
  for (const bool is_named : {false, true}) {
    if (is_named) command.insert(command.end(), {"--out", "runs/mine"});
    Program launcher(command, {.working_folder = folder.path(), .before = {}});
    ASSERT_TRUE(WaitFor([&] { return has_begun(folder.path() / "runs"); })) << launcher.err();
    launcher.Signal(SIGINT);
    EXPECT_EQ(launcher.Wait(), 2);
    EXPECT_TRUE(launcher.err().starts_with("error: stopped ")) << launcher.err();
    EXPECT_EQ(fs::exists(folder.path() / "runs"), is_named) << "a name of the user is kept";
  }
}

INSTANTIATE_TEST_SUITE_P(Signals, StopBy, testing::Combine(testing::Values(SIGINT, SIGTERM), testing::Bool()),
                         [](const auto& test) {
                           return std::string(std::get<0>(test.param) == SIGINT ? "Int" : "Term") +
                                  (std::get<1>(test.param) ? "InProcess" : "Processes");
                         });

// Publishes into a run on every channel.
class Heckler {
 public:
  explicit Heckler(const std::string& url) : bus_(url) {
    bus_.SubscribeRaw("EVALBUS_.*", [this](std::string_view channel, std::span<const uint8_t> data, int64_t) {
      Receive(std::string(channel), data);
    });
  }

  void Listen() {
    while (bus_.Handle()) {
    }
  }

  int said() const { return said_; }

 private:
  void Publish(const std::string& channel, std::span<const uint8_t> data) {
    own_.emplace(data.begin(), data.end());
    bus_.PublishRaw(channel.c_str(), data);
    ++said_;
  }
  template <class Message>
  void PublishMessage(const Channel<Message>& channel, const Message& message) {
    Publish(channel.name, Encode(message));
  }
  // Publishes the message as if it belonged to another episode.
  template <class Message>
  void PublishForeign(const std::string& channel, std::span<const uint8_t> data) {
    Message message{};
    ASSERT_TRUE(Decode(data, &message));
    message.header.episode = 77;
    Publish(channel, Encode(message));
  }

  void Receive(const std::string& channel, std::span<const uint8_t> data) {
    const std::vector<uint8_t> bytes(data.begin(), data.end());
    if (const auto own = own_.find(std::string(data.begin(), data.end())); own != own_.end()) {
      own_.erase(own);
      return;
    }
    const bool tick = channel == channels::kState || channel == channels::kContacts ||
                      channel == channels::kAction || channel == channels::kPartial;
    // Attacks 4 of 16 tick messages and every message of another kind.
    if (tick && ++received_ % 16 >= 4) return;
    // Publishes noise of a random length.
    std::vector<uint8_t> noise(random_() % 200);
    for (uint8_t& byte : noise) byte = static_cast<uint8_t>(random_());
    Publish(channel, noise);
    // Publishes the right type, truncated and too long.
    Publish(channel, std::span(bytes).first(bytes.size() - 1));
    std::vector<uint8_t> longer = bytes;
    longer.push_back(0);
    Publish(channel, longer);
    // Publishes the right type with absurd counts: all bytes are 0xFF, starting with the header's simulated
    // time.
    std::vector<uint8_t> absurd = bytes;
    for (size_t i = 32; i < absurd.size(); ++i) absurd[i] = 0xFF;
    Publish(channel, absurd);
    // Publishes a wrong type with a plausible header, which has this episode and a tick far ahead.
    header_t header{};
    if (tick && header._decodeNoHash(data.data(), 8, static_cast<int>(data.size()) - 8) > 0) {
      header.tick += 1000;
      header.sim_time_us += 1'000'000'000;
      std::vector<uint8_t> wrong(8 + static_cast<size_t>(header._getEncodedSizeNoHash()) + 50);
      header._encodeNoHash(wrong.data(), 8, static_cast<int>(wrong.size()) - 8);
      channels::ForEach([&]<class Message>(const Channel<Message>& other) {
        if constexpr (requires(Message message) { message.header; }) Publish(other.name, wrong);
      });
    }
    // Publishes the message as if it belonged to another episode.
    if (channel == channels::kState) PublishForeign<state_t>(channel, data);
    if (channel == channels::kContacts) PublishForeign<contacts_t>(channel, data);
    if (channel == channels::kAction) PublishForeign<action_t>(channel, data);
    if (channel == channels::kPartial) PublishForeign<partial_metrics_t>(channel, data);
    if (channel == channels::kPartial) {
      episode_end_t end{};
      end.header.episode = 77;
      end.end_reason = "failure";
      PublishMessage(channels::kEpisodeEnd, end);
      episode_summary_t summary{};
      summary.header.episode = 77;
      PublishMessage(channels::kEpisodeSummary, summary);
      command_t command{};
      command.kind = 9;
      PublishMessage(channels::kCommand, command);
    }
    // Repeats the message.
    if (tick || channel == channels::kCommand || channel == channels::kModel) Publish(channel, bytes);
  }

  Bus bus_;
  std::multiset<std::string> own_;
  std::mt19937 random_{1};
  int received_ = 0;
  int said_ = 0;
};

// Returns the number of messages that a component dropped for a reason, from its log. Its last STATUS cannot
// be used instead, because the flood of messages can displace it from the receive buffer.
int64_t Dropped(const fs::path& run, const std::string& component, const std::string& reason) {
  const std::string log = ReadText(run / "logs" / (component + ".log"));
  const std::regex line("dropped (\\d+) messages? " + reason);
  int64_t sum = 0;
  for (std::sregex_iterator i(log.begin(), log.end(), line), end; i != end; ++i) sum += std::stoll((*i)[1]);
  return sum;
}

TEST(Faults, ForeignAndMalformedMessagesChangeNoScore) {
  EVALBUS_NEEDS_BUS();
  TemporaryFolder folder;
  const fs::path reference = folder.path() / "reference", run = folder.path() / "run";
  ASSERT_EQ(RunProgram(RunCommand(reference, "2", {"--in-process"})).code, 0);
  const std::string url = UniqueUrl();
  Heckler heckler(url);
  Program launcher(RunCommand(run, "2", {"--url", url}));
  ASSERT_TRUE(WaitFor([&] {
    heckler.Listen();
    return !launcher.running();
  }));
  EXPECT_EQ(launcher.Wait(), 0) << launcher.err();
  EXPECT_GT(heckler.said(), 1000);
  EXPECT_EQ(launcher.out().find("retrying"), std::string::npos) << launcher.out();
  ExpectSameScores(run, reference);
  for (const char* name : {"sim", "collision", "metrics", "policy"}) {
    EXPECT_GT(Dropped(run, name, "that could not be decoded"), 10) << name;
    EXPECT_GT(Dropped(run, name, "that were repeated"), 10) << name;
  }
  EXPECT_GT(Dropped(run, "recorder", "that were repeated"), 10);
  for (int i = 0; i < 2; ++i) {
    const RecordedLog log = ReadLog(LogFile(run, i));
    EXPECT_EQ(log.damaged_bytes, 0);
    // Messages of other episodes do not advance the simulated time.
    EXPECT_LT(log.events.back().time_us, 20'000'000);
  }
}

}  // namespace evalbus::faults_test
