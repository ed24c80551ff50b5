#include "tests/bench/hops.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <optional>
#include <string_view>
#include <tuple>
#include <vector>

#include "base/errors.h"
#include "bus/trace.h"

namespace evalbus {
namespace {

using Event = Trace::Event;
// A key consists of process, event, channel, episode and tick.
using Key = std::tuple<int, Event, std::string, int, int>;

struct Hop {
  const char* name;
  std::string_view input, output;
  // Number of ticks from the message to its answer.
  int later;
};
constexpr Hop kHops[] = {{"STATE to policy", "STATE", "ACTION", 0},
                         {"STATE to collision", "STATE", "CONTACTS", 0},
                         {"CONTACTS to metrics", "CONTACTS", "PARTIAL", 0},
                         {"PARTIAL to sim", "PARTIAL", "STATE", 1}};

class Traces {
 public:
  explicit Traces(const std::filesystem::path& folder) {
    int process = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      std::map<std::string, int64_t> encoding;
      for (const Trace::Record& record : Trace::Read(entry.path())) {
        const std::string channel(record.channel, strnlen(record.channel, sizeof record.channel));
        if (record.event == Event::kEncode) {
          encoding[channel] = record.time_ns;  // the tick is not known yet when encoding starts
          continue;
        }
        times_.try_emplace({process, record.event, channel, record.episode, record.tick}, record.time_ns);
        if (record.event != Event::kSend) continue;
        times_.try_emplace({process, Event::kEncode, channel, record.episode, record.tick},
                           encoding[channel]);
        publisher_.try_emplace(channel, process);
        ticks_[channel].emplace_back(record.episode, record.tick);
      }
      ++process;
    }
  }
  int PublisherOf(std::string_view channel) const {
    const auto found = publisher_.find(std::string(channel));
    if (found == publisher_.end()) throw EnvironmentError("no process published " + std::string(channel));
    return found->second;
  }
  const std::vector<std::pair<int, int>>& TicksOf(std::string_view channel) {
    return ticks_[std::string(channel)];
  }
  std::optional<double> TimeUs(int process, Event event, std::string_view channel, int episode,
                               int tick) const {
    const auto found = times_.find({process, event, std::string(channel), episode, tick});
    if (found == times_.end()) return std::nullopt;
    return static_cast<double>(found->second) * 1e-3;
  }

 private:
  std::map<Key, int64_t> times_;
  std::map<std::string, int> publisher_;
  std::map<std::string, std::vector<std::pair<int, int>>> ticks_;
};

std::string Percentiles(std::vector<double> values) {
  if (values.empty()) throw EnvironmentError("a message of the tick is in no trace");
  std::ranges::sort(values);
  const auto at = [&](double share) {
    return values[static_cast<size_t>(share * static_cast<double>(values.size() - 1))];
  };
  return fmt::format("{:7.1f} {:6.1f}", at(0.50), at(0.99));
}

}  // namespace

std::string HopTable(const std::filesystem::path& folder) {
  Traces traces(folder);
  std::string table = fmt::format("  {:20}  {:^14}  {:^14}  {:^14}  {:^14}  {:^14}\n", "us, p50 and p99",
                                  "send", "wake-up", "decode", "work", "encode answer");
  for (const Hop& hop : kHops) {
    const int from = traces.PublisherOf(hop.input), to = traces.PublisherOf(hop.output);
    std::vector<double> parts[5];
    for (const auto& [episode, tick] : traces.TicksOf(hop.input)) {
      const auto send = traces.TimeUs(from, Event::kSend, hop.input, episode, tick);
      const auto sent = traces.TimeUs(from, Event::kSent, hop.input, episode, tick);
      const auto received = traces.TimeUs(to, Event::kReceived, hop.input, episode, tick);
      const auto decoded = traces.TimeUs(to, Event::kDecoded, hop.input, episode, tick);
      const auto answer = traces.TimeUs(to, Event::kEncode, hop.output, episode, tick + hop.later);
      const auto encoded = traces.TimeUs(to, Event::kSend, hop.output, episode, tick + hop.later);
      // The last tick has no answer.
      if (!send || !sent || !received || !decoded || !answer || !encoded) continue;
      parts[0].push_back(*sent - *send);
      // The receiver may run before the sender's call returns.
      parts[1].push_back(std::max(0.0, *received - *sent));
      parts[2].push_back(*decoded - *received);
      parts[3].push_back(*answer - *decoded);
      parts[4].push_back(*encoded - *answer);
    }
    table += fmt::format("  {:20}", hop.name);
    for (const auto& part : parts) table += "  " + Percentiles(part);
    table += '\n';
  }
  const int sim = traces.PublisherOf("STATE");
  std::vector<double> physics, whole;
  for (const auto& [episode, tick] : traces.TicksOf("STATE")) {
    const auto decoded = traces.TimeUs(sim, Event::kDecoded, "ACTION", episode, tick);
    const auto handled = traces.TimeUs(sim, Event::kHandled, "ACTION", episode, tick);
    if (decoded && handled) physics.push_back(*handled - *decoded);
    const auto now = traces.TimeUs(sim, Event::kEncode, "STATE", episode, tick);
    const auto next = traces.TimeUs(sim, Event::kEncode, "STATE", episode, tick + 1);
    if (now && next) whole.push_back(*next - *now);
  }
  table +=
      fmt::format("  {:20}  {:48}{}\n", "ACTION to sim", "physics of the next tick", Percentiles(physics));
  table += fmt::format("  {:20}  {:48}{}\n", "the whole tick", "", Percentiles(whole));
  return table;
}

}  // namespace evalbus
