// Measures the speed of rescoring recorded episodes offline, from log to score, compared with the duration of
// the episodes. Every timed score must be bit-identical to the recorded one. Also measures where the time is
// spent: finding the events, decoding them, and the rest (pairing and scoring).
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "base/errors.h"
#include "bus/bus.h"
#include "bus/channels.h"
#include "bus/event_log.h"
#include "results/episode_logs.h"
#include "results/rescorer.h"
#include "runner/launch.h"
#include "runner/prepared_run.h"
#include "tests/bench/rounds.h"

namespace evalbus {
namespace {

using std::chrono::steady_clock;

double SecondsSince(SteadyTime start) {
  return std::chrono::duration<double>(steady_clock::now() - start).count();
}

// Reads a log as rescoring does, without scoring.
int64_t Walk(const std::filesystem::path& file, bool decode) {
  EventLogReader reader(file);
  int64_t states = 0;
  state_t state{};
  contacts_t contacts{};
  for (LogEvent event; reader.Next(&event);) {
    if (event.channel == channels::kState) {
      ++states;
      if (decode && !Decode(event.data, &state)) throw EnvironmentError("STATE does not decode");
    } else if (event.channel == channels::kContacts) {
      if (decode && !Decode(event.data, &contacts)) throw EnvironmentError("CONTACTS does not decode");
    }
  }
  return states;
}

void Measure(const Amount& amount, const std::filesystem::path& folder) {
  runner::RunOptions options;
  options.sim.task = "lift_pot/position_and_orientation";
  options.in_process = true;
  options.episodes = amount.episodes;
  options.seed = 1;
  options.out = folder;
  runner::PreparedRun run = runner::PrepareRun(options);
  runner::Announce(&run);
  runner::RunListener nobody;
  runner::EvaluateInProcess(run.options, run.folder, run.plan, &nobody);
  const auto logs = results::EpisodeLogs(folder);

  std::vector<double> whole, walk, decode;
  double simulated = 0;
  int64_t ticks = 0;
  for (int round = 0; round < amount.rounds; ++round) {
    auto start = steady_clock::now();
    results::Rescorer rescorer;
    simulated = 0;
    for (const auto& log : logs) {
      const results::RescoredLog scored = rescorer.Rescore(log);
      if (scored.episodes.size() != 1 || !scored.episodes[0].equal() ||
          !scored.episodes[0].summary.complete) {
        throw EnvironmentError("a timed score is not the recorded one");
      }
      simulated += static_cast<double>(scored.episodes[0].summary.header.sim_time_us) * 1e-6;
    }
    whole.push_back(SecondsSince(start));
    for (const bool with_decoding : {false, true}) {
      ticks = 0;
      start = steady_clock::now();
      for (const auto& log : logs) ticks += Walk(log, with_decoding);
      (with_decoding ? decode : walk).push_back(SecondsSince(start));
    }
  }
  const double n = static_cast<double>(ticks) / 1e6;
  fmt::print(
      "rescoring {} episodes, {:.0f} s simulated at 50 Hz: {:.4f} s = {:.0f} x real time, {:.0f} ticks/s; "
      "per tick "
      "{:.2f} us, of which finding events {:.2f}, decoding {:.2f}\n",
      amount.episodes, simulated, Median(whole), simulated / Median(whole),
      static_cast<double>(ticks) / Median(whole), Median(whole) / n, Median(walk) / n,
      (Median(decode) - Median(walk)) / n);
}

}  // namespace
}  // namespace evalbus

int main(int argc, char** argv) {
  evalbus::Amount amount{.episodes = 20, .rounds = 15};
  if (const auto code = evalbus::ParseAmount(
          argc, argv, "Times offline scoring of recorded episodes against real time.", &amount))
    return *code;
  return evalbus::RunInFolder(
      [&](const std::filesystem::path& folder) { evalbus::Measure(amount, folder / "run"); });
}
