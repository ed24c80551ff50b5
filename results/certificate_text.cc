#include "results/certificate_text.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

#include "base/text.h"
#include "lcmtypes/end_reason.h"
#include "metrics/statistics/interval.h"
#include "results/comparison_json.h"
#include "results/comparison_text.h"

namespace evalbus::results {
namespace {

using nlohmann::ordered_json;

// Maximum number of flipped seeds to list as text.
constexpr size_t kMaxFlips = 10;

// Number of pairs of all policies on an engine, and number of pairs whose verdicts flip.
struct Flips {
  int flipped = 0, pairs = 0;
};
Flips FlipsOn(const std::string& engine, const Certificate& certificate) {
  Flips sum;
  for (const PolicyOnEngine& one : certificate.comparisons) {
    if (one.engine != engine) continue;
    sum.flipped += one.flipped();
    sum.pairs += one.comparison.success.pairs.pairs();
  }
  return sum;
}

std::string ShareText(int successes, int trials) { return Percent(static_cast<double>(successes) / trials); }

// Returns Wilson's interval of the share of pairs whose verdicts flip. Pairs that are all equal count as one.
metrics::Interval FlippedShare(const PolicyOnEngine& one) {
  const SuccessComparison& success = one.comparison.success;
  const int pairs = success.pairs.pairs(), samples = success.samples.pairs.pairs();
  return metrics::WilsonInterval(pairs > 0 ? static_cast<double>(samples) * one.flipped() / pairs : 0,
                                 samples);
}

std::string StageName(const StageParting& parting, const StageNames& stages) {
  const auto task = stages.find(parting.task);
  if (task == stages.end()) return "";
  const auto name = task->second.find(parting.stage);
  return name == task->second.end() ? "" : name->second;
}

std::string CertificateRow(const std::string& policy, int width, const std::string& engine,
                           const std::string& reference, const std::string& here, const std::string& flipped,
                           const std::string& interval, const std::string& lost, const std::string& gained,
                           const std::string& p, const std::string& holm) {
  return fmt::format("{}  {:>7}  {:>9}  {:>5}  {:>12}  {:>13}  {:>4}  {:>6}  {:>6}  {:>6}\n",
                     Pad(policy, -width), engine, reference, here, flipped, interval, lost, gained, p, holm);
}

std::string Table(const Certificate& certificate) {
  int width = 6;
  for (const PolicyOnEngine& one : certificate.comparisons) {
    width = std::max(width, static_cast<int>(one.policy.size()));
  }
  const std::string& reference = certificate.engines.front();
  std::string text = CertificateRow("policy", width, "MuJoCo", "on " + reference, "here", "flipped",
                                    "95 % interval", "lost", "gained", "p", "Holm");
  for (const PolicyOnEngine& one : certificate.comparisons) {
    const SuccessComparison& success = one.comparison.success;
    const int pairs = success.pairs.pairs();
    const metrics::Interval share = FlippedShare(one);
    text += CertificateRow(
        one.policy, width, one.engine, ShareText(success.baseline_successes, success.baseline_trials),
        ShareText(success.successes, success.trials), fmt::format("{} of {}", one.flipped(), pairs),
        fmt::format("{:.0f} to {:.0f} %", 100 * share.lower, 100 * share.upper),
        std::to_string(success.pairs.only_b), std::to_string(success.pairs.only_a), PText(success.p),
        PText(success.p_adjusted));
  }
  return text + fmt::format(
                    "\nPairs of episodes with equal seeds. Lost, gained: succeeded only on {}, or only on "
                    "the row's engine.\n"
                    "p: exact McNemar test of the two success rates; Holm: p adjusted for {}.\n"
                    "Interval: of the flipped share, Wilson.\n",
                    reference, Plural(static_cast<int64_t>(certificate.comparisons.size()), "comparison"));
}

// Returns text on differences besides the verdicts, and on the stages at which episodes diverge.
std::string Partings(const Certificate& certificate, const StageNames& stages) {
  std::string text;
  for (const PolicyOnEngine& one : certificate.comparisons) {
    text += fmt::format("{} on {}: {} of {} differ in some number; ", one.policy, one.engine, one.different,
                        Plural(one.pairs, "episode"));
    std::vector<std::string> parts;
    for (const StageParting& parting : one.partings) {
      const std::string name = StageName(parting, stages);
      parts.push_back(fmt::format("stage {}{}, in {} ({} only on {}, first seed {})", parting.stage,
                                  name.empty() ? "" : " of " + parting.task + ", " + name,
                                  Plural(parting.pairs, "episode"), parting.only_reference,
                                  certificate.engines.front(), parting.seed));
    }
    text += parts.empty()
                ? "all reach the same stages\n"
                : fmt::format("first stage at which the engines differ: {}\n", fmt::join(parts, "; "));
  }
  return text;
}

std::string FlippedSeeds(const Certificate& certificate) {
  std::vector<std::string> lines;
  const std::string& reference = certificate.engines.front();
  for (const PolicyOnEngine& one : certificate.comparisons) {
    for (const TaskComparison& task : one.comparison.tasks) {
      for (const ComparedPair& pair : task.flipped()) {
        const std::string &good = pair.run.success ? one.engine : reference,
                          &bad = pair.run.success ? reference : one.engine;
        lines.push_back(fmt::format("{}, {}, seed {} (episode {}): success on {}, {} on {}\n", one.policy,
                                    task.name(), pair.seed, pair.run.episode, good,
                                    end_reason::Text(pair.failed().failure_reason), bad));
      }
    }
  }
  if (lines.empty()) return "";
  const size_t more = lines.size() - std::min(lines.size(), kMaxFlips);
  lines.resize(lines.size() - more);
  return fmt::format("\nFlipped\n{}{}", fmt::join(lines, ""),
                     more > 0 ? fmt::format("{} more in the JSON file\n", more) : "");
}

std::string Ranking(const Certificate& certificate) {
  if (certificate.pairs.empty()) return "";
  if (certificate.ranking_survives()) {
    return fmt::format(
        "\nThe ranking of the policies is the same on each engine: no pair of them changes its order, and "
        "the "
        "verdict of\n{} is the same.\n",
        certificate.pairs.size() == 1 ? "their comparison"
                                      : fmt::format("each of the {} comparisons", certificate.pairs.size()));
  }
  std::string text = "\nThe ranking of the policies differs between the engines\n";
  for (const PolicyPair& pair : certificate.pairs) {
    if (!pair.order_reverses() && !pair.verdict_changes()) continue;
    std::vector<std::string> on;
    for (size_t i = 0; i < pair.on_engine.size(); ++i) {
      const SuccessComparison& success = pair.on_engine[i];
      const char* const word = Word(success.judgment());
      on.push_back(fmt::format("{} against {} on {}, {}{}{}", ShareText(success.successes, success.trials),
                               ShareText(success.baseline_successes, success.baseline_trials),
                               certificate.engines[i], PEquals(success.p_adjusted), *word ? ", " : "", word));
    }
    text += fmt::format("{} against {}{}: {}\n", pair.policy, pair.baseline,
                        pair.order_reverses() ? " (order reverses)" : "", fmt::join(on, "; "));
  }
  return text +
         "p: as in the ranking of 'evalbus compare', adjusted with Holm's method for all pairs of "
         "policies.\n";
}

ordered_json JsonOf(const PolicyOnEngine& one, const StageNames& stages) {
  const SuccessComparison& success = one.comparison.success;
  const metrics::Interval share = FlippedShare(one);
  ordered_json json = {{"policy", one.policy},
                       {"engine", one.engine},
                       {"success", SuccessJson(success)},
                       {"pairs", success.pairs.pairs()},
                       {"flipped", one.flipped()},
                       {"flipped_95", {share.lower, share.upper}},
                       {"lost", success.pairs.only_b},
                       {"gained", success.pairs.only_a},
                       {"different", one.different},
                       {"flips", ordered_json::array()},
                       {"partings", ordered_json::array()},
                       {"remarks", one.comparison.remarks}};
  for (const TaskComparison& task : one.comparison.tasks) {
    for (const ComparedPair& pair : task.flipped()) {
      json["flips"].push_back({{"task", task.name()},
                               {"seed", pair.seed},
                               {"episode", pair.run.episode},
                               {"reference_episode", pair.baseline.episode},
                               {"succeeded_here", pair.run.success},
                               {"failure_reason", pair.failed().failure_reason}});
    }
  }
  for (const StageParting& parting : one.partings) {
    json["partings"].push_back({{"task", parting.task},
                                {"stage", parting.stage},
                                {"name", StageName(parting, stages)},
                                {"pairs", parting.pairs},
                                {"only_reference", parting.only_reference},
                                {"seed", parting.seed}});
  }
  return json;
}

}  // namespace

std::string Headline(const Certificate& certificate) {
  std::vector<std::string> flips;
  bool any = false;
  for (size_t i = 1; i < certificate.engines.size(); ++i) {
    const Flips sum = FlipsOn(certificate.engines[i], certificate);
    any |= sum.flipped > 0;
    flips.push_back(fmt::format("{} of {} flip between MuJoCo {} and {}", sum.flipped,
                                Plural(sum.pairs, "episode"), certificate.engines[0],
                                certificate.engines[i]));
  }
  const char* const ranking = certificate.pairs.empty()        ? ""
                              : certificate.ranking_survives() ? "; the ranking of the policies is the same"
                              : std::ranges::any_of(certificate.pairs, &PolicyPair::verdict_changes)
                                  ? "; the ranking of the policies changes"
                                  : "; policies change places between which no engine shows a difference";
  return fmt::format("{}: {}{}.", any ? "Verdicts depend on the engine" : "No verdict flips",
                     fmt::join(flips, ", "), ranking);
}

std::string CertificateText(const Certificate& certificate, const StageNames& stages) {
  std::string text =
      fmt::format("{}\n\n{}\n{}{}{}", Headline(certificate), Table(certificate),
                  Partings(certificate, stages), FlippedSeeds(certificate), Ranking(certificate));
  std::set<std::string> notes;  // most notes are the same for each engine
  for (const PolicyOnEngine& one : certificate.comparisons) {
    for (const std::string& remark : one.comparison.remarks) {
      const std::string note = fmt::format("note: {}: {}\n", one.policy, remark);
      if (notes.insert(note).second) text += note;
    }
  }
  return text;
}

ordered_json CertificateJson(const Certificate& certificate, const StageNames& stages) {
  ordered_json json = {{"headline", Headline(certificate)},
                       {"engines", certificate.engines},
                       {"reference", certificate.engines.front()},
                       {"comparisons", ordered_json::array()},
                       {"ranking_survives", certificate.ranking_survives()},
                       {"pairs", ordered_json::array()}};
  for (const PolicyOnEngine& one : certificate.comparisons)
    json["comparisons"].push_back(JsonOf(one, stages));
  for (const PolicyPair& pair : certificate.pairs) {
    ordered_json entry = {{"policy", pair.policy},
                          {"baseline", pair.baseline},
                          {"order_reverses", pair.order_reverses()},
                          {"verdict_changes", pair.verdict_changes()},
                          {"engines", ordered_json::object()}};
    for (size_t i = 0; i < pair.on_engine.size(); ++i) {
      entry["engines"][certificate.engines[i]] = SuccessJson(pair.on_engine[i]);
    }
    json["pairs"].push_back(std::move(entry));
  }
  return json;
}

}  // namespace evalbus::results
