#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/text.h"
#include "lcmtypes/metric_catalog.h"
#include "report/page/page.h"
#include "report/page/report_sections.h"
#include "report/page/scale.h"

namespace evalbus::report {
namespace {

// Number of figures that are initially visible; the other figures can be expanded.
constexpr size_t kHistogramsShown = 8;

// Returns false for success, stages and counts per object, and for per-arm values if there is an overall
// value.
bool HasFigure(const MetricNumber& number, const ReportRun& run) {
  if (!number.metric) return true;
  const std::string name(number.metric->name);
  const auto stands_alone = [&](const char* prefix) { return !run.summary.Find(prefix + name); };
  switch (number.metric->kind) {
    case MetricKind::kSuccess:
    case MetricKind::kByStage:
    case MetricKind::kByObject:
      return false;
    default:
      break;
  }
  switch (number.part) {
    case MetricPart::kAverage:
      return stands_alone("total_");
    case MetricPart::kItself:
      return number.of.empty() || stands_alone("total_");
    case MetricPart::kMean:
      return number.of.empty() || stands_alone("overall_avg_");
    case MetricPart::kRms:
      return number.of.empty() || stands_alone("overall_rms_");
    default:
      return true;
  }
}

// Values of a metric in the complete episodes that have it, in its display unit.
struct Distribution {
  const metrics::MetricSummary& metric;
  MetricNumber number;
  HistogramFigure figure;
  // Range of the values in SI units.
  double low = std::numeric_limits<double>::infinity(), high = -low;

