#include "results/circumstances_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/styled_text.h"
#include "base/text.h"
#include "results/comparison_text.h"

namespace evalbus::results {
namespace {

using nlohmann::ordered_json;

constexpr char kPresent[] = " present";

bool IsPresence(const ParameterName& name) { return name.label.ends_with(kPresent); }

// Joins names, for example to "a, b or c".
std::string JoinedByOr(const std::vector<std::string>& names) {
  std::string text;
  for (size_t i = 0; i < names.size(); ++i)
    text += (i == 0 ? "" : i + 1 < names.size() ? ", " : " or ") + names[i];
  return text;
}

// Returns the choices with lower success rates, for example "checker or stripes" or "not oak".
std::string LowChoices(const Circumstance& parameter) {
  std::vector<std::string> low, others;
  for (const CircumstanceBin& bin : parameter.bins) (bin.is_low ? low : others).push_back(bin.choice);
  return others.size() == 1 && low.size() > 1 ? "not " + others[0] : JoinedByOr(low);
}

// Returns the condition under which success is less frequent, for example "pot y is above 0.100 m" or "table
// texture is checker".
std::string WhereItFails(const Circumstance& parameter) {
  const ParameterName name = NameOfParameter(parameter.name);
  if (parameter.is_choice) return name.label + " is " + LowChoices(parameter);
  const bool fails_inside = parameter.inside_rate() < parameter.outside_rate();
  const bool has_lower = std::isfinite(parameter.from), has_upper = std::isfinite(parameter.to);
  if (IsPresence(name)) {
    const std::string part = name.label.substr(0, name.label.size() - std::string(kPresent).size());
    return part + (has_lower == fails_inside ? " is present" : " is absent");
  }
  const auto text = [&](double value) { return ParameterText(parameter, value); };
  if (has_lower && has_upper) {
    return fmt::format("{} is {} {}", name.label, fails_inside ? "within" : "outside",
                       WithUnit(text(parameter.from) + " to " + text(parameter.to), name.unit));
  }
  const bool is_above = has_lower == fails_inside;
  return fmt::format("{} is {} {}", name.label, is_above ? "above" : "below",
                     WithUnit(text(has_lower ? parameter.from : parameter.to), name.unit));
}

// Returns a rate and its counts, for example "7 % (7 of 95)".
std::string CountedRate(double rate, const metrics::RateBin& episodes) {
  return fmt::format("{} ({} of {})", Percent(rate), episodes.successes, episodes.trials);
}

std::string Sentence(const Circumstance& parameter, int tested) {
  const metrics::RateBin outside = {parameter.episodes.trials - parameter.inside.trials,
                                    parameter.episodes.successes - parameter.inside.successes};
  const std::string in = CountedRate(parameter.inside_rate(), parameter.inside);
  const std::string out = CountedRate(parameter.outside_rate(), outside);
  const bool fails_inside = parameter.inside_rate() < parameter.outside_rate();
  return fmt::format("Success falls from {} to {} where {} ({}; {} tested).", fails_inside ? out : in,
                     fails_inside ? in : out, WhereItFails(parameter), PEquals(parameter.p_holm),
                     Plural(tested, "parameter"));
}

std::string SentenceOfNone(const RunCircumstances& run) {
  const std::string episodes = Plural(run.episodes.trials, "episode");
  if (run.episodes.trials == 0) return "No complete episode with a verdict to test.";
  const std::string all = run.episodes.trials == 1 ? "the only episode" : "all " + episodes;
  if (run.episodes.successes == run.episodes.trials) return "Nothing to explain: " + all + " succeeded.";
  if (run.episodes.successes == 0)
    return "No parameter of the start separates successes from failures: " + all + " failed.";
  if (run.parameters.empty()) return "No parameter of the start differs between the episodes.";
  double smallest = 1;
  for (const Circumstance& parameter : run.parameters) smallest = std::min(smallest, parameter.p_holm);
  return fmt::format(
      "No parameter of the start is shown to drive failure ({}, {} tested; smallest adjusted {}).", episodes,
      Plural(run.tested, "parameter"), PEquals(smallest));
}

std::vector<const Circumstance*> Shown(const RunCircumstances& run) {
  std::vector<const Circumstance*> shown;
  for (const Circumstance& parameter : run.parameters) {
    if (parameter.is_shown()) shown.push_back(&parameter);
  }
  std::ranges::stable_sort(shown, {}, [](const Circumstance* parameter) { return parameter->p; });
  return shown;
}

std::string LabelOf(const Circumstance& parameter) {
  const ParameterName name = NameOfParameter(parameter.name);
  return name.unit.empty() ? name.label : name.label + ", " + name.unit;
}

std::string BinRow(const Circumstance& parameter, const CircumstanceBin& bin) {
  const metrics::Interval interval = bin.wilson();
  return fmt::format("    {}  {:>4} of {:<4}  {:>5}  (95 % interval {:.0f} to {:.0f} %)\n",
                     Pad(Printable(BinText(parameter, bin)), -24), bin.episodes.successes,
                     bin.episodes.trials, Percent(bin.rate()), 100 * interval.lower, 100 * interval.upper);
}

ordered_json Bound(double value) { return std::isfinite(value) ? ordered_json(value) : ordered_json(); }

ordered_json RateJson(const metrics::RateBin& episodes) {
  return {{"episodes", episodes.trials}, {"successes", episodes.successes}};
}

// Returns the extent of the values, for example "0.100 to 0.350" or "5 choices".
std::string ExtentText(const Circumstance& parameter) {
  if (parameter.is_choice) return Plural(static_cast<int64_t>(parameter.bins.size()), "choice");
  return ParameterText(parameter, parameter.bins.front().from) + " to " +
         ParameterText(parameter, parameter.bins.back().to);
}

ordered_json ParameterJson(const Circumstance& parameter) {
  ordered_json json = {{"name", parameter.name}};
  json.update(RateJson(parameter.episodes));
  json["p"] = parameter.p;
  json["p_holm"] = parameter.p_holm;
  ordered_json& inside = json[parameter.is_choice ? "low" : "range"];
  if (!parameter.is_choice) inside = {{"from", Bound(parameter.from)}, {"to", Bound(parameter.to)}};
  for (const CircumstanceBin& bin : parameter.bins) {
    if (bin.is_low) inside["choices"].push_back(bin.choice);
  }
  inside.update(RateJson(parameter.inside));
  for (const CircumstanceBin& bin : parameter.bins) {
    ordered_json entry = parameter.is_choice ? ordered_json{{"choice", bin.choice}}
                                             : ordered_json{{"from", bin.from}, {"to", bin.to}};
    entry.update(RateJson(bin.episodes));
    entry["rate_wilson_95"] = {bin.wilson().lower, bin.wilson().upper};
    json["bins"].push_back(std::move(entry));
  }
  return json;
}

}  // namespace

std::string ParameterText(const Circumstance& parameter, double value) {
  const double scale = NameOfParameter(parameter.name).scale;
  // The last decimal resolves about one hundredth of the range of the values.
  const double step = scale * (parameter.bins.back().to - parameter.bins.front().from) / 100;
  return Fixed(scale * value, std::clamp(static_cast<int>(std::ceil(-std::log10(step))), 0, 6));
}

std::string BinText(const Circumstance& parameter, const CircumstanceBin& bin) {
  if (parameter.is_choice) return bin.choice;
  const ParameterName name = NameOfParameter(parameter.name);
  if (IsPresence(name)) return bin.to > 0 ? "present" : "absent";
  const std::string from = ParameterText(parameter, bin.from), to = ParameterText(parameter, bin.to);
  return WithUnit(from == to ? from : from + " to " + to, name.unit);
}

std::vector<std::string> CircumstanceSentences(const RunCircumstances& run) {
  std::vector<std::string> sentences;
  for (const Circumstance* parameter : Shown(run)) sentences.push_back(Sentence(*parameter, run.tested));
  if (sentences.empty()) sentences.push_back(SentenceOfNone(run));
  return sentences;
}

std::string CircumstancesText(const RunCircumstances& run, bool colors) {
  std::string text;
  for (const std::string& sentence : CircumstanceSentences(run))
    text += Styled(sentence, Style::kStrong, colors) + "\n";
  text += fmt::format("{}, {}: {} of {} succeeded\n", Printable(run.task), Printable(run.policy),
                      run.episodes.successes, Plural(run.episodes.trials, "episode"));
  // If all outcomes are equal, each p is 1.
  const bool has_both = run.episodes.successes > 0 && run.episodes.successes < run.episodes.trials;
  if (run.parameters.empty() || !has_both) return text;
  int width = 9;
  for (const Circumstance& parameter : run.parameters) width = std::max(width, Width(LabelOf(parameter)));
  text +=
      fmt::format("\n{}  {:>6}  {:>8}  {}\n", Pad("parameter", -width), "p", "p (Holm)", "success by value");
  for (const Circumstance& parameter : run.parameters) {
    std::vector<double> rates;
    for (const CircumstanceBin& bin : parameter.bins) rates.push_back(bin.rate());
    text += fmt::format("{}  {:>6}  {:>8}  {}  {}\n", Pad(Printable(LabelOf(parameter)), -width),
                        PText(parameter.p), PText(parameter.p_holm),
                        Sparkline(rates, static_cast<int>(rates.size())), ExtentText(parameter));
  }
  for (const Circumstance* parameter : Shown(run)) {
    text += "\n" + Printable(LabelOf(*parameter)) + "\n";
    for (const CircumstanceBin& bin : parameter->bins) text += BinRow(*parameter, bin);
  }
  return text;
}

ordered_json CircumstancesJson(const std::vector<RunCircumstances>& runs) {
  ordered_json json = ordered_json::array();
  for (const RunCircumstances& run : runs) {
    ordered_json entry = {{"run", run.run}, {"policy", run.policy}, {"task", run.task}};
    entry.update(RateJson(run.episodes));
    entry["sentences"] = CircumstanceSentences(run);
    entry["parameters_tested"] = run.tested;
    entry["parameters"] = ordered_json::array();
    for (const Circumstance& parameter : run.parameters)
      entry["parameters"].push_back(ParameterJson(parameter));
    json.push_back(std::move(entry));
  }
  return json;
}

}  // namespace evalbus::results
