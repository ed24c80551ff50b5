#include "bus/attach.h"

#include <CLI/CLI.hpp>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>

#include "base/errors.h"
#include "base/run_layout.h"
#include "bus/live_runs.h"

namespace evalbus {
namespace {

nlohmann::json RunJson(const std::filesystem::path& folder) {
  std::ifstream stream(folder / kRunJson);
  return nlohmann::json::parse(stream, nullptr, false);
}

}  // namespace

void AddAddressOptions(CLI::App* app, Address* address) {
  app->add_option("run", address->run,
                  "folder of a run that goes on; default: the one run or replay on this machine");
  app->add_option("--url", address->url, "bus to listen to, udpm://ADDRESS:PORT?ttl=0")
      ->envname("EVALBUS_URL");
}

Attached Attach(const Address& address) {
  std::string url = address.url;
  nlohmann::json run_json;
  if (!address.run.empty()) {
    if (!url.empty()) throw InputError("a run folder and --url exclude each other");
    run_json = RunJson(address.run);
    if (!run_json.is_object() || !run_json.contains("url") || !run_json.contains("in_process"))
      throw InputError((address.run / kRunJson).string() + ": not a run folder");
    url = run_json["url"].get<std::string>();
    if (run_json["in_process"] == true)
      throw InputError(address.run.string() +
                       ": this run is in one process (--in-process), nobody can listen");
  }
  const std::vector<LiveRun> runs = FindLiveRuns();
  std::optional<LiveRun> run;
  try {
    run = ChooseLiveRun(runs, url);
  } catch (const InputError&) {
    // An URL that was named may be one of components yet to be started, or of another machine.
    if (address.url.empty()) throw;
  }
  if (!run) return {url, 0};
  if (run->other_network) JoinNetwork(*run);
  if (run_json.is_null() && !run->folder.empty()) run_json = RunJson(run->folder);
  return {run->url, run_json.is_object() ? run_json.value("episodes", 0) : 0};
}

}  // namespace evalbus
