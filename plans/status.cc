#include "plans/status.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/input_file.h"
#include "base/run_layout.h"
#include "base/text.h"
#include "results/run_reader.h"
#include "results/summary_table.h"

namespace evalbus::plans {
namespace {

namespace fs = std::filesystem;

constexpr double kRecent_s = 600;

// Returns the seconds since a file was last modified; nullopt if it does not exist. Assumes that the
// machines' clocks roughly agree.
std::optional<double> AgeOf(const fs::path& file) {
  std::error_code error;
  const auto then = fs::last_write_time(file, error);
  if (error) return std::nullopt;
  return std::max(0.0, std::chrono::duration<double>(fs::file_time_type::clock::now() - then).count());
}

std::string FirstLine(const fs::path& file) {
  const std::string text = ReadInput(file);
  return Printable(text.substr(0, text.find('\n')));
}

// Stores the age in `newest_s` if it is smaller.
void KeepNewest(std::optional<double> age_s, std::optional<double>* newest_s) {
  if (age_s) *newest_s = std::min(newest_s->value_or(*age_s), *age_s);
}

// The number of episodes of a plan with `until` depends on its results. Such a plan has no shards.
PlanStatus StatusOfSequential(const PlanFolder& folder) {
  const Plan& plan = folder.plan();
  PlanStatus status;
  status.is_sequential = true;
  status.has_ended = fs::exists(folder.path() / kStopsJson);
  status.episodes = plan.num_runs() * plan.until->max_episodes;
  for (const PlannedPolicy& policy : plan.policies) {
    for (const std::string& task : plan.tasks) {
      const fs::path file = folder.run_folder(policy.name, task) / kEpisodesJsonl;
      const auto lines = static_cast<int>(CountLines(file));
      KeepNewest(AgeOf(file), &status.newest_s);
      status.done += lines;
      status.by_policy[policy.name] += lines;
    }
  }
  return status;
}

}  // namespace

PlanStatus StatusOf(const PlanFolder& folder) {
  if (folder.plan().until) return StatusOfSequential(folder);
  PlanStatus status;
  // Number of episodes by name of the shard. A process that was killed may leave its marker although another
  // one has finished the shard.
  std::map<std::string, int> unfinished;
  double oldest_s = 0;
  int recent = 0, first = 0;
  std::map<fs::path, int> lines_left;  // finished episodes of runs without merged shards
  for (const Shard& shard : ShardsOf(folder.plan())) {
    status.episodes += shard.size();
    if (!folder.has(shard)) {
      unfinished[shard.name()] = shard.size();
      const fs::path run = folder.run_folder(shard.policy, shard.task);
      const auto [left, is_new] = lines_left.emplace(run, 0);
      if (is_new) {
        left->second = static_cast<int>(CountLines(run / kEpisodesJsonl));
        KeepNewest(AgeOf(run / kEpisodesJsonl), &status.newest_s);
      }
      const int there = std::min(left->second, shard.size());
      left->second -= there;
      status.done += there;
      status.by_policy[shard.policy] += there;
      continue;
    }
    status.done += shard.size();
    status.by_policy[shard.policy] += shard.size();
    // The time stamps of merged runs are those of the merge or of --resume, so they do not count for the
    // rate.
    const bool is_merged = !fs::exists(folder.shard_folder(shard));
    const std::optional<double> age_s = AgeOf(is_merged ? folder.run_folder(shard.policy, shard.task)
                                                        : folder.shard_folder(shard) / kRunJson);
    KeepNewest(age_s, &status.newest_s);
    if (!is_merged && age_s && *age_s < kRecent_s) {
      recent += shard.size();
      if (*age_s > oldest_s) {
        oldest_s = *age_s;
        first = shard.size();
      }
    }
  }
  // Episodes that arrived after the first recent shard, divided by the time since then. The first shard was
  // begun earlier, at an unknown time.
  if (recent > first && oldest_s > 0) status.rate = (recent - first) / oldest_s;
  const auto is_at_work = [](const fs::path& marker) {
    const std::optional<double> age_s = AgeOf(marker);
    return age_s && *age_s < AtWork::kGone.count();
  };
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(folder.path() / kPartsFolder, none)) {
    const auto [shard, rest] = ParseHidden(entry.path().filename());
    if (!unfinished.contains(shard)) continue;
    if (rest == "failed") {
      status.failed.push_back({shard, FirstLine(entry.path())});
    } else if (entry.is_regular_file(none) && is_at_work(entry.path())) {
      status.running += unfinished[shard];
      status.at_work.push_back(fmt::format("{}  {}", rest, shard));
    }
  }
  std::ranges::sort(status.at_work);
  std::ranges::sort(status.failed, {}, &PlanStatus::Failed::shard);
  return status;
}

std::string PlanStatus::Text() const {
  std::string text = is_sequential
                         ? fmt::format("{} of at most {} episodes done; the plan {}\n", done, episodes,
                                       has_ended ? "has ended" : "ends when its results suffice ('until')")
                         : fmt::format("{} of {} episodes done ({:.0f} %), {} in running shards, {} failed\n",
                                       done, episodes, 100.0 * done / std::max(episodes, 1), running,
                                       Plural(failed.size(), "shard"));
  if (done < episodes && !has_ended && newest_s) {
    text += fmt::format("newest result {} ago", results::FormatDuration(*newest_s));
    if (!is_sequential && rate > 0 && !at_work.empty()) {
      text += fmt::format("; {:.3g} episodes/s, about {} left", rate,
                          results::FormatDuration((episodes - done) / rate));
    }
    text += '\n';
  }
  for (const auto& [policy, count] : by_policy)
    text += fmt::format("  {}  {}\n", Pad(std::to_string(count), 8), policy);
  for (const std::string& who : at_work) text += "at work: " + who + "\n";
  for (const Failed& one : failed) text += fmt::format("failed: {}: {}\n", one.shard, one.why);
  return text;
}

}  // namespace evalbus::plans
