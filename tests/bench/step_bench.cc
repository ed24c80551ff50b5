// Measures a whole step of a policy behind a server, from one observation to the next, with no, one and three
// cameras, on the bus and in one process, in lockstep and in real time. The step is compared with two of its
// parts: rendering the images and calling the server, which answers immediately. The rest is physics,
// collision checking, metrics and the bus.
//
// Also reports the fraction of a step during which no thread of the run was running or runnable. A lockstep
// run waits for nothing, so the benchmark fails if this fraction is more than half. It also fails if a
// real-time run makes too few calls.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <filesystem>
#include <fstream>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "base/arguments.h"
#include "base/errors.h"
#include "bus/private_network.h"
#include "models/scene.h"
#include "policy_bridge/contract/image_form.h"
#include "runner/launch.h"
#include "runner/prepared_run.h"
#include "tests/bench/rounds.h"
#include "tests/doubles/policy_server.h"
#include "viz/images/painter/gl_context.h"
#include "viz/images/view_image.h"

namespace evalbus {
namespace {

namespace fs = std::filesystem;
using policy::Map;
using policy::PolicyServerDouble;
using policy::Value;
using std::chrono::steady_clock;

constexpr double kControlHz = 20;
constexpr const char* kCameras[] = {"roboeval/head", "roboeval/left_wrist", "roboeval/right_wrist"};
// Joint motion per tick, large enough that most of an image changes.
constexpr double kStepRad = 0.01;
// Calls that are not counted, during which programs and the renderer start.
constexpr int kWarmUp = 10;

double SecondsBetween(steady_clock::time_point from, steady_clock::time_point to) {
  return std::chrono::duration<double>(to - from).count();
}

// Returns the time (s) for which the threads of this process and of its children have been running or waiting
// for a processor since they started. Returns nullopt if the kernel does not report it (CONFIG_SCHED_INFO).
std::optional<double> BusySeconds() {
  std::vector<std::string> processes = {"self"};
  for (size_t i = 0; i < processes.size(); ++i) {
    for (const auto& task : fs::directory_iterator("/proc/" + processes[i] + "/task")) {
      std::ifstream children(task.path() / "children");
      for (std::string child; children >> child;) processes.push_back(child);
    }
  }
  double busy_ns = 0;
  for (const std::string& process : processes) {
    for (const auto& task : fs::directory_iterator("/proc/" + process + "/task")) {
      std::ifstream stat(task.path() / "schedstat");
      double ran = 0, waited = 0;
      if (!(stat >> ran >> waited)) return std::nullopt;
      busy_ns += ran + waited;
    }
  }
  return busy_ns * 1e-9;
}

struct Images {
  int count, width, height;
};

struct Setting {
  Images images;
  bool in_process, realtime;
};

std::string ContractText(const Images& images, const std::string& url) {
  std::string text = "wire: openpi\nurl: " + url + fmt::format("\nrate_hz: {}\nobservation:\n", kControlHz);
  for (int i = 0; i < images.count; ++i) {
    text += fmt::format("  - {{key: image{}, camera: {}, size_px: [{}, {}]}}\n", i, kCameras[i], images.width,
                        images.height);
  }
  return text +
         "  - {key: state, state: [left.joint_position_rad, right.joint_position_rad]}\n"
         "action:\n  kind: joint_position\n  values: 14\n  execute_steps: 1\n"
         "  arms: [{arm: left, indices: 0-6}, {arm: right, indices: 7-13}]\n";
}

// A policy that moves all joints back and forth and measures how often it is called.
class Server {
 public:
  explicit Server(int calls)
      : calls_(calls),
        double_({.answer = [this](const Value& observation) { return Answer(observation); },
                 .keeps_requests = false}) {}

  std::string url() const { return double_.url(); }
  int num_calls() const { return num_calls_; }
  // Median over the calls after the warm-up.
  double step_s() const { return Median(steps_s_); }
  // 1 - (busy time summed over all threads) / (elapsed time), at least 0. If no two threads are busy at the
  // same time, this is the fraction of the time in which no thread is busy.
  std::optional<double> idle_share() const {
    if (!busy_from_s_ || !busy_to_s_) return std::nullopt;
    return std::max(0.0, 1 - (*busy_to_s_ - *busy_from_s_) / SecondsBetween(from_, last_));
  }

