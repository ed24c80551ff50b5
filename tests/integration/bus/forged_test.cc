// Somebody says MODEL and EPISODE_BEGIN beside a run's sim: nobody takes them for the run's.
#include <set>

#include "bus/channels.h"
#include "tests/integration/harness.h"

namespace evalbus::forged_test {

namespace fs = std::filesystem;

// Answers what the sim says with what is wrong in every way.
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
      if (state.header.tick % 10 == 5) Forge(begin_);
    });
  }
  void Work() {
    while (bus_.Handle()) {
    }
  }
  int said() const { return said_; }

 private:
  template <class Message>
  void Say(const Channel<Message>& channel, const Message& message) {
    own_.insert(Encode(message));
    bus_.Publish(channel, message);
    ++said_;
  }
  void Forge(const episode_begin_t& begin) {
    begin_ = begin;
    for (const int64_t session : {int64_t{0}, model_.session + 1}) {
      model_info_t model = model_;
      model.session = session;
      model.message_version = 7;
      Say(channels::kModel, model);
      model = model_;
      model.session = session;
      model.task_yaml.replace(model.task_yaml.find("title"), 5, "ti4le");
      Say(channels::kModel, model);
      model = model_;
      model.session = session;
      model.physics_file = "/nowhere/physics.mjb";
      model.visual_file = "/nowhere/visual.mjb";
      model.visual_sha256 = model.physics_sha256 = "none";
      Say(channels::kModel, model);
      episode_begin_t other = begin;
      other.session = session;
      Say(channels::kEpisodeBegin, other);
      other.seed += 1;
      Say(channels::kEpisodeBegin, other);
      other.header.episode = 77;
      other.header.attempt = 1;
      Say(channels::kEpisodeBegin, other);
    }
  }

  Bus bus_;
  model_info_t model_{};
  episode_begin_t begin_{};
  std::set<std::vector<uint8_t>> own_;
  int said_ = 0;
};

TEST(Forged, ModelsAndBeginningsAreNotObeyed) {
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
  EXPECT_EQ(launcher.out().find("begun again"), std::string::npos) << launcher.out();
  ExpectSameScores(run, reference);
  for (int i = 0; i < 2; ++i) {
    const RecordedLog log = ReadLog(LogFile(run, i));
    ExpectSameTicks(log, ReadLog(LogFile(reference, i)));
    for (const model_info_t& model : log.Messages(channels::kModel)) {
      EXPECT_EQ(model.message_version, model_info_t::VERSION);
      EXPECT_NE(model.session, 0);
    }
    for (const episode_begin_t& begin : log.Messages(channels::kEpisodeBegin))
      EXPECT_EQ(begin.header.episode, i);
  }
  ExpectLogged(run, "sim", "warning", "a MODEL of another run is on this bus");
  ExpectLogged(run, "metrics", "info", "MODEL or EPISODE_BEGIN of another run");
  // It draws at the lowest priority, and hears the rest later.
  EXPECT_TRUE(WaitFor(
      [&] { return !viz.running() || viz.err().find("passes over a MODEL: ") != std::string::npos; }));
  EXPECT_TRUE(viz.running()) << viz.err();
}

}  // namespace evalbus::forged_test
