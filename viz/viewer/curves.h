// The scores of an episode as curves: names, labels and values per tick. They are computed only from
// messages, so the live page and a report show the same curves.
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
  std::string name;  // as in summary.json, without the part's name; or "gripper_opening", "clearance_m"
  std::string label;
  std::string unit;  // display unit
  Better better = Better::kNeither;
  // The displayed value is the SI value multiplied by this scale.
  double scale = 1;
  // Name of each row. It may be empty if there is a single row.
  std::vector<std::string> parts;
  size_t first_row = 0;
  // True if there are values only at some ticks. They must not be interpolated.
  bool is_sparse = false;
};

class CurveTable {
 public:
  CurveTable() = default;
  // `partial` determines the available arms, distances and metrics, which are the same in all messages of a
  // run.
  CurveTable(const model_info_t& model, const partial_metrics_t& partial);

  // The curves, the most important first. Sums and means over arms are omitted, because the per-arm curves
  // contain the same information. Stages are omitted, because they are events.
  const std::vector<Curve>& curves() const { return curves_; }
  size_t rows() const { return rows_.size(); }

  // Data of one tick, as far as it has been received.
  struct Tick {
    const partial_metrics_t* partial = nullptr;
    // opening: opening of each gripper, 0 to 1. clearance: in m, or NaN if CONTACTS contains none.
    std::span<const double> opening;
    double clearance = std::numeric_limits<double>::quiet_NaN();
  };
  // Writes the values of all rows in SI units; NaN if unavailable.
  void Values(const Tick& tick, std::vector<double>* values) const;

 private:
  using Row = std::function<double(const Tick&)>;
  // A curve with its row functions, before sorting.
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
