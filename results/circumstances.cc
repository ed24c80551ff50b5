#include "results/circumstances.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>

#include "base/errors.h"
#include "base/run_layout.h"
#include "base/text.h"
#include "metrics/statistics/holm.h"
#include "metrics/statistics/interval.h"

namespace evalbus::results {
namespace {

// Number of bins that are shown for a parameter with many values.
constexpr int kShownBins = 5;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// The values of a parameter, one for each episode that has it, and whether that episode succeeded.
struct Values {
  std::string name;
  std::vector<double> value;
  std::vector<bool> success;
  // The list of choices if the value is an index; otherwise empty.
  std::vector<std::string> choices{};

  bool is_constant() const {
    return std::ranges::adjacent_find(value, std::ranges::not_equal_to()) == value.end();
  }
};

bool Counts(const RecordedEpisode& episode) { return episode.complete && episode.judged(); }

// Returns the distractor of a parameter, for example "mug" for "mug_x_m"; other names are returned unchanged.
std::string PartOf(const std::string& name) {
  const size_t end = name.rfind("_x_m");
  return end == std::string::npos ? name : name.substr(0, end);
}

// Returns the list from which a parameter is chosen, from run.json; empty if the parameter is not a choice.
std::vector<std::string> ChoicesOf(const std::string& name, const RecordedRun& run) {
  const auto lists = run.info.find(kParameterChoices);
  if (lists == run.info.end()) return {};
  try {
    return lists->value(name, std::vector<std::string>());
  } catch (const nlohmann::json::exception&) {
    throw InputError(fmt::format("{}: \"{}\": expected lists of strings", (run.folder / kRunJson).string(),
                                 kParameterChoices));
  }
}

// Throws InputError if the parameter has choices and the value is not an index into them.
void CheckChoice(const Values& values, double value, const RecordedRun& run) {
  const size_t count = values.choices.size();
  if (count == 0 || (value >= 0 && value < static_cast<double>(count) && value == std::floor(value))) return;
  throw InputError(fmt::format(
      "{}: {} is {}, expected a whole number from 0 to {}, an index into its \"{}\" in {}",
      (run.folder / kEpisodesJsonl).string(), values.name, value, count - 1, kParameterChoices, kRunJson));
}

// Returns the parameters of a run that vary, in the order in which they first occur. If some episodes lack a
// parameter, NAME_present is added: 1 for episodes that have it and 0 for the others. Parameters that are
// present in the same episodes share one NAME_present.
std::vector<Values> ValuesOf(const RecordedRun& run) {
  std::vector<std::string> names;
  for (const RecordedEpisode& episode : run.episodes) {
    for (const auto& [name, value] : episode.parameters) {
      if (std::ranges::find(names, name) == names.end()) names.emplace_back(name);
    }
  }
  std::vector<Values> all;
  std::set<std::vector<double>> presences;
  for (const std::string& name : names) {
    Values values{.name = name, .value = {}, .success = {}};
    Values presence{.name = PartOf(name) + "_present", .value = {}, .success = {}};
    for (const RecordedEpisode& episode : run.episodes) {
      if (!Counts(episode)) continue;
      const auto& parameters = episode.parameters;
      const auto found = std::ranges::find(parameters, name, [](const auto& entry) { return entry.first; });
      const bool has = found != parameters.end();
      presence.value.push_back(has ? 1 : 0);
      presence.success.push_back(episode.success);
      if (!has) continue;
      values.value.push_back(found->second);
      values.success.push_back(episode.success);
    }
    if (!presence.is_constant() && presences.insert(presence.value).second) all.push_back(presence);
    values.choices = ChoicesOf(name, run);
    for (const double value : values.value) CheckChoice(values, value, run);
    if (!values.is_constant()) all.push_back(std::move(values));
  }
  return all;
}

// Divides the values into at most `most` bins, ascending.
std::vector<CircumstanceBin> BinsOf(const Values& values, int most) {
  const std::vector<int> bin_of = metrics::RankBins(values.value, most);
  std::vector<CircumstanceBin> bins(static_cast<size_t>(std::ranges::max(bin_of)) + 1,
                                    {.from = kInfinity, .to = -kInfinity, .episodes = {}});
  for (size_t i = 0; i < bin_of.size(); ++i) {
    CircumstanceBin& bin = bins[static_cast<size_t>(bin_of[i])];
    bin.from = std::min(bin.from, values.value[i]);
    bin.to = std::max(bin.to, values.value[i]);
    ++bin.episodes.trials;
    bin.episodes.successes += values.success[i];
  }
  return bins;
}

std::vector<metrics::RateBin> RatesOf(const std::vector<CircumstanceBin>& bins) {
  std::vector<metrics::RateBin> rates;
  for (const CircumstanceBin& bin : bins) rates.push_back(bin.episodes);
  return rates;
}

Circumstance TestChoices(const Values& values) {
  // Each choice has its own bin.
  Circumstance result{.name = values.name,
                      .episodes = {},
                      .is_choice = true,
                      .inside = {},
                      .bins = BinsOf(values, static_cast<int>(values.choices.size()))};
  const std::vector<metrics::RateBin> rates = RatesOf(result.bins);
  const std::vector<bool> is_low = metrics::FindLowGroup(rates);
  for (size_t i = 0; i < rates.size(); ++i) {
    CircumstanceBin& bin = result.bins[i];
    bin.choice = values.choices[static_cast<size_t>(bin.from)];
    bin.is_low = is_low[i];
    result.episodes.trials += rates[i].trials;
    result.episodes.successes += rates[i].successes;
    if (!bin.is_low) continue;
    result.inside.trials += rates[i].trials;
    result.inside.successes += rates[i].successes;
  }
  result.p = metrics::RangeScan::UnorderedP(rates);
  return result;
}

Circumstance Test(const Values& values, metrics::RangeScan* scan) {
  if (!values.choices.empty()) return TestChoices(values);
  Circumstance result{.name = values.name, .episodes = {}, .inside = {}, .bins = BinsOf(values, kShownBins)};
  const std::vector<CircumstanceBin> fine = BinsOf(values, metrics::RangeScan::BinsFor(values.value.size()));
  const std::vector<metrics::RateBin> rates = RatesOf(fine);
  for (const metrics::RateBin& bin : rates) {
    result.episodes.trials += bin.trials;
    result.episodes.successes += bin.successes;
  }
  result.p = scan->P(rates);
  const metrics::BinRange range = metrics::FindRange(rates);
  const auto first = static_cast<size_t>(range.first), last = static_cast<size_t>(range.last);
  result.from = first == 0 ? -kInfinity : std::midpoint(fine[first - 1].to, fine[first].from);
  result.to = last + 1 == fine.size() ? kInfinity : std::midpoint(fine[last].to, fine[last + 1].from);
  for (size_t i = first; i <= last; ++i) {
    result.inside.trials += rates[i].trials;
    result.inside.successes += rates[i].successes;
  }
  return result;
}

}  // namespace

ParameterName NameOfParameter(const std::string& name) {
  const auto stem = [&](size_t ending) { return Words(name.substr(0, name.size() - ending)); };
  if (name.ends_with("_rad")) return {stem(4), "degrees", 180 / std::numbers::pi};
  if (name.ends_with("_m")) return {stem(2), "m"};
  if (name.ends_with("_choice")) return {stem(7), ""};
  return {Words(name), ""};
}

metrics::Interval CircumstanceBin::wilson() const {
  return metrics::WilsonInterval(episodes.successes, episodes.trials);
}

std::vector<RunCircumstances> FindCircumstances(const std::vector<const RecordedRun*>& runs) {
  std::vector<RunCircumstances> all;
  std::vector<double> p;
  metrics::RangeScan scan;
  for (const RecordedRun* run : runs) {
    RunCircumstances found{
        .run = run->name, .policy = run->policy, .task = run->task_name(), .episodes = {}, .parameters = {}};
    for (const RecordedEpisode& episode : run->episodes) {
      if (!Counts(episode)) continue;
      ++found.episodes.trials;
      found.episodes.successes += episode.success;
    }
    for (const Values& values : ValuesOf(*run)) {
      found.parameters.push_back(Test(values, &scan));
      p.push_back(found.parameters.back().p);
    }
    all.push_back(std::move(found));
  }
  const std::vector<double> adjusted = metrics::HolmAdjusted(p);
  size_t next = 0;
  for (RunCircumstances& run : all) {
    run.tested = static_cast<int>(p.size());
    for (Circumstance& parameter : run.parameters) parameter.p_holm = adjusted[next++];
  }
  return all;
}

}  // namespace evalbus::results
