// Measures which fraction of bare MuJoCo's speed the whole pipeline reaches. The pipeline has physics, FCL
// contacts, metrics, the scripted expert and the recorder, in one process and in separate processes. It is
// compared with mj_step alone on the same scene with the same commands. Both must end in the same state, bit
// for bit.
#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <lcm/lcm-cpp.hpp>
#include <sstream>

#include "base/errors.h"
#include "base/run_layout.h"
#include "bus/bus.h"
#include "bus/channels.h"
#include "bus/event_log.h"
#include "bus/private_network.h"
#include "bus/trace.h"
#include "evalbus/state_t.hpp"
#include "lcmtypes/clock.h"
#include "models/scene.h"
#include "runner/launch.h"
#include "runner/prepared_run.h"
#include "sim/world.h"
#include "tests/bench/hops.h"
#include "tests/bench/rounds.h"
#include "tests/bench/stopwatch.h"

namespace evalbus {
namespace {

using std::chrono::steady_clock;

constexpr double kTimestep = Stopwatch::kTimestep;

double SecondsSince(SteadyTime start) {
  return std::chrono::duration<double>(steady_clock::now() - start).count();
}

struct Recorded {
  episode_begin_t begin{};
  std::vector<state_t> states;
};

Recorded ReadEpisode(const std::filesystem::path& file) {
  Recorded recorded;
  EventLogReader log(file);
  LogEvent event;
  while (log.Next(&event)) {
    if (event.channel == channels::kEpisodeBegin) Decode(event.data, &recorded.begin);
    if (event.channel == channels::kState) {
      recorded.states.emplace_back();
      if (!Decode(event.data, &recorded.states.back())) throw EnvironmentError("STATE does not decode");
    }
  }
  return recorded;
}

// Measures the microseconds per physics step of MuJoCo alone, from the same initial states and with the
// recorded commands.
class BareStepping {
 public:
  BareStepping(const std::string& task, int substeps)
      : selection_(FindTask(task)),
        robot_(LoadRobot(selection_.task.robot_file)),
        scene_(BuildScene(selection_.task, robot_)),
        model_(scene_.physics.get()),
        world_(model_, scene_.info, robot_, selection_.task, substeps),
        data_(mj_makeData(model_)),
        substeps_(substeps) {}

  double Time(const std::vector<Recorded>& episodes) {
    double wall = 0, steps = 0;
    for (const Recorded& episode : episodes) {
      world_.Reset(episode.begin.seed, selection_.task.variation(selection_.variation));
      mj_copyData(data_.get(), model_, &world_.data());
      const auto start = steady_clock::now();
      for (size_t tick = 1; tick < episode.states.size(); ++tick) {
        mju_copy(data_->ctrl, episode.states[tick].ctrl_mixed.data(), model_->nu);
        for (int i = 0; i < substeps_; ++i) {
          mj_step2(model_, data_.get());
          mj_step1(model_, data_.get());
        }
      }
      wall += SecondsSince(start);
      steps += static_cast<double>((episode.states.size() - 1) * static_cast<size_t>(substeps_));
      if (!std::equal(data_->qpos, data_->qpos + model_->nq, episode.states.back().qpos_mixed.begin())) {
        throw EnvironmentError("bare stepping ends in another state than the pipeline");
      }
    }
    return wall / steps * 1e6;
  }

