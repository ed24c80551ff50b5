#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <vector>

#include "base/text.h"
#include "report/page/page.h"
#include "report/page/report_sections.h"
#include "results/circumstances_text.h"
#include "results/comparison_text.h"

namespace evalbus::report {
namespace {

// Number of figures that are initially visible; the other figures can be expanded.
constexpr size_t kParametersShown = 4;

std::string BinTitle(const results::Circumstance& parameter, const results::CircumstanceBin& bin) {
  const metrics::Interval interval = bin.wilson();
  return fmt::format("{}: {} of {} succeeded, {} (95 % interval {:.0f} to {:.0f} %)",
                     results::BinText(parameter, bin), bin.episodes.successes, bin.episodes.trials,
                     Percent(bin.rate()), 100 * interval.lower, 100 * interval.upper);
}

// Writes the success rate of each choice. If the parameter is significant, the choices of the group with the
// lower rates are bold.
void ChoiceRates(const results::Circumstance& parameter, Markup* html) {
  html->Element("table", {{"class", "bars"}}, [&] {
    html->Element("tbody", {}, [&] {
      for (const results::CircumstanceBin& bin : parameter.bins) {
        html->Element("tr", {{"title", BinTitle(parameter, bin)}}, [&] {
          html->Element("th", {{"scope", "row"}}, [&] {
            html->Element(bin.is_low && parameter.is_shown() ? "b" : "span", {}, bin.choice);
          });
          html->Element("td", {{"class", "bar"}},
                        [&] { DrawShare(bin.rate(), bin.wilson().lower, bin.wilson().upper, false, html); });
          html->Element("td", {{"class", "number"}},
                        fmt::format("{} of {}", bin.episodes.successes, bin.episodes.trials));
        });
      }
    });
  });
}

void RangeRates(const results::Circumstance& parameter, Markup* html) {
  const results::ParameterName name = results::NameOfParameter(parameter.name);
  RateFigure figure{.name = name.label, .unit = name.unit, .bins = {}};
  if (parameter.is_shown()) {
    figure.from = parameter.from * name.scale;
    figure.to = parameter.to * name.scale;
  }
  for (const results::CircumstanceBin& bin : parameter.bins) {
    const metrics::Interval interval = bin.wilson();
    figure.bins.push_back({.from = bin.from * name.scale,
                           .to = bin.to * name.scale,
                           .rate = bin.rate(),
                           .lower = interval.lower,
                           .upper = interval.upper,
                           .title = BinTitle(parameter, bin)});
  }
  DrawRates(figure, html);
}

void ParameterCard(const results::Circumstance& parameter, Markup* html) {
  html->Element("figure", {{"class", "card"}}, [&] {
    html->Element("figcaption", {}, [&] {
      html->Element("b", {}, results::NameOfParameter(parameter.name).label);
      html->Text(", " + results::PEquals(parameter.p_holm));
    });
    (parameter.is_choice ? ChoiceRates : RangeRates)(parameter, html);
  });
}

}  // namespace

void WriteCircumstances(const RunSection& section) {
  const results::RunCircumstances& found = section.run.circumstances;
  // The section is omitted unless there are both successes and failures.
  const bool has_both = found.episodes.successes > 0 && found.episodes.successes < found.episodes.trials;
  if (found.parameters.empty() || !has_both) return;
  std::vector<const results::Circumstance*> parameters;
  for (const results::Circumstance& parameter : found.parameters) parameters.push_back(&parameter);
  std::ranges::stable_sort(parameters, {}, &results::Circumstance::p);
  Markup* html = section.html;
  std::vector<std::function<void()>> figures;
  for (const results::Circumstance* parameter : parameters)
    figures.push_back([parameter, html] { ParameterCard(*parameter, html); });
  html->Element("section", {}, [&] {
    html->Element(section.heading, {{"id", section.id + "circumstances"}}, "Circumstances of failure");
    for (const std::string& sentence : results::CircumstanceSentences(found))
      html->Element("p", {}, sentence);
    html->Element(
        "p", {{"class", "note"}},
        "Success rate by the start's random parameters, with 95 % intervals; most significant first. "
        "Shaded, or bold: the values that differ most from the rest, if p < 0.05. Permutation tests, p "
        "adjusted with Holm's method.");
    Folded(figures, kParametersShown, "more parameters", "cards", html);
  });
}

}  // namespace evalbus::report
