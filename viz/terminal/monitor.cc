#include "viz/terminal/monitor.h"

#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <optional>

#include "base/text.h"
#include "bus/bus.h"
#include "bus/host.h"
#include "viz/terminal/monitor_screen.h"
#include "viz/terminal/terminal.h"
#include "viz/watch/run_watch.h"

namespace evalbus::viz {
namespace {

using std::chrono::steady_clock;

// Periods at which the screen is redrawn and lines are printed: a compromise between fast updates and
// legibility.
constexpr auto kRedrawPeriod = std::chrono::milliseconds(200);
constexpr auto kLinePeriod = std::chrono::seconds(1);
// If all components have been silent for this long, the run counts as ended, because components publish
// STATUS every 0.4 s. After the reported end of a run, the next run of a suite would also begin within this
// time.
constexpr std::chrono::duration<double> kOver{5};

// Prints a line to a pipe or file. If the pipe is full, the line is dropped, so that the call does not block.
bool PrintLine(const std::string& text) {
  pollfd fd{STDOUT_FILENO, POLLOUT, 0};
  if (poll(&fd, 1, 0) == 0) return true;
  if (fd.revents & POLLERR) return false;
  const std::string line = Printable(text) + '\n';
  return write(STDOUT_FILENO, line.data(), line.size()) >= 0;
}

}  // namespace

int Monitor(const Address& address) {
  const Attached attached = Attach(address);
  const std::string& url = attached.url;
  InstallStopSignals();
  signal(SIGPIPE, SIG_IGN);
  Bus bus(url);
  RunWatch watch(attached.planned_episodes);
  bus.SubscribeRaw("EVALBUS_.*", [&](std::string_view channel, std::span<const uint8_t> data, int64_t) {
    watch.Receive(channel, data, steady_clock::now());
  });
  bus.SetMaxBatchDelay(std::chrono::milliseconds(20));

  std::optional<Terminal> terminal;
  if (isatty(STDOUT_FILENO)) {
    terminal.emplace(STDOUT_FILENO, UsesColors(stdout));
  } else {
    PrintLine("listening to " + url);
  }
  SteadyTime next{}, over_since = steady_clock::now();
  auto size = std::pair(0, 0);
  while (!stop_requested()) {
    const auto now = steady_clock::now();
    watch.Update(now);
    if (terminal) {
      const char key = terminal->ReadKey();
      if (key == 'q' || key == 'Q' || key == '\x03') break;
      if (now >= next || terminal->size() != size) {
        size = terminal->size();
        terminal->Draw(MonitorScreen(watch, url, size.first, size.second, now));
        watch.TakeEvents();
        next = now + kRedrawPeriod;
      }
    } else {
      bool good = true;
      for (const std::string& event : watch.TakeEvents()) good = good && PrintLine(event);
      if (now >= next) {
        const std::string line = ProgressLine(watch);
        if (!line.empty()) good = good && PrintLine(line);
        next = now + kLinePeriod;
      }
      if (!good) break;
      if (!watch.is_over()) over_since = now;
      if (now - over_since > kOver) {
        PrintLine("the run has ended");
        break;
      }
      if (watch.received_at() && watch.SilentFor(now) > kOver.count()) {
        PrintLine("no message for 5 s: the run has ended or is unreachable");
        break;
      }
    }
    // Waits for a message, then handles all pending messages.
    const auto until = std::min(next, now + std::chrono::milliseconds(50));
    if (!bus.Handle(until)) continue;
    while (steady_clock::now() < next && !stop_requested() && bus.Handle()) {
    }
  }
  return 0;
}

}  // namespace evalbus::viz
