// Fuzzes the components and the observers of a run, each on a bus on which any message may arrive. The first
// byte of an input selects the component. The rest is a Conversation of messages of a real episode. If an
// error ends a component's process with one line of text, the input ends.
#include <cstdio>
#include <filesystem>
#include <optional>

#include "base/errors.h"
#include "base/random.h"
#include "base/sha256.h"
#include "bus/recorder/recorder.h"
#include "collision/collision_component.h"
#include "metrics/metrics_component.h"
#include "policy_bridge/policy_component.h"
#include "runner/live_view.h"
#include "runner/run_controller.h"
#include "sim/sim_component.h"
#include "tests/fuzz/conversation.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/small_scene.h"
#include "viz/camera_component.h"
#include "viz/terminal/monitor_screen.h"
#include "viz/viz_component.h"

namespace evalbus {
namespace {

using std::chrono::steady_clock;

// A terminal monitor that receives the messages.
class Monitor : public Component {
 public:
  explicit Monitor(Bus* bus) : Component(bus, "monitor") {
    bus->SubscribeRaw(".*", [this](std::string_view channel, std::span<const uint8_t> data, int64_t) {
      watch_.Receive(channel, data, steady_clock::now());
    });
  }
  void Poll(SteadyTime now) override {
    watch_.Update(now);
    for (const auto& [width, height] : {std::pair(200, 60), {80, 24}, {10, 3}}) {
      for (const viz::Line& line : viz::MonitorScreen(watch_, "memq://", width, height, now)) {
        viz::LineText(line);
      }
    }
    viz::ProgressLine(watch_);
    watch_.TakeEvents();
    watch_.SilentFor(now);
  }

 private:
  viz::RunWatch watch_{2};
};

// The parts of `evalbus run` that do not start processes.
class Launcher : public runner::RunController {
 public:
  Launcher(Bus* bus, const runner::RunPlan& plan, const results::RunFolder& folder, runner::LiveView* view)
      : runner::RunController(bus, plan, folder, view), view_(view) {
    ExpectStart();
  }
  void Poll(SteadyTime now) override {
    runner::RunController::Poll(now);
    Silent(now);
    view_->Lines(80, now);
  }

 private:
  runner::LiveView* view_;
};

void Drain(Bus* bus) {
  // Handling a message may cause another message, so the number is limited.
  for (int i = 0; i < 1000 && bus->Handle(); ++i) {
  }
}

class Run {
 public:
  static constexpr int kNumParts = 10, kRealtimeSim = 2, kExpert = 4;

  Run() {
    sim_.task = folder_.Write("small.yaml", SmallTask());
    sim_.out = folder_.path();
    Record();
    MakeExpertsSamples();
  }

  std::unique_ptr<Component> Make(int part, Bus* bus) {
    switch (part) {
      case 0:
        return std::make_unique<metrics::MetricsComponent>(bus);
      case 1:
        return std::make_unique<sim::SimComponent>(bus, sim_);
      case kRealtimeSim: {
        sim::SimOptions realtime = sim_;
        realtime.realtime = true;
        return std::make_unique<sim::SimComponent>(bus, realtime);
      }
      case 3:
        return std::make_unique<collision::CollisionComponent>(bus);
      case kExpert:
        return std::make_unique<policy::PolicyComponent>(bus, policy::PolicyOptions{"noisy_expert"});
      case 5:
        Clear();
        return std::make_unique<Recorder>(bus, folder_.path());
      case 6: {
        Clear();
        runner::RunPlan plan;
        plan.task = "small";
        plan.variation = "base";
        plan.episodes = {0, 1};
        plan.required = {"policy"};
        plan.realtime = plan.policy_is_external = true;
        model_info_t model{};
        Decode(samples_[channels::kModel.name].at(0), &model);
        plan.model_hashes = runner::ModelHashes::Of(model);
        runner::LiveHeader header;
        header.episodes = 2;
        view_.emplace(nowhere_, header);
        return std::make_unique<Launcher>(bus, plan, run_folder_, &*view_);
      }
      case 7:
        return std::make_unique<Monitor>(bus);
      case 9:
        return std::make_unique<viz::CameraComponent>(bus);
      default:
        return std::make_unique<viz::VizComponent>(bus, viz::VizOptions{{"overview"}, {32, 32}, 15});
    }
  }

