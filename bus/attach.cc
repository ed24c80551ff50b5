#include "bus/attach.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/input_file.h"
#include "base/plan_layout.h"
#include "base/run_layout.h"
#include "bus/live_runs.h"
#include "bus/private_network.h"

namespace evalbus {
namespace {

namespace fs = std::filesystem;

// Returns the contents of run.json; a discarded value if the file is missing or malformed.
nlohmann::json RunJson(const fs::path& folder) {
  if (!fs::exists(folder / kRunJson)) return nlohmann::json::value_t::discarded;
  return nlohmann::json::parse(ReadInput(folder / kRunJson), nullptr, false);
}

template <class T>
T Get(const nlohmann::json& json, const char* key, T otherwise) {
  const auto found = json.is_object() ? json.find(key) : json.end();
  if (found == json.end()) return otherwise;
  if constexpr (std::is_same_v<T, std::string>) return found->is_string() ? found->get<T>() : otherwise;
  return found->is_number_integer() || found->is_boolean() ? found->get<T>() : otherwise;
}

// Returns the number of episodes of a run: of --only, if the run has this option. 0 if it is unknown.
int64_t PlannedEpisodes(const nlohmann::json& run) {
  const auto only = run.is_object() ? run.find("only") : run.end();
  const bool is_part = only != run.end() && only->is_array() && !only->empty();
  return is_part ? static_cast<int64_t>(only->size()) : Get<int64_t>(run, "episodes", 0);
}

// Throws an InputError that explains why no bus is found for this run folder, suite or log.
[[noreturn]] void NothingOf(const fs::path& folder) {
  if (!fs::exists(folder)) throw InputError(folder.string() + ": no such run folder");
  const auto run = RunJson(folder);
  if (!run.is_object()) {
    if (fs::exists(folder / kSuiteJson) || fs::is_regular_file(folder)) {
      throw InputError(folder.string() + ": no active run or replay of this suite or log on this machine");
    }
    if (fs::exists(folder / kPlanJson))
      throw InputError(folder.string() + ": " + PlanNotExpected(folder, true));
    throw InputError(folder.string() + ": not a run folder: it has no valid run.json");
  }
  const int64_t finished = CountLines(folder / kEpisodesJsonl);
  // A finished collection contains only its successes.
  const int64_t planned = fs::exists(folder / kCollectJson) ? finished : PlannedEpisodes(run);
  if (finished < planned && Get(run, "in_process", false)) {
    throw InputError(
        folder.string() +
        ": this run is in one process (--in-process) and publishes no messages; 'evalbus replay' and "
        "'evalbus render' show its finished episodes");
  }
  throw InputError(fmt::format(
      "{}: {}; 'evalbus replay {}' plays its finished episodes", folder.string(),
      finished < planned ? fmt::format("interrupted (no process is running), {} of {} episodes have finished",
                                       finished, planned)
                         : "this run has finished",
      folder.string()));
}

}  // namespace

void AddAddressOptions(CLI::App* app, Address* address) {
  app->add_option("run", address->run,
                  "folder of an active run or replay; default: the bus of EVALBUS_URL, or the one run "
                  "or replay on this machine");
  app->add_option("--url", address->url, "bus to listen to, udpm://ADDRESS:PORT?ttl=0");
}

Attached Attach(const Address& address) {
  if (!address.run.empty() && !address.url.empty()) {
    throw InputError("a run folder cannot be combined with --url");
  }
  std::vector<LiveRun> runs = FindLiveRuns();
  LiveRun run;
  if (!address.run.empty()) {
    runs = LiveRunsOf(runs, address.run);
    if (runs.empty()) NothingOf(address.run);
    run = ChooseLiveRun(runs);
  } else if (const std::string url = address.url.empty() ? UrlOfEnvironment() : address.url; url.empty()) {
    run = ChooseLiveRun(runs);
  } else {
    // The URL is used even if no run has it, because its components may not have started yet or may be on
    // another machine.
    run.url = url;
    if (std::ranges::count(runs, url, &LiveRun::url) == 1) run = ChooseLiveRun(runs, url);
  }
  if (run.other_network) JoinNetwork(run);
  const auto json = RunJson(run.folder);
  const auto named = Get<std::string>(json, "policy_name", "");
  return {run.url, static_cast<int>(PlannedEpisodes(json)),
          named.empty() ? Get<std::string>(json, "policy", "") : named};
}

}  // namespace evalbus
