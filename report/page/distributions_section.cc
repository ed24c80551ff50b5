#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/text.h"
#include "lcmtypes/metric_catalog.h"
#include "report/page/folded.h"
#include "report/page/page.h"
#include "report/page/report_numbers.h"
#include "report/page/report_sections.h"
#include "report/page/scale.h"

namespace evalbus::report {
namespace {

// Number of figures that are initially visible; the rest can be expanded.
constexpr size_t kHistogramsShown = 8;

// Excludes stages, and per-arm values if there is an overall value.
bool HasFigure(const MetricNumber& number, const ReportRun& run) {
  if (!number.metric) return true;
  const std::string name(number.metric->name);
  const auto stands_alone = [&](const char* prefix) { return !FindIn(run, prefix + name); };
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

// A metric over the complete episodes that have it, in its display unit.
struct Distribution {
  const ReportMetric& metric;
  MetricNumber number;
  HistogramFigure figure;
  // Range of the values in SI units.
  double low = std::numeric_limits<double>::infinity(), high = -low;

  bool empty() const { return figure.succeeded.empty() && figure.failed.empty(); }
};

Distribution DistributionOf(const ReportMetric& metric, const MetricNumber& number, const ReportRun& run) {
  const auto shown = [&](const char* name) { return Statistic(&metric, name) * number.scale(); };
  Distribution result{.metric = metric,
                      .number = number,
                      .figure = {.name = number.label(),
                                 .unit = std::string(number.shown_unit()),
                                 .succeeded = {},
                                 .failed = {},
                                 .p5 = shown("p5"),
                                 .median = shown("median"),
                                 .p95 = shown("p95")}};
  for (const ReportEpisode& episode : run.episode) {
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
  const auto shown = [&](const char* name) {
    return Number(Statistic(&distribution.metric, name) * distribution.number.scale(), 3);
  };
  html->Element("figure", {{"class", "card"}}, [&] {
    html->Element("figcaption", {{"title", distribution.metric.name}}, [&] {
      html->Text(figure.name);
      if (!figure.unit.empty()) html->Element("span", {{"class", "unit"}}, ", " + figure.unit);
    });
    DrawHistogram(figure, html);
    html->Element(
        "div", {{"class", "note"}},
        fmt::format("median {}, mean {}, max {}", Number(figure.median, 3), shown("mean"), shown("max")));
  });
}

void Constants(const std::vector<Distribution>& constant, Markup* html) {
  html->Element("p", {{"class", "note"}}, [&] {
    html->Text("The same in every episode: ");
    for (size_t i = 0; i < constant.size(); ++i) {
      const MetricNumber& number = constant[i].number;
      const std::string& unit = constant[i].figure.unit;
      html->Text((i == 0 ? "" : ", ") + number.label() + " ");
      html->Text(Number(constant[i].low * number.scale()) + (unit.empty() ? "" : " " + unit));
    }
    html->Text(".");
  });
}

// Statistics from summary.json with their original names and units.
void StatisticsRow(const ReportMetric& metric, const std::vector<std::string>& columns, Markup* html) {
  const MetricInfo* info = FindMetric(metric.name).metric;
  const bool has_unit = info && info->unit != "count" && info->unit != "1";
  const auto cell = [&](const std::string& column) {
    const auto found = std::ranges::find(metric.statistics, column, &ReportStatistic::name);
    if (found == metric.statistics.end()) return html->Text("-");
    for (size_t i = 0; i < found->value.size(); ++i) {
      if (i > 0) html->Text(" to ");
      Data(found->value[i], html);
    }
  };
  html->Element("tr", {{"data-metric", metric.name}}, [&] {
    html->Element("th", {{"scope", "row"}}, [&] { html->Element("code", {}, metric.name); });
    html->Element("td", {}, has_unit ? std::string(info->unit) : "");
    for (const std::string& column : columns) {
      html->Element("td", {{"class", "number"}, {"data-statistic", column}}, [&] { cell(column); });
    }
  });
}

void StatisticsTable(const RunSection& section) {
  // Columns that at least one metric has, in order.
  std::vector<std::string> columns;
  for (const ReportMetric& metric : section.run.metrics) {
    for (const ReportStatistic& statistic : metric.statistics) {
      if (std::ranges::find(columns, statistic.name) == columns.end()) columns.push_back(statistic.name);
    }
  }
  Markup* html = section.html;
  const auto titles = [&] {
    html->Element("th", {}, "metric");
    html->Element("th", {}, "unit");
    for (const std::string& column : columns) {
      html->Element("th", {{"class", "number"}}, Words(column));
    }
  };
  const auto table = [&] {
    html->Element("thead", {}, [&] { html->Element("tr", {}, titles); });
    html->Element("tbody", {}, [&] {
      for (const ReportMetric& metric : section.run.metrics) StatisticsRow(metric, columns, html);
    });
  };
  html->Element("details", {}, [&] {
    html->Element("summary", {}, fmt::format("All {} metrics in numbers", section.run.metrics.size()));
    html->Element("div", {{"class", "scroll"}, {"tabindex", "0"}}, [&] {
      html->Element("table", {{"class", "sortable"}, {"id", section.id + "statistics"}}, table);
    });
  });
}

}  // namespace

void WriteDistributions(const RunSection& section) {
  const ReportRun& run = section.run;
  Markup* html = section.html;
  std::vector<Distribution> varying, constant;
  for (const ReportMetric& metric : run.metrics) {
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
                    "Number of complete episodes by value; above the bars the 5th to 95th percentile and the "
                    "median (dot).");
      Folded(figures, kHistogramsShown, "more distributions", "cards", html);
    }
    if (!constant.empty()) Constants(constant, html);
    if (!run.metrics.empty()) StatisticsTable(section);
  });
}

}  // namespace evalbus::report
