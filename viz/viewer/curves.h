// The scores of an episode as curves: which there are, what they are called, and their values at a tick. Made
// of messages alone, so that the live page and a report show the same.
#pragma once

#include <functional>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "evalbus/model_info_t.hpp"
#include "evalbus/partial_metrics_t.hpp"
#include "lcmtypes/metric_catalog.h"

namespace evalbus::viz {

struct Curve {
  std::string name;  // as in summary.json, without the part; "gripper_opening", "clearance_m"
  std::string label;
  std::string unit;  // shown
  Better better = Better::kNeither;
  // Shown value = SI value * scale.
  double scale = 1;
  // One row for each; a single one may be "".
  std::vector<std::string> parts;
  size_t first_row = 0;
  // Has values at some ticks only, with nothing between them.
  bool is_sparse = false;
};

class CurveTable {
 public:
  CurveTable() = default;
  // `partial` says which arms, distances and metrics there are: of a run each has the same.
  CurveTable(const model_info_t& model, const partial_metrics_t& partial);

  // Those that explain most come first. Sums and means over arms say nothing that the arms' own do not;
  // stages are events.
  const std::vector<Curve>& curves() const { return curves_; }
  size_t rows() const { return rows_.size(); }

  // A tick as far as it is known.
  struct Tick {
    const partial_metrics_t* partial = nullptr;
    // Of each gripper, 0 to 1; and, m, NaN where CONTACTS has none.
    std::span<const double> opening;
    double clearance = std::numeric_limits<double>::quiet_NaN();
  };
  // In SI units, for all rows; NaN where there is no value.
  void Values(const Tick& tick, std::vector<double>* values) const;

 private:
  using Row = std::function<double(const Tick&)>;
  // A curve of one or several rows, before they are put in order.
  struct Entry {
    Curve curve;
    std::vector<Row> rows;
  };
  void AddRoboEval(const MetricInfo& metric, const metric_values_t& v, std::vector<Entry>* entries) const;
  void AddExtended(const extended_metrics_t& e, std::vector<Entry>* entries) const;

  std::vector<Curve> curves_;
  std::vector<Row> rows_;
};

}  // namespace evalbus::viz