 private:
  PolicyServerDouble::Answer Answer(const Value& observation) {
    const auto now = steady_clock::now();
    if (num_calls_ == kWarmUp) {
      from_ = now;
      busy_from_s_ = BusySeconds();
    } else if (num_calls_ > kWarmUp && num_calls_ < calls_) {
      steps_s_.push_back(SecondsBetween(last_, now));
      if (num_calls_ == calls_ - 1) busy_to_s_ = BusySeconds();
    }
    if (num_calls_ < calls_) last_ = now;
    std::vector<double> joints = Numbers(*observation.Find("state")->As<policy::Array>());
    for (double& joint : joints) joint += num_calls_ % 20 < 10 ? kStepRad : -kStepRad;
    ++num_calls_;
    return Value(Map{{"actions", policy::FloatArray(joints, {1, static_cast<int64_t>(joints.size())})}});
  }

  const int calls_;
  std::atomic<int> num_calls_ = 0;
  steady_clock::time_point from_{}, last_{};
  std::optional<double> busy_from_s_, busy_to_s_;
  std::vector<double> steps_s_;
  PolicyServerDouble double_;
};

// Returns the milliseconds for rendering the images of one step, one after the other, in this process.
double DrawingMs(const Images& images) {
  if (images.count == 0) return 0;
  viz::UseGl("osmesa");
  const TaskDescription task = FindTask("lift_pot").task;
  Scene scene = BuildScene(task, LoadRobot(task.robot_file));
  std::vector<double> qpos(scene.visual->qpos0, scene.visual->qpos0 + scene.visual->nq);
  for (const arm_info_t& arm : scene.info.arm) {
    for (size_t i = 0; i < arm.joint_qpos_index.size(); ++i) {
      qpos[static_cast<size_t>(arm.joint_qpos_index[i])] = arm.joint_home_rad[i];
    }
  }
  viz::Renderer renderer(std::move(scene.visual), {images.width, images.height});
  state_t state{};
  std::vector<double> times_ms;
  for (int round = 0; round < 12; ++round) {
    for (const arm_info_t& arm : scene.info.arm) {
      for (const int32_t joint : arm.joint_qpos_index) qpos[static_cast<size_t>(joint)] += kStepRad;
    }
    state.qpos_mixed = qpos;
    state.num_qpos = static_cast<int32_t>(qpos.size());
    state.header.tick = round;
    const auto begin = steady_clock::now();
    renderer.SetState(state);
    for (int i = 0; i < images.count; ++i) {
      view_t view{};
      view.camera = kCameras[i];
      view.width_px = images.width;
      view.height_px = images.height;
      view.shadows = 1;
      view.encoding = "rgb8";
      image_t image{};
      viz::DrawView(view, state.header, &renderer, &image);
      if (image.data.size() != static_cast<size_t>(3 * images.width * images.height)) {
        throw EnvironmentError("an image has another size");
      }
    }
    if (round > 1) times_ms.push_back(SecondsBetween(begin, steady_clock::now()) * 1e3);
  }
  return Median(times_ms);
}

// Returns the milliseconds from an observation to the answer: encoding, loopback, decoding, answering, and
// back.
double CallMs(const Images& images) {
  Server server(0);
  policy::ClientOptions options;
  options.url = server.url();
  const auto client = MakePolicyClient(options);
  client->Connect();
  Map observation;
  for (int i = 0; i < images.count; ++i) {
    policy::Array array{"|u1", {images.height, images.width, 3}, {}};
    array.data.assign(static_cast<size_t>(3 * images.width * images.height), 7);
    observation.emplace_back(fmt::format("image{}", i), std::move(array));
  }
  observation.emplace_back("state", policy::FloatArray(std::vector<double>(14, 0.1), {14}));
  std::vector<double> times_ms;
  for (int round = 0; round < 20; ++round) {
    const auto begin = steady_clock::now();
    client->Infer(observation);
    times_ms.push_back(SecondsBetween(begin, steady_clock::now()) * 1e3);
  }
  return Median(times_ms);
}

class EpisodeCheck : public runner::RunListener {
 public:
  void OnEpisodeDone(const nlohmann::ordered_json& episode) override {
    complete_ = complete_ || episode["complete"].get<bool>();
  }
  bool complete() const { return complete_; }

