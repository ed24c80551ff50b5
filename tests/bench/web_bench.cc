// Measures the cost of browsers that observe a run. The pipeline's time per physics step in separate
// processes is measured without a web server and with a server that has 0, 1, 8 and 50 viewers. The last of
// several viewers never reads. All processes share this machine's processors, including the viewers, which
// read and discard all data.
#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <sstream>
#include <thread>
#include <vector>

#include "base/errors.h"
#include "base/run_layout.h"
#include "bus/private_network.h"
#include "runner/launch.h"
#include "runner/prepared_run.h"
#include "runner/processes.h"
#include "tests/bench/rounds.h"
#include "tests/bench/stopwatch.h"

namespace evalbus {
namespace {

// The benchmark measures a run without a server and runs with these numbers of viewers.
constexpr int kNoServer = -1;
constexpr int kViewers[] = {kNoServer, 0, 1, 8, 50};

// Viewers in a separate process, which ends when the object is destroyed. The constructor returns after each
// viewer has received the answer to its handshake.
class Viewers {
 public:
  Viewers(uint16_t port, int count) {
    if (pipe2(pipe_, O_CLOEXEC) != 0) throw EnvironmentError("no pipe");
    int ready[2];
    if (pipe2(ready, O_CLOEXEC) != 0) throw EnvironmentError("no pipe");
    child_ = fork();
    if (child_ == 0) {
      close(pipe_[1]);
      Watch(port, count, ready[1]);
      _exit(0);
    }
    close(ready[1]);
    char ok = 0;
    if (read(ready[0], &ok, 1) != 1) throw EnvironmentError("a viewer could not enter");
    close(ready[0]);
  }
  // Disconnects the viewers. Returns false if the server had already disconnected one.
  bool End() {
    close(pipe_[1]);
    pipe_[1] = -1;
    int status = 0;
    waitpid(child_, &status, 0);
    child_ = 0;
    return WIFEXITED(status) && WEXITSTATUS(status) == 0;
  }
  ~Viewers() {
    if (pipe_[1] >= 0) close(pipe_[1]);
    close(pipe_[0]);
    if (child_ > 0) waitpid(child_, nullptr, 0);
  }

 private:
  void Watch(uint16_t port, int count, int ready) const {
    constexpr char kHandshake[] =
        "GET /live HTTP/1.1\r\nHost: localhost\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
        "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";
    std::vector<pollfd> sockets = {{pipe_[0], POLLIN, 0}};
    std::vector<char> part(1 << 16);
    for (int i = 0; i < count; ++i) {
      const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
      sockaddr_in address{};
      address.sin_family = AF_INET;
      address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
      address.sin_port = htons(port);
      if (connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
          send(fd, kHandshake, sizeof kHandshake - 1, MSG_NOSIGNAL) < 0 ||
          recv(fd, part.data(), 12, MSG_WAITALL) != 12 ||
          std::string_view(part.data(), 12) != "HTTP/1.1 101") {
        _exit(1);
      }
      // The last of several viewers never reads.
      const bool reads = count < 2 || i + 1 < count;
      sockets.push_back({fd, static_cast<short>(reads ? POLLIN : 0), 0});
    }
    if (write(ready, "r", 1) != 1) _exit(1);
    while (poll(sockets.data(), sockets.size(), -1) > 0 && sockets[0].revents == 0) {
      for (size_t i = 1; i < sockets.size(); ++i) {
        if (sockets[i].revents & POLLIN && recv(sockets[i].fd, part.data(), part.size(), 0) <= 0) _exit(2);
        if (sockets[i].revents & (POLLERR | POLLHUP)) _exit(2);
      }
    }
  }

  int pipe_[2];
  pid_t child_ = 0;
};

// Returns the port of the page, which the server prints.
uint16_t PortIn(const std::filesystem::path& log, runner::Processes* processes) {
  while (true) {
    std::ifstream stream(log);
    std::stringstream text;
    text << stream.rdbuf();
    const size_t at = text.str().find("127.0.0.1:");
    if (at != std::string::npos && text.str().find('/', at) != std::string::npos) {
      return static_cast<uint16_t>(std::stoi(text.str().substr(at + 10)));
    }
    if (processes->Poll()) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  throw EnvironmentError("evalbus web printed no address");
}

// Returns the microseconds per physics step.
double TimeRun(int viewers, int episodes, uint32_t round, const std::filesystem::path& folder) {
  runner::RunOptions options;
  options.sim.task = "lift_pot/position_and_orientation";
  options.episodes = episodes;
  options.seed = 1;
  options.out = folder / fmt::format("run-{}-{}", round, viewers);
  options.url = ReservedBus::Draw().url();
  runner::PreparedRun run = runner::PrepareRun(options);
  runner::Announce(&run);
  runner::Processes processes;
  std::unique_ptr<Viewers> watching;
  if (viewers != kNoServer) {
    const auto log = options.out / "web.txt";
    processes.Start("web",
                    {(runner::Processes::BinaryFolder() / "evalbus").string(), "web", "--port", "0",
                     options.out.string()},
                    log);
    const uint16_t port = PortIn(log, &processes);
    if (viewers > 0) watching = std::make_unique<Viewers>(port, viewers);
  }
  Stopwatch stopwatch;
  runner::EvaluateProcesses(run.options, run.folder, run.plan, &stopwatch);
  if (watching && !watching->End()) throw EnvironmentError("a viewer was lost");
  for (const runner::Processes::Exit& exit : processes.StopAll()) {
    // On a loaded machine the launcher may kill the server before it has exited.
    if (exit.code != 128 + SIGKILL)
      throw EnvironmentError("evalbus web did not end well: " + exit.description);
  }
  std::filesystem::remove_all(options.out);
  return stopwatch.wall_s / stopwatch.steps * 1e6;
}

void Measure(const Amount& amount, const std::filesystem::path& folder) {
  std::map<int, std::vector<double>> times;
  uint32_t run = 0;
  for (int round = 0; round < amount.rounds; ++round) {
    for (const int viewers : kViewers)
      times[viewers].push_back(TimeRun(viewers, amount.episodes, run++, folder));
  }
  const double alone = Median(times[kNoServer]);
  for (const int viewers : kViewers) {
    const double time = Median(times[viewers]);
    fmt::print("{:<22} {:6.1f} us per physics step, {:.2f} of the time without a server\n",
               viewers == kNoServer ? "no server" : fmt::format("server, {} viewers", viewers), time,
               time / alone);
  }
}

}  // namespace
}  // namespace evalbus

int main(int argc, char** argv) {
  evalbus::Amount amount{.episodes = 4, .rounds = 5};
  if (const auto code = evalbus::ParseAmount(
          argc, argv, "Times the pipeline with 0, 1, 8 and 50 viewers in browsers.", &amount))
    return *code;
  return evalbus::RunInFolder([&](const std::filesystem::path& folder) {
    evalbus::EnterPrivateNetwork();
    evalbus::Measure(amount, folder / "run");
  });
}