  bool empty() const { return figure.succeeded.empty() && figure.failed.empty(); }
};

Distribution DistributionOf(const metrics::MetricSummary& metric, const MetricNumber& number,
                            const ReportRun& run) {
  Distribution result{.metric = metric,
                      .number = number,
                      .figure = {.name = number.label(),
                                 .unit = std::string(number.shown_unit()),
                                 .succeeded = {},
                                 .failed = {},
                                 .p5 = metric.p5 * number.scale(),
                                 .median = metric.median * number.scale(),
                                 .p95 = metric.p95 * number.scale()}};
  for (const results::RecordedEpisode& episode : run.run.episodes) {
    const double value = ValueOf(episode, metric.name);
    if (!episode.complete || !std::isfinite(value)) continue;
    if (IsOfSuccessesOnly(metric.name) && !episode.success) continue;
    (episode.success ? result.figure.succeeded : result.figure.failed).push_back(value * number.scale());
    result.low = std::min(result.low, value);
    result.high = std::max(result.high, value);
  }
  return result;
}

void HistogramCard(const Distribution& distribution, Markup* html) {
  const HistogramFigure& figure = distribution.figure;
  const auto shown = [&](double value) { return Number(value * distribution.number.scale(), 3); };
  html->Element("figure", {{"class", "card"}}, [&] {
    html->Element("figcaption", {{"title", distribution.metric.name}}, [&] {
      html->Text(figure.name);
      if (!figure.unit.empty()) html->Element("span", {{"class", "unit"}}, ", " + figure.unit);
    });
    DrawHistogram(figure, html);
    html->Element("div", {{"class", "note"}},
                  fmt::format("median {}, mean {}, max {}", Number(figure.median, 3),
                              shown(distribution.metric.mean), shown(distribution.metric.max)));
  });
}

void Constants(const std::vector<Distribution>& constant, Markup* html) {
  html->Element("p", {{"class", "note"}}, [&] {
    html->Text("Equal in all complete episodes that have the value: ");
    for (size_t i = 0; i < constant.size(); ++i) {
      const MetricNumber& number = constant[i].number;
      html->Text((i == 0 ? "" : "; ") + number.label() + " ");
      html->Text(WithUnit(Number(constant[i].low * number.scale()), constant[i].figure.unit));
    }
    html->Text(".");
  });
}

// A statistic with its name in summary.json. Two values are the bounds of an interval.
struct Statistic {
  const char* name;
  std::vector<double> (*values)(const metrics::MetricSummary& metric);
};

constexpr Statistic kStatistics[] = {
    {"episodes", [](const auto& metric) { return std::vector{static_cast<double>(metric.episodes)}; }},
    {"mean", [](const auto& metric) { return std::vector{metric.mean}; }},
    {"mean_95",
     [](const auto& metric) {
       return std::vector{metric.mean_95.lower, metric.mean_95.upper};
     }},
    {"std", [](const auto& metric) { return std::vector{metric.std}; }},
    {"median", [](const auto& metric) { return std::vector{metric.median}; }},
    {"p5", [](const auto& metric) { return std::vector{metric.p5}; }},
    {"p95", [](const auto& metric) { return std::vector{metric.p95}; }},
    {"min", [](const auto& metric) { return std::vector{metric.min}; }},
    {"max", [](const auto& metric) { return std::vector{metric.max}; }},
};

// Writes a row with the statistics from summary.json, with their original names and units.
void StatisticsRow(const metrics::MetricSummary& metric, Markup* html) {
  const MetricInfo* info = FindMetric(metric.name).metric;
  const bool has_unit = info && info->unit != "count" && info->unit != "1";
  const auto cell = [&](const Statistic& statistic) {
    const std::vector<double> values = statistic.values(metric);
    if (std::ranges::none_of(values, [](double value) { return std::isfinite(value); }))
      return html->Text("-");  // equal values have no interval
    for (size_t i = 0; i < values.size(); ++i) {
      if (i > 0) html->Text(" to ");
      Data(values[i], html);
    }
  };
  html->Element("tr", {{"data-metric", metric.name}}, [&] {
    html->Element("th", {{"scope", "row"}}, [&] { html->Element("code", {}, metric.name); });
    html->Element("td", {}, has_unit ? std::string(info->unit) : "");
    for (const Statistic& statistic : kStatistics) {
      html->Element("td", {{"class", "number"}, {"data-statistic", statistic.name}},
                    [&] { cell(statistic); });
    }
  });
}

void StatisticsTable(const RunSection& section) {
  const std::vector<metrics::MetricSummary>& metrics = section.run.summary.metrics;
  Markup* html = section.html;
  const auto titles = [&] {
    html->Element("th", {}, "metric");
    html->Element("th", {}, "unit");
    for (const Statistic& statistic : kStatistics) {
      html->Element("th", {{"class", "number"}, {"data-statistic", statistic.name}}, Words(statistic.name));
    }
  };
  const auto rows = [&] {
    for (const metrics::MetricSummary& metric : metrics) StatisticsRow(metric, html);
  };
  html->Element("details", {}, [&] {
    html->Element("summary", {}, fmt::format("All {} metrics in numbers", metrics.size()));
    ScrollingTable({{"class", "sortable"}, {"id", section.id + "statistics"}}, titles, rows, html);
  });
}

}  // namespace

void WriteDistributions(const RunSection& section) {
  const ReportRun& run = section.run;
  // Without a complete episode, there are no metrics.
  if (run.summary.metrics.empty()) return;
  Markup* html = section.html;
  std::vector<Distribution> varying, constant;
  for (const metrics::MetricSummary& metric : run.summary.metrics) {
    const MetricNumber number = FindMetric(metric.name);
    if (!HasFigure(number, run)) continue;
    const Distribution distribution = DistributionOf(metric, number, run);
    if (distribution.empty()) continue;
    (IsRange(distribution.low, distribution.high) ? varying : constant).push_back(distribution);
  }
  std::vector<std::function<void()>> figures;
  for (const Distribution& distribution : varying) {
    figures.push_back([&] { HistogramCard(distribution, html); });
  }
  html->Element("section", {}, [&] {
    html->Element(section.heading, {{"id", section.id + "distributions"}}, "Distributions");
    if (!figures.empty()) {
      html->Element("p", {{"class", "note"}},
                    "Number of complete episodes by value; above the bars: the 5th to 95th percentile and "
                    "the median (dot).");
      Folded(figures, kHistogramsShown, "more distributions", "cards", html);
    }
    if (!constant.empty()) Constants(constant, html);
    StatisticsTable(section);
  });
}

}  // namespace evalbus::report