 private:
  TaskSelection selection_;
  RobotDescription robot_;
  Scene scene_;
  const mjModel* model_;
  sim::World world_;
  DataPtr data_;
  int substeps_;
};

// Returns the round-trip time of a message of STATE's size between two processes over bare LCM, without other
// load. It is the minimum cost of separate processes per tick, for STATE to the policy and ACTION back.
double PingPong() {
  constexpr int kTrips = 5000;
  const std::string url = ReservedBus::Draw().url() + "&recv_buf_size=4194304";
  const std::vector<char> message(3000);
  const pid_t child = fork();
  if (child == 0) {
    lcm::LCM bus(url);
    struct Echo {
      lcm::LCM* bus;
      void Receive(const lcm::ReceiveBuffer* buffer, const std::string&) {
        bus->publish("PONG", buffer->data, buffer->data_size);
      }
    } echo{&bus};
    bus.subscribe("PING", &Echo::Receive, &echo);
    while (getppid() != 1 && bus.handle() == 0) {
    }
    _exit(0);
  }
  lcm::LCM bus(url);
  struct Counter {
    int received = 0;
    void Receive(const lcm::ReceiveBuffer*, const std::string&) { ++received; }
  } counter;
  bus.subscribe("PONG", &Counter::Receive, &counter);
  // Messages are not answered until the child subscribes.
  while (counter.received == 0) {
    bus.publish("PING", message.data(), static_cast<unsigned>(message.size()));
    bus.handleTimeout(50);
  }
  while (bus.handleTimeout(50) > 0) {
  }
  std::vector<double> trips;
  for (int i = 0; i < kTrips; ++i) {
    const auto start = steady_clock::now();
    const int before = counter.received;
    bus.publish("PING", message.data(), static_cast<unsigned>(message.size()));
    while (counter.received == before) bus.handle();
    trips.push_back(SecondsSince(start) * 1e6);
  }
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  std::sort(trips.begin(), trips.end());
  return trips[trips.size() / 2];
}

// Returns the round-trip time over plain UDP, which is the operating system's cost of communication between
// two processes.
double PlainPingPong() {
  constexpr int kTrips = 5000;
  std::vector<char> message(3000);
  const int here = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0),
            there = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in addresses[2]{};
  socklen_t size = sizeof addresses[0];
  for (const auto& [fd, address] : {std::pair(here, &addresses[0]), std::pair(there, &addresses[1])}) {
    address->sin_family = AF_INET;
    address->sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (bind(fd, reinterpret_cast<sockaddr*>(address), size) != 0 ||
        getsockname(fd, reinterpret_cast<sockaddr*>(address), &size) != 0) {
      throw EnvironmentError("cannot open a UDP socket");
    }
  }
  const auto send = [&](int fd, const sockaddr_in& to) {
    if (sendto(fd, message.data(), message.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to) < 0)
      _exit(1);
  };
  const pid_t child = fork();
  if (child == 0) {
    while (getppid() != 1 && recv(there, message.data(), message.size(), 0) > 0) send(there, addresses[0]);
    _exit(0);
  }
  std::vector<double> trips;
  for (int i = 0; i < kTrips; ++i) {
    const auto start = steady_clock::now();
    send(here, addresses[1]);
    if (recv(here, message.data(), message.size(), 0) < 0) throw EnvironmentError("no answer over UDP");
    trips.push_back(SecondsSince(start) * 1e6);
  }
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  close(here);
  close(there);
  return Median(trips);
}

// Returns the number of datagrams in this network namespace that the kernel had no room for.
int64_t LostDatagrams() {
  std::ifstream stream("/proc/net/snmp");
  for (std::string names, values; std::getline(stream, names) && std::getline(stream, values);) {
    if (!names.starts_with("Udp:")) continue;
    std::istringstream name(names), value(values);
    for (std::string n, v; name >> n && value >> v;) {
      if (n == "RcvbufErrors") return std::stoll(v);
    }
  }
  throw EnvironmentError("/proc/net/snmp has no RcvbufErrors");
}

// Runs once with tracing in every process.
void PrintHops(runner::RunOptions options, bool in_process, const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder / "traces");
  setenv(Trace::kVariable, (folder / "traces").c_str(), 1);
  options.out = folder / "run";
  options.in_process = in_process;
  options.url = in_process ? "" : ReservedBus::Draw().url();
  runner::PreparedRun run = runner::PrepareRun(options);
  runner::Announce(&run);
  Stopwatch stopwatch;
  (in_process ? runner::EvaluateInProcess : runner::EvaluateProcesses)(run.options, run.folder, run.plan,
                                                                       &stopwatch);
  unsetenv(Trace::kVariable);
  fmt::print("  {}\n{}", in_process ? "in one process" : "in separate processes",
             HopTable(folder / "traces"));
  std::filesystem::remove_all(folder);
}

void Measure(double control_hz, const Amount& amount, const std::filesystem::path& folder) {
  runner::RunOptions options;
  options.sim.task = "lift_pot/position_and_orientation";
  options.sim.control_hz = control_hz;
  options.episodes = amount.episodes;
  options.seed = 1;
  BareStepping bare_stepping(options.sim.task, Substeps(control_hz, std::llround(kTimestep * 1e6)));
  std::vector<double> bare, one_process, processes;
  for (int round = 0; round < amount.rounds; ++round) {
    for (const bool in_process : {true, false}) {
      options.out = folder / fmt::format("{}-{}-{}", control_hz, round, in_process);
      options.in_process = in_process;
      options.url = in_process ? "" : ReservedBus::Draw().url();
      runner::PreparedRun run = runner::PrepareRun(options);
      runner::Announce(&run);
      Stopwatch stopwatch;
      (in_process ? runner::EvaluateInProcess : runner::EvaluateProcesses)(run.options, run.folder, run.plan,
                                                                           &stopwatch);
      if (stopwatch.successes != amount.episodes) throw EnvironmentError("a timed episode failed");
      (in_process ? one_process : processes).push_back(stopwatch.wall_s / stopwatch.steps * 1e6);
      std::vector<Recorded> episodes;
      for (int i = 0; i < amount.episodes; ++i) episodes.push_back(ReadEpisode(EpisodeLog(options.out, i)));
      bare.push_back(bare_stepping.Time(episodes));
      std::filesystem::remove_all(options.out);
    }
  }
  const double step = Median(bare);
  fmt::print(
      "{:>4} Hz  bare mj_step {:5.1f} us = {:3.0f} x real time | one process {:5.1f} us, {:.2f} of bare | "
      "separate processes {:5.1f} us, {:.2f} of bare\n",
      control_hz, step, kTimestep * 1e6 / step, Median(one_process), step / Median(one_process),
      Median(processes), step / Median(processes));
  for (const bool in_process : {false, true}) PrintHops(options, in_process, folder / "hops");
  std::fflush(stdout);
}

}  // namespace
}  // namespace evalbus

int main(int argc, char** argv) {
  evalbus::Amount amount{.episodes = 4, .rounds = 5};
  if (const auto code = evalbus::ParseAmount(
          argc, argv, "Times the whole pipeline against bare mj_step at 50 and 500 Hz control.", &amount))
    return *code;
  return evalbus::RunInFolder([&](const std::filesystem::path& folder) {
    evalbus::EnterPrivateNetwork();
    fmt::print(
        "round trip between two processes, 3 kB, p50: {:.0f} us over bare LCM, {:.0f} us over plain UDP\n",
        evalbus::PingPong(), evalbus::PlainPingPong());
    for (const double hz : {50.0, 500.0}) evalbus::Measure(hz, amount, folder / "run");
    fmt::print("datagrams lost: {}\n", evalbus::LostDatagrams());
  });
}
