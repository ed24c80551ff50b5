#include "viz/terminal/metric_table.h"

#include <algorithm>

#include "base/text.h"
#include "viz/watch/score_rows.h"

namespace evalbus::viz {
namespace {

// Column widths. In 80 columns, there is room for the metrics of two arms next to scalar metrics with the
// longest label of the catalog.
constexpr int kArmLabel = 16, kMaxArmLabel = 24, kLabel = 25, kMaxLabel = 30;
constexpr int kUnit = 7, kLabelUnit = 6, kGap = 2;

// Returns whether the screen shows a metric outside this table.
bool IsElsewhere(const MetricInfo& metric) {
  return metric.counter || metric.name == "completion_time" || metric.name == "subtask_progress" ||
         metric.name.starts_with("extended.min_clearance_");
}

// Returns whether the row shows an undesired event: a main metric that counts such events and is above 0, or
// a number that should be high and is negative.
bool IsAlarming(const ScoreRow& row) {
  const MetricInfo& metric = *row.metric;
  return (metric.kind == MetricKind::kCount && metric.better == Better::kLower && metric.main > 0 &&
          row.whole > 0) ||
         (metric.kind == MetricKind::kNumber && metric.better == Better::kHigher && row.whole < 0);
}

// Returns the rank of a row. Task-specific and main metrics have the lowest ranks and are dropped last.
int RankOf(const ScoreRow& row) {
  constexpr int kHowFarAndClean = 10;  // main metrics up to the joint path
  const MetricInfo& metric = *row.metric;
  if (metric.kind == MetricKind::kByName || (metric.kind == MetricKind::kCount && metric.main > 0)) return 3;
  if (row.part == MetricPart::kMean) return 7;
  return metric.main == 0 ? 9 : metric.main <= kHowFarAndClean ? 4 : 5;
}

// A scalar metric, which is shown in the right half of the table.
struct Scalar {
  int rank;
  std::string label, value, unit;
  bool alarming = false;
};

class Table {
 public:
  Table(const partial_metrics_t& scores, bool are_current, int width)
      : arms_(scores.metrics.arm_name), are_current_(are_current), width_(width) {
    value_ = width >= 84 ? 7 : 6;
    const int beside = kGap + kLabel + value_ + kLabelUnit;
    const int numbers = value_ * (static_cast<int>(arms_.size()) + has_whole()) + kUnit;
    two_columns_ = width >= kArmLabel + numbers + beside;
    arm_label_ = std::clamp(width - numbers - (two_columns_ ? beside : 0), kArmLabel, kMaxArmLabel);
    left_width_ = arm_label_ + numbers;

    std::vector<ScoreRow> rows = ScoreRows(scores.metrics, scores.extended);
    std::erase_if(rows, [](const ScoreRow& row) { return IsElsewhere(*row.metric); });
    std::ranges::stable_sort(rows, {}, RankOf);
    if (arms_.size() > 1) left_.push_back({3, Head()});
    for (const ScoreRow& row : rows) Add(row);
  }

  std::vector<RankedLine> Lines() {
    std::vector<RankedLine> lines;
    if (!two_columns_) {
      for (const Scalar& scalar : scalars_) lines.push_back(ScalarLine(scalar, left_width_ - value_ - kUnit));
      lines.insert(lines.end(), left_.begin(), left_.end());
      return lines;
    }
    // Balances the heights of the two halves. Scalars that do not fit next to the per-arm metrics are placed
    // below them.
    const int label = std::min(kMaxLabel, width_ - left_width_ - kGap - value_ - kLabelUnit);
    const size_t height = std::max(left_.size(), (left_.size() + scalars_.size() + 1) / 2);
    for (size_t i = height; i < scalars_.size(); ++i) {
      left_.push_back(ScalarLine(scalars_[i], left_width_ - value_ - kUnit));
    }
    for (size_t i = 0; i < height; ++i) {
      RankedLine row = i < left_.size() ? left_[i] : RankedLine{9, {}};
      row.line.push_back(
          {std::string(static_cast<size_t>(std::max(0, left_width_ + kGap - LineWidth(row.line))), ' ')});
      if (i < scalars_.size()) {
        // A line with two metrics is kept as long as the more important one would be kept.
        const RankedLine right = ScalarLine(scalars_[i], label);
        row.rank = std::min(row.rank, right.rank);
        row.line.insert(row.line.end(), right.line.begin(), right.line.end());
      }
      lines.push_back(std::move(row));
    }
    return lines;
  }

 private:
  // The column for all arms together is shown only if there are two arms.
  bool has_whole() const { return arms_.size() == 2; }
  std::string Shown(const MetricInfo& metric, double value) const {
    return are_current_ ? ShownValue(metric, value) : "-";
  }

  Line Head() const {
    Line head = {{std::string(static_cast<size_t>(arm_label_), ' ')}};
    for (const std::string& name : arms_)
      head.push_back({Pad(Cut(Printable(name), value_ - 1), value_), Style::kQuiet});
    if (has_whole()) head.push_back({Pad("both", value_), Style::kQuiet});
    return head;
  }

  void Add(const ScoreRow& row) {
    const MetricInfo& metric = *row.metric;
    const std::string unit(metric.shown_unit);
    const bool by_arm = row.of == arms_ || (row.each.size() == 1 && arms_.size() == 1);
    if (!row.each.empty() && by_arm) {
      Line line = {{Fit(row.label, arm_label_), Style::kQuiet}};
      for (const double value : row.each) line.push_back({Pad(Shown(metric, value), value_)});
      if (has_whole()) {
        const bool exists = metric.kind == MetricKind::kSumByArm || metric.kind == MetricKind::kJerk;
        line.push_back({Pad(exists ? Shown(metric, row.whole) : "", value_)});
      }
      line.push_back({Fit(unit.empty() ? "" : " " + unit, kUnit), Style::kQuiet});
      left_.push_back({RankOf(row), std::move(line)});
      return;
    }
    if (row.each.empty()) {
      scalars_.push_back(
          {RankOf(row), row.label, Shown(metric, row.whole), unit, are_current_ && IsAlarming(row)});
    }
    // The values belong to grippers whose names do not match the arms.
    for (size_t k = 0; k < row.each.size(); ++k) {
      const std::string of = row.of[k].empty() ? "" : ", " + Printable(row.of[k]);
      scalars_.push_back({RankOf(row), row.label + of, Shown(metric, row.each[k]), unit});
    }
  }

  RankedLine ScalarLine(const Scalar& scalar, int label_width) const {
    return {scalar.rank,
            {{Fit(scalar.label, label_width), Style::kQuiet},
             {Pad(scalar.value, value_), scalar.alarming ? Style::kBad : Style::kPlain},
             {Fit(scalar.unit.empty() ? "" : " " + scalar.unit, kUnit), Style::kQuiet}}};
  }

  const std::vector<std::string>& arms_;
  bool are_current_;
  int width_, value_, arm_label_, left_width_;
  bool two_columns_;
  std::vector<RankedLine> left_;
  std::vector<Scalar> scalars_;
};

}  // namespace

std::vector<RankedLine> MetricTable(const partial_metrics_t& scores, bool are_current, int width) {
  return Table(scores, are_current, width).Lines();
}

}  // namespace evalbus::viz
