#include "plans/certify.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

#include "base/errors.h"
#include "base/json_file.h"
#include "base/write_whole.h"
#include "bus/host.h"
#include "models/task_description.h"
#include "plans/plan_folder.h"
#include "plans/plan_run.h"
#include "results/run_reader.h"
#include "results/summary_table.h"
#include "runner/engines.h"

namespace evalbus::plans {
namespace {

namespace fs = std::filesystem;

results::StageNames StageNamesOf(const Plan& plan) {
  results::StageNames names;
  for (const std::string& name : plan.tasks) {
    const TaskSelection selection = FindTask(name);
    auto& stages = names[selection.task.name + "/" + selection.variation];
    for (const Stage& stage : selection.task.stages) stages[stage.index] = stage.name;
  }
  return names;
}

results::EngineResults ResultsOf(const PlanFolder& folder, const std::string& version) {
  results::EngineResults results{version, {}};
  for (const PlannedPolicy& policy : folder.plan().policies) {
    results.policies.push_back(results::ReadRuns(folder.policy_folder(policy.name)));
    results.policies.back().name = policy.name;
  }
  return results;
}

}  // namespace

std::vector<std::string> FindEngines(const std::vector<std::string>& wanted) {
  std::vector<std::string> engines, versions;
  for (const std::string& one : wanted) {
    engines.push_back(runner::FindEngine(one, "--engines"));
    const std::string version = runner::EngineVersion(engines.back());
    if (std::ranges::find(versions, version) != versions.end())
      throw InputError("--engines: MuJoCo " + version + " is given twice");
    versions.push_back(version);
  }
  if (engines.size() < 2) throw InputError("--engines: expected two or more versions, for example 2.2,3.3.3");
  return engines;
}

Certified CertifyPlan(const Plan& plan, const std::vector<std::string>& engines, const fs::path& out,
                      int workers) {
  // All plans are checked before the first run begins.
  std::vector<Plan> plans;
  for (const std::string& engine : engines) plans.push_back(OnEngine(plan, engine));
  std::vector<results::EngineResults> results;
  for (size_t i = 0; i < engines.size(); ++i) {
    const std::string version = runner::EngineVersion(engines[i]);
    const PlanFolder folder(plans[i], out / version);
    fmt::print("MuJoCo {}: ", version);
    std::fflush(stdout);
    try {
      RunAllEpisodes(folder, workers);
    } catch (const EnvironmentError&) {
      if (!stop_requested()) throw;
      throw EnvironmentError("stopped; to resume, run " + results::SameCommand(out));
    }
    fmt::print("\n");
    results.push_back(ResultsOf(folder, version));
  }
  Certified certified{results::Certify(results), StageNamesOf(plan)};
  const auto json = results::CertificateJson(certified.certificate, certified.stages);
  WriteWhole(out / kCertificateJson, ToText(json, 2) + "\n");
  return certified;
}

}  // namespace evalbus::plans
