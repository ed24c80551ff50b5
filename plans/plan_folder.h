// The folder of a plan's results, on a disk that several machines may share.
//
//   plan.json                       the plan, resolved
//   POLICY/TASK-VARIATION/          run folders; POLICY/ is a suite
//   parts/SHARD/                    run folders of single shards, until they are merged
//   parts/.SHARD.HOST-PID           marker: this process is running or copying the shard
//   parts/.SHARD.failed             error of a shard that failed
//   slurm/                          scripts and logs of the jobs
//   stops.json, report.html         decisions of a plan with `until`; the plan's page
//
// plan.json and parts/ need no locks: every file and shard appears atomically by rename, and processes that
// write plan.json write the same contents. If two processes run the same shard, its results are stored once.
#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "base/plan_layout.h"
#include "plans/plan.h"

namespace evalbus::plans {

// File with the decisions of a plan with Plan::until.
inline constexpr char kStopsJson[] = "stops.json";
inline constexpr char kSlurmFolder[] = "slurm";
// File with the plan's page.
inline constexpr char kReportHtml[] = "report.html";

// A shard, which consists of the episodes `first` to `last` of one run.
struct Shard {
  std::string policy, task;
  int first = 0, last = 0;

  int size() const { return last - first + 1; }
  // Returns the name of the shard and of its folder, for example "ckpt-1000+lift_pot-position+0000-0019".
  std::string name() const;
};

// Returns all shards of a plan, ordered by policy, task and episode.
std::vector<Shard> ShardsOf(const Plan& plan);
// Returns the shards of part `part` (from 1) of `parts`, which are every `parts`-th shard.
std::vector<Shard> ShardsOfPart(const std::vector<Shard>& shards, int part, int parts);

class PlanFolder {
 public:
  // Opens the plan's folder `out`, or creates it and writes plan.json. If `out` is empty, the folder is
  // runs/PLAN-DATE-TIME. If `make` is false, nothing is created. Throws InputError if the folder contains
  // another plan or is not a plan's folder.
  PlanFolder(const Plan& plan, const std::filesystem::path& out, bool make = true);
  // Opens an existing folder. Throws InputError.
  explicit PlanFolder(const std::filesystem::path& folder);

  const Plan& plan() const { return plan_; }
  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path policy_folder(const std::string& policy) const { return path_ / policy; }
  std::filesystem::path run_folder(const std::string& policy, const std::string& task) const;
  std::filesystem::path shard_folder(const Shard& shard) const { return path_ / kPartsFolder / shard.name(); }
  // Returns true if the folder contains the results of the shard or of its merged run.
  bool has(const Shard& shard) const;
  // Returns true if the folder contains all planned episodes of this run.
  bool has_run(const std::string& policy, const std::string& task) const;
  // Throws InputError if the folder contains a run with only some of its episodes, which a merge cannot
  // complete.
  void CheckNoneIsInterrupted() const;

  // Copies a finished shard's run folder into this folder, unless it is already there. If writing fails,
  // throws InputError or EnvironmentError (base/file_errors.h), without leaving a partial copy.
  void Put(const Shard& shard, const std::filesystem::path& finished) const;

 private:
  Plan plan_;
  std::filesystem::path path_;
  // Run folders that were found to have all their episodes.
  mutable std::set<std::filesystem::path> whole_;
};

// While this object exists, a marker in the plan's folder shows that this process is running the shard. Other
// machines consider the process alive until the marker is older than kGone.
class AtWork {
 public:
  static constexpr std::chrono::seconds kRefreshPeriod{10};
  static constexpr std::chrono::seconds kGone{60};

  AtWork(const PlanFolder& folder, const Shard& shard);
  ~AtWork();
  AtWork(const AtWork&) = delete;
  AtWork& operator=(const AtWork&) = delete;
  // Updates the marker's time stamp, at most once per kRefreshPeriod. Must be called at least that often;
  // otherwise, other machines consider the process stopped after kGone.
  void Refresh();

 private:
  std::filesystem::path file_;
  std::chrono::steady_clock::time_point refreshed_;
};

// Splits the name of a hidden file in parts/ into the shard's name and the suffix: "HOST-PID" (running),
// "HOST-PID.coming" (being copied), "HOST-PID.merged" (being removed) or "failed". Both are empty for other
// names.
std::pair<std::string, std::string> ParseHidden(const std::string& name);

// Syncs a file or folder to disk by fsync, or its whole file system by syncfs.
void SyncToDisk(const std::filesystem::path& path, int (*sync)(int));

// Throws InputError if the folder of --out exists and is not an empty folder.
void CheckOutIsNew(const std::filesystem::path& out);

// Writes the reason why a shard failed to parts/.SHARD.failed. An empty `why` removes the file.
void WriteFailure(const PlanFolder& folder, const Shard& shard, const std::string& why);

}  // namespace evalbus::plans
