#include "results/operator_results.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "base/errors.h"
#include "base/text.h"
#include "metrics/statistics/cohen_kappa.h"
#include "results/comparison_json.h"
#include "results/conclusion.h"
#include "results/summary_table.h"

namespace evalbus::results {
namespace {

using nlohmann::ordered_json;

const RecordedEpisode* FindEpisode(const RecordedRun& run, int episode) {
  const auto found = std::ranges::find(run.episodes, episode, &RecordedEpisode::episode);
  return found == run.episodes.end() ? nullptr : &*found;
}

// Returns the run with the verdicts of one operator instead of the automatic verdicts. Episodes on which the
// operator abstained or gave no verdict are omitted. The result has nothing that causes a remark on automatic
// results, such as invalid episodes (RecordedRun::Remarks()).
RecordedRun ByOperator(const RecordedRun& original, const std::vector<Verdict>& verdicts,
                       const std::string& operator_name) {
  RecordedRun run = original;
  run.episodes.clear();
  run.unfinished.clear();
  run.cut_line = 0;
  for (const Verdict& verdict : verdicts) {
    const RecordedEpisode* recorded = FindEpisode(original, verdict.episode);
    if (!recorded || verdict.operator_name != operator_name || verdict.outcome == Outcome::kAbstain) continue;
    RecordedEpisode episode = *recorded;
    episode.complete = true;
    if (episode.invalid) episode.end_reason = "operator";
    episode.invalid = episode.decided_at_start = false;
    episode.success = verdict.outcome == Outcome::kSuccess;
    episode.failure_reason = episode.success ? "" : "operator";
    run.episodes.push_back(std::move(episode));
  }
  std::ranges::sort(run.episodes, {}, &RecordedEpisode::episode);
  run.info.erase("only");
  run.planned = static_cast<int>(run.episodes.size());
  return run;
}

template <class T>
std::optional<double> MeanIfGiven(const std::vector<Verdict>& verdicts, std::optional<T> Verdict::*value) {
  double sum = 0;
  int count = 0;
  for (const Verdict& verdict : verdicts) {
    if (!(verdict.*value)) continue;
    sum += *(verdict.*value);
    ++count;
  }
  return count > 0 ? std::optional(sum / count) : std::nullopt;
}

void CountAgreement(const RecordedRun& run, const std::vector<Verdict>& verdicts,
                    metrics::PairCounts* counts) {
  for (const Verdict& verdict : verdicts) {
    const RecordedEpisode* episode = FindEpisode(run, verdict.episode);
    if (!episode || !episode->complete || !episode->judged() || verdict.outcome == Outcome::kAbstain)
      continue;
    const bool a = verdict.outcome == Outcome::kSuccess, b = episode->success;
    ++(a && b ? counts->both : a ? counts->only_a : b ? counts->only_b : counts->neither);
  }
}

std::set<std::string> OperatorsOf(const std::vector<Verdict>& verdicts) {
  std::set<std::string> names;
  for (const Verdict& verdict : verdicts) names.insert(verdict.operator_name);
  return names;
}

std::string AgreementSentence(const OperatorResult& result) {
  const metrics::PairCounts& counts = result.agreement;
  if (counts.pairs() == 0) return "No episode has both this operator's and an automatic verdict.";
  const std::string equal = fmt::format("The automatic verdict is equal in {} of {}",
                                        counts.both + counts.neither, Plural(counts.pairs(), "episode"));
  if (!result.kappa) {
    return equal + "; Cohen's kappa is undefined, because both gave one and the same verdict to all of them.";
  }
  return fmt::format("{}; Cohen's kappa {:.2f}. Success only for the operator: {}; only automatic: {}.",
                     equal, *result.kappa, counts.only_a, counts.only_b);
}

template <class T>
ordered_json ValueOrNull(const std::optional<T>& value) {
  return value ? ordered_json(*value) : ordered_json();
}

ordered_json OperatorJson(const OperatorResult& result) {
  const metrics::RunSummary& rates = result.rates;
  const metrics::PairCounts& counts = result.agreement;
  const bool has_rate = rates.judged > 0;
  return {{"operator", result.operator_name},
          {"judged", rates.judged},
          {"successes", rates.successes},
          {"abstentions", result.abstentions},
          {"operator_success_rate", has_rate ? ordered_json(rates.success_rate) : ordered_json()},
          {"operator_success_rate_wilson_95",
           has_rate ? ordered_json{rates.wilson.lower, rates.wilson.upper} : ordered_json()},
          {"mean_stages_reached", ValueOrNull(result.mean_stages)},
          {"mean_rubric", ValueOrNull(result.mean_rubric)},
          {"agreement",
           {{"episodes", counts.pairs()},
            {"both_success", counts.both},
            {"only_operator_success", counts.only_a},
            {"only_automatic_success", counts.only_b},
            {"both_failure", counts.neither},
            {"cohen_kappa", ValueOrNull(result.kappa)}}}};
}

RecordedRuns AsSuite(const JudgedRun& judged, const std::string& operator_name) {
  return {.folder = judged.run.folder,
          .name = judged.run.name,
          .is_suite = false,
          .runs = {ByOperator(judged.run, judged.verdicts, operator_name)},
          .missing = {}};
}

}  // namespace

std::vector<Verdict> ReadVerdictsOf(const RecordedRun& run) {
  std::vector<Verdict> verdicts = ReadVerdicts(run.folder);
  for (size_t i = 0; i < verdicts.size(); ++i) {
    if (FindEpisode(run, verdicts[i].episode)) continue;
    throw InputError(fmt::format("{}:{}: the run has no episode {}", (run.folder / kVerdictsJsonl).string(),
                                 i + 1, verdicts[i].episode));
  }
  return verdicts;
}

JudgedRun ReadJudgedRun(const std::filesystem::path& folder) {
  RecordedRun run = ReadRun(folder);
  std::vector<Verdict> verdicts = ReadVerdictsOf(run);
  return {std::move(run), std::move(verdicts)};
}

std::vector<OperatorResult> OperatorResults(const RecordedRun& run, const std::vector<Verdict>& verdicts) {
  std::vector<OperatorResult> results;
  for (const std::string& name : OperatorsOf(verdicts)) {
    std::vector<Verdict> own;
    std::ranges::copy_if(verdicts, std::back_inserter(own),
                         [&](const Verdict& verdict) { return verdict.operator_name == name; });
    OperatorResult& result = results.emplace_back();
    result.operator_name = name;
    result.abstentions = static_cast<int>(std::ranges::count(own, Outcome::kAbstain, &Verdict::outcome));
    result.rates = ByOperator(run, own, name).Statistics().Summary(false);
    CountAgreement(run, own, &result.agreement);
    result.kappa = metrics::CohenKappa(result.agreement);
    result.mean_stages = MeanIfGiven(own, &Verdict::stages);
    result.mean_rubric = MeanIfGiven(own, &Verdict::rubric);
  }
  return results;
}

std::optional<Comparison> CompareByOperator(const JudgedRun& run, const JudgedRun& baseline,
                                            const std::string& operator_name) {
  const RecordedRuns a = AsSuite(run, operator_name), b = AsSuite(baseline, operator_name);
  std::set<int64_t> seeds;
  for (const RecordedEpisode& episode : a.runs[0].episodes) seeds.insert(episode.seed);
  const bool has_pair = std::ranges::any_of(
      b.runs[0].episodes, [&](const RecordedEpisode& episode) { return seeds.contains(episode.seed); });
  return has_pair ? std::optional(CompareVerdicts(a, b)) : std::nullopt;
}

std::vector<std::string> OperatorSentences(const OperatorResult& result) {
  const metrics::RunSummary& rates = result.rates;
  const std::string name = Printable(result.operator_name);
  const std::string abstained =
      result.abstentions == 0 ? "" : ", " + Plural(result.abstentions, "abstention");
  std::vector<std::string> sentences;
  if (rates.judged == 0) {
    sentences.push_back(
        fmt::format("Operator {} judged no episode a success or a failure{}.", name, abstained));
  } else {
    sentences.push_back(fmt::format("Operator {}: success in {} of {}, {} (95 % interval {}){}.", name,
                                    rates.successes, Plural(rates.judged, "episode"),
                                    Percent(rates.success_rate), PercentText(rates.wilson), abstained));
  }
  sentences.push_back(AgreementSentence(result));
  if (result.mean_stages)
    sentences.push_back(fmt::format("Mean number of stages reached, as counted by the operator: {:.2f}.",
                                    *result.mean_stages));
  if (result.mean_rubric)
    sentences.push_back(fmt::format("Mean rubric score: {:.2f} of 10.", *result.mean_rubric));
  return sentences;
}

std::vector<std::string> JudgmentLines(const std::vector<JudgedRun>& runs) {
  std::vector<std::string> lines;
  for (const JudgedRun& judged : runs) {
    lines.push_back(fmt::format("{}, policy {}", judged.run.name, Printable(judged.run.policy)));
    const std::vector<OperatorResult> results = OperatorResults(judged.run, judged.verdicts);
    if (results.empty()) lines.push_back("  No verdicts of operators.");
    for (const OperatorResult& result : results) {
      for (const std::string& sentence : OperatorSentences(result)) lines.push_back("  " + sentence);
    }
  }
  if (runs.size() != 2) return lines;
  for (const std::string& name : OperatorsOf(runs[0].verdicts)) {
    const auto comparison = CompareByOperator(runs[1], runs[0], name);
    lines.push_back("Difference by the verdicts of " + Printable(name));
    lines.push_back("  " + (comparison ? Conclusion(*comparison)
                                       : "No pair of episodes has a success or failure on both sides."));
  }
  return lines;
}

ordered_json JudgmentJson(const std::vector<JudgedRun>& runs) {
  ordered_json json = {{"runs", ordered_json::array()}};
  for (const JudgedRun& judged : runs) {
    ordered_json& run = json["runs"].emplace_back(ordered_json{{"run", judged.run.folder.string()},
                                                               {"policy", judged.run.policy},
                                                               {"operators", ordered_json::array()}});
    for (const OperatorResult& result : OperatorResults(judged.run, judged.verdicts))
      run["operators"].push_back(OperatorJson(result));
  }
  if (runs.size() != 2) return json;
  json["comparisons"] = ordered_json::array();
  for (const std::string& name : OperatorsOf(runs[0].verdicts)) {
    const auto comparison = CompareByOperator(runs[1], runs[0], name);
    if (comparison)
      json["comparisons"].push_back({{"operator", name}, {"comparison", ComparisonJson({*comparison})}});
  }
  return json;
}

}  // namespace evalbus::results
