#include "viz/monitor/monitor.h"

#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>

#include "bus/bus.h"
#include "bus/component.h"
#include "bus/errors.h"
#include "viz/monitor/live_runs.h"
#include "viz/monitor/monitor_model.h"
#include "viz/monitor/terminal.h"

namespace evalbus {
namespace {

using std::chrono::steady_clock;

// Often enough to feel live, seldom enough to read.
constexpr auto kRedrawPeriod = std::chrono::milliseconds(200);
constexpr auto kLinePeriod = std::chrono::seconds(1);
// Every component speaks every 0.4 s; when all are silent for so long they are gone.
constexpr double kOver = 5;

nlohmann::json RunJson(const std::filesystem::path& folder) {
  std::ifstream stream(folder / "run.json");
  return nlohmann::json::parse(stream, nullptr, false);
}

// Decides what to listen to and goes where it can be heard. Returns the number of episodes planned, 0 where
// that is not known.
int Attach(const MonitorOptions& options, std::string* url) {
  *url = options.url;
  nlohmann::json run_json;
  if (!options.run.empty()) {
    if (!url->empty()) throw InputError("a run folder and --url exclude each other");
    run_json = RunJson(options.run);
    if (!run_json.is_object() || !run_json.contains("url"))
      throw InputError((options.run / "run.json").string() + ": not a run folder");
    *url = run_json["url"].get<std::string>();
    if (*url == "memq://")
      throw InputError(options.run.string() +
                       ": this run is in one process (--in-process), nobody can listen");
  }
  const std::vector<LiveRun> runs = FindLiveRuns();
  std::optional<LiveRun> run;
  try {
    run = ChooseLiveRun(runs, *url);
  } catch (const InputError&) {
    // An URL that was named may be one of components yet to be started, or of another machine.
    if (options.url.empty()) throw;
  }
  if (!run) return 0;
  *url = run->url;
  if (run->other_network) JoinNetwork(*run);
  if (run_json.is_null() && !run->folder.empty()) run_json = RunJson(run->folder);
  return run_json.is_object() ? run_json.value("episodes", 0) : 0;
}

// A line for someone who reads a pipe or a file; dropped rather than waited for when nobody reads.
bool PrintLine(std::string line) {
  pollfd fd{STDOUT_FILENO, POLLOUT, 0};
  if (poll(&fd, 1, 0) == 0) return true;
  if (fd.revents & POLLERR) return false;
  line += '\n';
  return write(STDOUT_FILENO, line.data(), line.size()) >= 0;
}

}  // namespace

void AddMonitorOptions(CLI::App* app, MonitorOptions* options) {
  app->add_option("run", options->run, "folder of a run that goes on; default: the one run on this machine");
  app->add_option("--url", options->url, "bus to listen to, udpm://ADDRESS:PORT?ttl=0")
      ->envname("EVALBUS_URL");
}

int Monitor(const MonitorOptions& options) {
  std::string url;
  const int planned_episodes = Attach(options, &url);
  InstallStopSignals();
  signal(SIGPIPE, SIG_IGN);
  Bus bus(url);
  MonitorModel model(url, planned_episodes);
  bus.SubscribeRaw("EVALBUS_.*", [&](const std::string& channel, std::span<const uint8_t> data, int64_t) {
    model.Hear(channel, data, steady_clock::now());
  });

  std::optional<Terminal> terminal;
  if (isatty(STDOUT_FILENO)) {
    const char* no_color = std::getenv("NO_COLOR");
    const char* term = std::getenv("TERM");
    terminal.emplace(STDOUT_FILENO, (no_color == nullptr || *no_color == '\0') &&
                                        (term == nullptr || std::string(term) != "dumb"));
  } else {
    PrintLine("listening to " + url);
  }
  SteadyTime next{};
  auto size = std::pair(0, 0);
  while (!stop_requested()) {
    const auto now = steady_clock::now();
    if (terminal) {
      const char key = terminal->ReadKey();
      if (key == 'q' || key == 'Q' || key == '\x03') break;
      if (now >= next || terminal->size() != size) {
        size = terminal->size();
        terminal->Draw(model.Lines(size.first, size.second, now));
        model.TakeEvents(now);
        next = now + kRedrawPeriod;
      }
    } else {
      bool good = true;
      for (const std::string& event : model.TakeEvents(now)) good = good && PrintLine(event);
      if (now >= next) {
        const std::string line = model.ProgressLine(now);
        if (!line.empty()) good = good && PrintLine(line);
        next = now + kLinePeriod;
      }
      if (!good) break;
      if (model.heard_anything() && model.SilentFor(now) > kOver) {
        PrintLine("no message for 5 s: the run is over");
        break;
      }
    }
    // All that is there, then wait.
    const auto until = std::min(next, now + std::chrono::milliseconds(50));
    if (!bus.Handle(until)) continue;
    while (steady_clock::now() < next && !stop_requested() && bus.Handle()) {
    }
  }
  return 0;
}

}  // namespace evalbus
