// Components of a run ignore messages of other sessions on its bus.
#include <set>

#include "bus/channels.h"
#include "tests/integration/harness.h"

namespace evalbus::forged_test {

namespace fs = std::filesystem;

// Answers the sim's messages with wrong ones of other sessions, as another run or a replayed log would.
class Forger {
 public:
  explicit Forger(const std::string& url) : bus_(url) {
    bus_.Subscribe(channels::kModel, [this](const model_info_t& model) {
      if (!own_.contains(Encode(model))) model_ = model;
    });
    bus_.Subscribe(channels::kEpisodeBegin, [this](const episode_begin_t& begin) {
      if (!own_.contains(Encode(begin))) Forge(begin);
    });
    bus_.Subscribe(channels::kState, [this](const state_t& state) {
      if (own_.contains(Encode(state))) return;
      if (state.header.tick % 10 == 5) Forge(begin_);
      ForgeTick(state);
    });
  }
  void Work() {
    while (bus_.Handle()) {
    }
  }
  int said() const { return said_; }

 private:
  // Publishes every answer to a STATE; each of them would change the result or end the episode.
  void ForgeTick(const state_t& state) {
    header_t header = state.header;
    for (const int64_t session : {int64_t{0}, model_.session + 1}) {
      header.session = session;
      state_t other = state;
      other.header = header;
      ++other.header.tick;
      Publish(channels::kState, other);
      contacts_t contacts{};
      contacts.header = header;
      Publish(channels::kContacts, contacts);
      action_t action{};
      action.header = header;
      action.mode = action_t::JOINT_POSITION;
      action.error = "forged";
      Publish(channels::kAction, action);
      partial_metrics_t partial{};
      partial.header = header;
      partial.verdict = partial_metrics_t::FAILURE;
      Publish(channels::kPartial, partial);
      component_status_t status{};
      status.session = session;
      status.instance = 1;
      status.state = component_status_t::READY;
      status.episode = header.episode;
      for (const char* name : {"sim", "policy", "metrics", "collision", "recorder"}) {
        status.component = name;
        Publish(channels::kStatus, status);
      }
      episode_end_t end{};
      end.header = header;
      end.end_reason = "failure";
      Publish(channels::kEpisodeEnd, end);
      episode_summary_t summary{};
      summary.header = header;
      Publish(channels::kEpisodeSummary, summary);
      command_t command{};
      command.session = session;
      command.kind = command_t::STOP;
      Publish(channels::kCommand, command);
    }
  }
  template <class Message>
  void Publish(const Channel<Message>& channel, const Message& message) {
    own_.insert(Encode(message));
    bus_.Publish(channel, message);
    ++said_;
  }
  void Forge(const episode_begin_t& begin) {
    begin_ = begin;
    for (const int64_t session : {int64_t{0}, model_.session + 1}) {
      model_info_t model = model_;
      model.session = session;
      model.message_version = model_info_t::VERSION + 1;
      Publish(channels::kModel, model);
      model = model_;
      model.session = session;
      model.task_yaml.replace(model.task_yaml.find("title"), 5, "ti4le");
      Publish(channels::kModel, model);
      model = model_;
      model.session = session;
      model.physics_file = "/nowhere/physics.mjb";
      model.visual_file = "/nowhere/visual.mjb";
      model.visual_sha256 = model.physics_sha256 = "none";
      Publish(channels::kModel, model);
      episode_begin_t other = begin;
      other.header.session = session;
      Publish(channels::kEpisodeBegin, other);
      other.seed += 1;
      Publish(channels::kEpisodeBegin, other);
      other.header.episode = 77;
      other.header.attempt = 1;
      Publish(channels::kEpisodeBegin, other);
    }
  }

  Bus bus_;
  model_info_t model_{};
  episode_begin_t begin_{};
  std::set<std::vector<uint8_t>> own_;
  int said_ = 0;
};

TEST(Forged, MessagesOfOtherSessionsAreIgnored) {
  EVALBUS_NEEDS_BUS();
  TemporaryFolder folder;
  const std::string task = ShortTask(folder.path(), 1), url = UniqueUrl();
  const fs::path reference = folder.path() / "reference", run = folder.path() / "run";
  const std::vector<std::string> arguments = {"evalbus", "run",      task,          "--episodes",
                                              "2",       "--policy", "noisy_expert"};
  auto command = arguments;
  command.insert(command.end(), {"--in-process", "--out", reference});
  ASSERT_EQ(RunProgram(command).code, 0);
  Forger forger(url);
  Program viz({"evalbus-viz", "--url", url, "--size", "64x48", "--fps", "2"});
  ASSERT_TRUE(WaitFor([&] { return viz.out().find("ready") != std::string::npos; })) << viz.err();
  command = arguments;
  command.insert(command.end(), {"--url", url, "--out", run});
  Program launcher(command);
  ASSERT_TRUE(WaitFor([&] {
    forger.Work();
    return !launcher.running();
  }));
  EXPECT_EQ(launcher.Wait(), 0) << launcher.err();
  EXPECT_GT(forger.said(), 50);
  EXPECT_EQ(launcher.out().find("retrying"), std::string::npos) << launcher.out();
  ExpectSameScores(run, reference);
  for (int i = 0; i < 2; ++i) {
    const RecordedLog log = ReadLog(LogFile(run, i));
    ExpectSameTicks(log, ReadLog(LogFile(reference, i)));
    for (const model_info_t& model : log.Messages(channels::kModel)) {
      EXPECT_EQ(model.message_version, model_info_t::VERSION);
      EXPECT_EQ(model.session, 0);
    }
    for (const episode_begin_t& begin : log.Messages(channels::kEpisodeBegin))
      EXPECT_EQ(begin.header.episode, i);
  }
  for (const char* component : {"sim", "metrics", "collision", "policy", "recorder"}) {
    ExpectLogged(run, component, "info", "came from another run, or from a log being played");
  }
  EXPECT_NE(launcher.out().find("warning: another run, or a log being played"), std::string::npos)
      << launcher.out();
  // viz runs at the lowest priority and receives the rest later.
  EXPECT_TRUE(
      WaitFor([&] { return !viz.running() || viz.err().find("ignoring a MODEL: ") != std::string::npos; }));
  EXPECT_TRUE(viz.running()) << viz.err();
}

}  // namespace evalbus::forged_test
