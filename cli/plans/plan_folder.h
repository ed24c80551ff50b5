// The folder of a plan's results, on a disk that machines may share:
//
//   plan.json                       the plan, resolved
//   POLICY/TASK-VARIATION/          run folders; POLICY/ is a suite
//   parts/SHARD/                    run folders of a few episodes each, until they are merged
//   parts/.SHARD.HOST-PID           who is at work on one, or is about to put it there
//   parts/.SHARD.failed             why one could not be done
//   slurm/                          scripts and logs of the jobs
//
// Nobody holds a lock, and no file is written by two: what is there has come by a rename, whole. So a shard
// that was run twice is there once.
#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cli/plans/plan.h"

namespace evalbus::plans {

inline constexpr char kPlanJson[] = "plan.json";
// Where comparisons were decided (Plan::until).
inline constexpr char kStopsJson[] = "stops.json";
inline constexpr char kPartsFolder[] = "parts";
inline constexpr char kSlurmFolder[] = "slurm";

// Some episodes of one run, from `first` to `last`.
struct Shard {
  std::string policy, task;
  int first = 0, last = 0;

  int size() const { return last - first + 1; }
  // "ckpt-1000+lift_pot-position+0000-0019"; its folder.
  std::string name() const;
};

// Of all runs, in the order of policies, tasks, episodes.
std::vector<Shard> ShardsOf(const Plan& plan);
// Of these the ones of part `part` (from 1) of so many: every so manieth.
std::vector<Shard> ShardsOfPart(const std::vector<Shard>& shards, int part, int parts);

class PlanFolder {
 public:
  // The folder `out`, or where that is empty a new one, runs/PLAN-DATE-TIME; makes it and writes plan.json,
  // unless that is only to be talked of. Throws InputError if another plan is there, or what is no plan's
  // folder.
  PlanFolder(const Plan& plan, const std::filesystem::path& out, bool make = true);
  // One that is there. Throws InputError.
  explicit PlanFolder(const std::filesystem::path& folder);

  const Plan& plan() const { return plan_; }
  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path policy_folder(const std::string& policy) const { return path_ / policy; }
  std::filesystem::path run_folder(const std::string& policy, const std::string& task) const;
  std::filesystem::path shard_folder(const Shard& shard) const { return path_ / kPartsFolder / shard.name(); }
  // Whether the shard's results are there, or its run is.
  bool has(const Shard& shard) const;
  bool has_run(const std::string& policy, const std::string& task) const;

  // Copies a finished shard's run folder here, unless it is there by now. Throws EnvironmentError where the
  // disk refuses; nothing is left then.
  void Put(const Shard& shard, const std::filesystem::path& finished) const;

 private:
  Plan plan_;
  std::filesystem::path path_;
};

// Says in a plan's folder that this process is at work on a shard, as long as it is there; another machine
// sees by its age whether it still is.
class AtWork {
 public:
  static constexpr std::chrono::seconds kTold{10};
  static constexpr std::chrono::seconds kGone{60};

  AtWork(const PlanFolder& folder, const Shard& shard);
  ~AtWork();
  AtWork(const AtWork&) = delete;
  AtWork& operator=(const AtWork&) = delete;
  // To be called often.
  void Tell();

 private:
  std::filesystem::path file_;
  std::chrono::steady_clock::time_point told_;
};

// Of a name in parts/ that begins with a dot: the shard, and what follows its name: "HOST-PID" (at work),
// "HOST-PID.coming" or "failed". Both empty for other names.
std::pair<std::string, std::string> ParseHidden(const std::string& name);

// Why a shard could not be done: said, and taken back when it could.
void SayFailed(const PlanFolder& folder, const Shard& shard, const std::string& why);

}  // namespace evalbus::plans
