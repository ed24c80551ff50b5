#include "results/policy_calls.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include "base/json_file.h"
#include "base/run_layout.h"
#include "base/text.h"
#include "lcmtypes/metric_catalog.h"
#include "policy_bridge/remote/latency.h"

namespace evalbus::results {
namespace {

using nlohmann::ordered_json;

// Keys below "extended" in episodes.jsonl.
constexpr char kStaleRatio[] = "stale_action_ratio";
constexpr char kEffectiveRate[] = "effective_hz";
constexpr char kActionAge[] = "action_age_s";

// Formats a duration, for example as "8.2 ms" or "1.3 s".
std::string TimeInWords(double seconds) {
  return seconds < 1 ? fmt::format("{:.3g} ms", seconds * 1e3) : fmt::format("{:.3g} s", seconds);
}

double Percentile(const std::vector<double>& sorted, double share) {
  const double rank = std::ceil(share * static_cast<double>(sorted.size()));
  return sorted[static_cast<size_t>(std::max(rank, 1.0)) - 1];
}

// Returns, for example, ", while the robot continued with the previous action chunk (asynchronous)"; empty
// for synchronous execution.
std::string ExecutionInWords(const ordered_json& info) {
  switch (policy::ParseExecution(info.value("execution", "synchronous"))) {
    case policy::Execution::kSynchronous:
      break;
    case policy::Execution::kAsynchronous:
      return ", while the robot continued with the previous action chunk (asynchronous)";
    case policy::Execution::kRealTimeChunking:
      return ", while the robot continued with the previous action chunk, to which the next one was joined "
             "(rtc)";
  }
  return "";
}

std::string ComputationInWords(const ordered_json& info) {
  if (info.value("realtime", false))
    return "simulated time continued during the policy's computation (real time)" + ExecutionInWords(info);
  const std::string latency = info.value("latency", "none");
  if (latency == "none") return "simulated time was paused during the policy's computation";
  if (latency == "measured") {
    return "the policy's computation took simulated time, as measured, rounded up to whole ticks" +
           ExecutionInWords(info);
  }
  const double tick_s = 1 / info.at("control_hz").get<double>();
  const int64_t ticks = policy::HeldTicks(policy::ParseLatency(latency).fixed_s, tick_s);
  return fmt::format("each call took {} ms of simulated time, rounded up to {} = {:.5g} ms{}", latency,
                     Plural(ticks, "tick"), static_cast<double>(ticks) * tick_s * 1e3,
                     ExecutionInWords(info));
}

std::vector<ordered_json> ReadCalls(const RecordedRun& run) {
  std::vector<ordered_json> episodes;
  for (const RecordedEpisode& episode : run.episodes) {
    const auto file = EpisodeFolder(run.folder, episode.episode) / kPolicyCallsJson;
    if (std::filesystem::exists(file)) episodes.push_back(ReadJsonFile<ordered_json>(file));
  }
  return episodes;
}

std::string CallsInWords(const std::vector<ordered_json>& episodes) {
  std::vector<double> answered_s, server_s;
  int64_t held_ticks = 0;
  for (const ordered_json& calls : episodes) {
    for (const auto& seconds : calls.at("answered_s")) answered_s.push_back(seconds.get<double>());
    for (const auto& seconds : calls.at("server_s")) {
      // Older versions wrote null if a server reported NaN.
      if (seconds.is_number() && seconds.get<double>() >= 0) server_s.push_back(seconds.get<double>());
    }
    held_ticks += calls.at("held_ticks").get<int64_t>();
  }
  if (answered_s.empty()) return "";
  std::ranges::sort(answered_s);
  std::ranges::sort(server_s);
  std::string words = fmt::format("Its server was called {}: {} median, {} 99th percentile, {} longest",
                                  Plural(answered_s.size(), "time"), TimeInWords(Percentile(answered_s, 0.5)),
                                  TimeInWords(Percentile(answered_s, 0.99)), TimeInWords(answered_s.back()));
  if (!server_s.empty()) {
    words += fmt::format("; {} median as reported by the server", TimeInWords(Percentile(server_s, 0.5)));
  }
  if (held_ticks > 0)
    words += fmt::format("; the robot held its last command for {}", Plural(held_ticks, "tick"));
  return words + ".";
}

// Returns the simulated duration of a control tick; 0 if the episode has no ticks.
double TickSeconds(const episode_summary_t& summary) {
  const header_t& end = summary.header;
  return end.tick > 0 ? static_cast<double>(end.sim_time_us) / 1e6 / static_cast<double>(end.tick) : 0;
}

std::string DelayInWords(const RecordedRun& run) {
  const metrics::RunSummary summary = run.Statistics().Summary(false);
  const auto mean = [&](const char* name) {
    const metrics::MetricSummary* metric = summary.Find(std::string(kExtended) + name);
    return metric ? metric->mean : std::numeric_limits<double>::quiet_NaN();
  };
  if (!std::isfinite(mean(kActionAge))) return "";
  return fmt::format(
      "{:.1f} new actions per second; {:.1f} % of the ticks had none and held the last command; an action "
      "was {} old on average.",
      mean(kEffectiveRate), 100 * mean(kStaleRatio), TimeInWords(mean(kActionAge)));
}

}  // namespace

int64_t ScoredTicks(const episode_summary_t& summary) {
  const double tick_s = TickSeconds(summary);
  return tick_s > 0 ? std::llround(summary.metrics.completion_time_s / tick_s) : 0;
}

bool HasDelayMetrics(const ordered_json& line) { return line.at("extended").contains(kStaleRatio); }

void AddDelayMetrics(const ordered_json& calls, const episode_summary_t& summary, ordered_json* line) {
  const double tick_s = TickSeconds(summary);
  const auto ticks = calls.at("ticks").get<int64_t>(), held = calls.at("held_ticks").get<int64_t>();
  const int64_t executed = ticks - held;
  ordered_json stale, hz, age;
  if (ticks > 0) {
    stale = static_cast<double>(held) / static_cast<double>(ticks);
    hz = static_cast<double>(executed) / (static_cast<double>(ticks) * tick_s);
  }
  if (executed > 0)
    age = tick_s * static_cast<double>(calls.at("age_ticks").get<int64_t>()) / static_cast<double>(executed);
  ordered_json& extended = line->at("extended");
  extended[kStaleRatio] = stale;
  extended[kEffectiveRate] = hz;
  extended[kActionAge] = age;
}

void PolicyCalls::RemoveUndecided(int64_t last_tick) {
  std::erase_if(calls_, [&](const Call& call) { return call.tick >= last_tick; });
}

bool PolicyCalls::IsWhole(const CallSchedule& schedule, int64_t num_ticks) const {
  policy::ChunkSchedule chunks(schedule.execution, schedule.execute_steps);
  auto call = calls_.begin();
  for (int64_t now = schedule.settle_steps; now < num_ticks; ++now) {
    if (!chunks.IsDue(now)) continue;
    if (call == calls_.end() || call->tick != now) return false;
    chunks.Ask(now);
    chunks.Arrive(call->executed_from, schedule.chunk_steps > 0 ? schedule.chunk_steps : call->num_steps);
    ++call;
  }
  return true;
}

ordered_json PolicyCalls::Json(const CallSchedule& schedule, int64_t num_ticks) const {
  ordered_json tick = ordered_json::array(), answered_s = tick, server_s = tick;
  for (const Call& call : calls_) {
    tick.push_back(call.tick);
    answered_s.push_back(call.answered_s);
    server_s.push_back(call.server_s);
  }
  const int64_t ticks = std::max<int64_t>(num_ticks - schedule.settle_steps, 0);
  policy::ChunkSchedule chunks(schedule.execution, schedule.execute_steps);
  int64_t executed = 0, age_ticks = 0;
  auto call = calls_.begin();
  for (int64_t now = 0; now < num_ticks; ++now) {
    for (; call != calls_.end() && call->tick <= now; ++call) {
      chunks.At(call->tick);
      chunks.Ask(call->tick);
      chunks.Arrive(call->executed_from, schedule.chunk_steps > 0 ? schedule.chunk_steps : call->num_steps);
    }
    if (!chunks.At(now)) continue;
    ++executed;
    age_ticks += now - chunks.observed_tick();
  }
  return {{"tick", tick},
          {"answered_s", answered_s},
          {"server_s", server_s},
          {"held_ticks", std::max<int64_t>(ticks - executed, 0)},
          {"ticks", ticks},
          {"age_ticks", age_ticks},
          {"due_calls", (ticks + schedule.execute_steps - 1) / schedule.execute_steps}};
}

std::string RareCallsWarning(const std::vector<ordered_json>& episodes) {
  int64_t calls = 0, due = 0, ticks = 0, held = 0;
  for (const ordered_json& episode : episodes) {
    calls += static_cast<int64_t>(episode.at("tick").size());
    due += episode.value("due_calls", int64_t{0});
    ticks += episode.value("ticks", int64_t{0});
    held += episode.at("held_ticks").get<int64_t>();
  }
  if (calls * 2 >= due) return "";
  return fmt::format(
      "warning: the policy was called {} in {} instead of {}: the robot held its last command for {} of "
      "the ticks, so the scores hardly depend on the policy",
      Plural(calls, "time"), Plural(ticks, "tick"), Plural(due, "time"), held);
}

std::vector<std::string> PolicyNotes(const RecordedRun& run) {
  std::vector<std::string> notes;
  const auto found = run.info.find("policy_contract");
  if (found == run.info.end() || !found->is_object()) {
    if (run.info.value("latency", "none") == "none") return notes;
    notes.push_back(
        fmt::format("Scripted policy with an inference delay: {}.", ComputationInWords(run.info)));
    if (std::string delay = DelayInWords(run); !delay.empty()) notes.push_back(std::move(delay));
    return notes;
  }
  const ordered_json& contract = *found;
  const ordered_json& action = contract.at("action");
  const std::vector<ordered_json> episodes = ReadCalls(run);
  if (std::string warning = RareCallsWarning(episodes); !warning.empty()) notes.push_back(warning + ".");
  notes.push_back(
      fmt::format("Policy behind a server, contract {} ({}): {}, {} of each answer executed at {:g} Hz; {}.",
                  contract.at("name").get<std::string>(), contract.at("wire").get<std::string>(),
                  action.at("kind").get<std::string>(), Plural(action.at("execute_steps").get<int>(), "step"),
                  contract.at("rate_hz").get<double>(), ComputationInWords(run.info)));
  if (contract.value("privileged", false)) {
    notes.push_back("The policy received poses of objects, which a real robot cannot measure.");
  }
  if (std::string calls = CallsInWords(episodes); !calls.empty()) notes.push_back(std::move(calls));
  if (std::string delay = DelayInWords(run); !delay.empty()) notes.push_back(std::move(delay));
  return notes;
}

}  // namespace evalbus::results