  // Begins an episode for all components.
  void Begin(int part, Bus* bus) {
    component_status_t ready{};
    ready.component = "metrics";
    ready.state = component_status_t::READY;
    for (const char* channel :
         {channels::kCommand.name, channels::kModel.name, channels::kEpisodeBegin.name}) {
      // The realtime sim publishes MODEL itself.
      if (part == kRealtimeSim && channels::kModel == channel) continue;
      bus->PublishRaw(channel, samples(part).at(channel)[0]);
      Drain(bus);
    }
    bus->Publish(channels::kStatus, ready);
    Drain(bus);
  }

  const Samples& samples(int part) const { return part == kExpert ? experts_samples_ : samples_; }

 private:
  // Makes messages for the expert, which needs a task that it supports.
  void MakeExpertsSamples() {
    const TaskDescription task = FindTask("lift_pot").task;
    const RobotDescription robot = LoadRobot(task.robot_file);
    const Scene scene = BuildScene(task, robot);
    model_info_t model = scene.info;
    std::filesystem::create_directories(folder_.path() / "expert/model");
    model.physics_file = folder_.path() / "expert/model/physics.mjb";
    mj_saveModel(scene.physics.get(), model.physics_file.c_str(), nullptr, 0);
    model.physics_sha256 = Sha256File(model.physics_file);
    sim::World world(scene.physics.get(), scene.info, robot, task, 10);
    world.Reset(0, task.variations[0]);

    experts_samples_ = samples_;
    experts_samples_[channels::kModel.name] = {Encode(model)};
    experts_samples_[channels::kState.name].clear();
    state_t state{};
    for (; state.header.tick < 5; ++state.header.tick) {
      world.Fill(&state);
      experts_samples_[channels::kState.name].push_back(Encode(state));
      world.Step();
    }
  }

  // Records the messages of an episode of five ticks.
  void Record() {
    command_t command{};
    command.kind = command_t::START_EPISODE;
    command.seed = SeedSource{}.OfEpisode(0);
    samples_[channels::kCommand.name].push_back(Encode(command));
    command.kind = command_t::STOP;
    samples_[channels::kCommand.name].push_back(Encode(command));

    Bus bus("memq://");
    bus.SubscribeRaw(".*", [this](std::string_view channel, std::span<const uint8_t> data, int64_t) {
      samples_[std::string(channel)].emplace_back(data.begin(), data.end());
    });
    sim::SimOptions options = sim_;
    options.episodes = 1;
    collision::CollisionComponent collision(&bus);
    metrics::MetricsComponent metrics(&bus);
    policy::PolicyComponent policy(&bus, {"hold"});
    Recorder recorder(&bus, folder_.path());
    sim::SimComponent sim(&bus, options);
    while (!sim.done()) {
      sim.Poll(steady_clock::now());
      metrics.Poll(steady_clock::now());
      Drain(&bus);
    }
    // Adds the requests that a policy with cameras would have sent.
    image_request_t request{};
    for (const char* encoding : {"rgb8", "depth32"}) {
      request.view.push_back({"overview", 16, 12, 0, false, encoding});
      request.num_views = static_cast<int32_t>(request.view.size());
      state_t state{};
      Decode(samples_[channels::kState.name].at(request.view.size()), &state);
      request.header = state.header;
      samples_[channels::kRequestImage.name].push_back(Encode(request));
    }
  }

  void Clear() const {
    std::filesystem::remove_all(folder_.path() / "episodes");
    std::filesystem::remove(folder_.path() / "episodes.jsonl");
  }

  SmallScene folder_;
  sim::SimOptions sim_;
  Samples samples_, experts_samples_;
  results::RunFolder run_folder_ = results::RunFolder::OfWorker(folder_.path());
  FILE* nowhere_ = std::fopen("/dev/null", "w");
  std::optional<runner::LiveView> view_;
};

}  // namespace
}  // namespace evalbus

FUZZ_TARGET(components) {
  using namespace evalbus;
  if (size == 0) return 0;
  static Run run;
  const int part = *data % Run::kNumParts;
  Bus bus("memq://");
  try {
    const std::unique_ptr<Component> component = run.Make(part, &bus);
    auto now = std::chrono::steady_clock::now();
    const auto wait = [&](int tenths) {
      now += std::chrono::milliseconds(100 * tenths);
      component->Poll(now);
      Drain(&bus);
    };
    wait(0);
    // For other inputs, the component receives the messages before any episode has begun.
    if (*data < 128) run.Begin(part, &bus);
    const auto say = [&](const std::string& channel, const Bytes& message) {
      bus.PublishRaw(channel.c_str(), message);
      Drain(&bus);
    };
    Conversation({data + 1, size - 1}, run.samples(part)).Hold(say, wait);
    wait(20);
    component->Stop();
  } catch (const InputError&) {
  } catch (const EnvironmentError&) {
  }
  return 0;
}