 private:
  bool complete_ = false;
};

std::string NameOf(const Setting& setting) {
  const Images& images = setting.images;
  return fmt::format(
      "{:<12} {:<11} {:<9}",
      images.count == 0 ? "no camera" : fmt::format("{} x {}x{}", images.count, images.width, images.height),
      setting.in_process ? "one process" : "bus", setting.realtime ? "real time" : "lockstep");
}

void Measure(const Setting& setting, int calls, const fs::path& folder) {
  Server server(calls);
  const fs::path contract = folder / "contract.yaml";
  std::ofstream(contract) << ContractText(setting.images, server.url());
  runner::RunOptions options;
  options.sim.task = (folder / "task.yaml").string() + "/base";
  options.sim.control_hz = kControlHz;
  options.sim.realtime = setting.realtime;
  options.policy.policy = contract;
  options.episodes = 1;
  options.out = folder / "run";
  const ReservedBus bus = setting.in_process ? ReservedBus() : ReservedBus::Draw();
  options.url = bus.url();
  options.in_process = setting.in_process;
  runner::PreparedRun run = runner::PrepareRun(options);
  runner::Announce(&run);
  EpisodeCheck check;
  const auto evaluate = setting.in_process ? runner::EvaluateInProcess : runner::EvaluateProcesses;
  evaluate(run.options, run.folder, run.plan, &check);
  fs::remove_all(options.out);
  if (!check.complete()) throw EnvironmentError("the timed episode is incomplete");

  const Images& images = setting.images;
  const std::string name = NameOf(setting);
  if (setting.realtime) {
    fmt::print("{}  called at {} of {} ticks\n", name, server.num_calls(), calls);
    if (server.num_calls() * 10 < calls) throw EnvironmentError("the policy was hardly asked in real time");
  } else {
    const auto idle = server.idle_share();
    fmt::print("{} {:7.1f} ms a step, {:4.0f} /s; drawing {:5.1f} ms, call {:4.1f} ms; idle {}\n", name,
               server.step_s() * 1e3, 1 / server.step_s(), DrawingMs(images), CallMs(images),
               idle ? fmt::format("{:.0f} %", *idle * 100) : "not known");
    if (server.num_calls() < calls) throw EnvironmentError("the policy was not asked at every tick");
    if (idle.value_or(0) > 0.5) throw EnvironmentError("the machine is idle during more than half of a step");
  }
  std::fflush(stdout);
}

// Writes the task lift_pot with a time limit of `ticks` ticks.
void WriteTask(const fs::path& file, int ticks) {
  std::ifstream stream(fs::path(EVALBUS_SOURCE_DIR) / "models/tasks/lift_pot.yaml");
  const std::string models = (fs::path(EVALBUS_SOURCE_DIR) / "models").string() + "/";
  std::ofstream out(file);
  for (std::string line; std::getline(stream, line);) {
    for (size_t at = line.find("../"); at != std::string::npos; at = line.find("../"))
      line.replace(at, 3, models);
    if (line.starts_with("time_limit_s:")) line = fmt::format("time_limit_s: {}", ticks / kControlHz);
    out << line << "\n";
  }
}

// `only` selects the measurements whose names contain it.
void MeasureAll(int calls, const std::string& only, const fs::path& folder) {
  const bool is_brief = calls < 100;
  WriteTask(folder / "task.yaml", calls);
  std::vector<Images> all = {{0, 0, 0}, {1, 224, 224}, {3, 224, 224}, {1, 640, 480}, {3, 640, 480}};
  if (is_brief) all = {{0, 0, 0}, {1, 64, 64}};
  for (const Images& images : all) {
    for (const bool realtime : {false, true}) {
      for (const bool in_process : {false, true}) {
        const Setting setting{images, in_process, realtime};
        if (NameOf(setting).find(only) != std::string::npos) Measure(setting, calls, folder);
      }
    }
  }
}

}  // namespace
}  // namespace evalbus

int main(int argc, char** argv) {
  CLI::App app{"Times a whole step of a policy behind a server, with and without cameras, beside its parts."};
  int calls = 200;
  std::string only;
  app.add_option("--calls", calls, "calls of the policy in each run; fewer than 100: small images only")
      ->capture_default_str()
      ->check(CLI::Range(20, 10000));
  app.add_option("--only", only, "part of the lines that are measured: 'one process lockstep'");
  if (const auto code = evalbus::ParseArguments(&app, argc, argv)) return *code;
  return evalbus::RunInFolder([&](const std::filesystem::path& folder) {
    evalbus::EnterPrivateNetwork();
    evalbus::MeasureAll(calls, only, folder);
  });
}
