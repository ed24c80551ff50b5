// Helpers for metrics that have one accumulator per arm.
#pragma once

#include <vector>

#include "evalbus/metric_values_t.hpp"
#include "metrics/sample/derived_sample.h"

namespace evalbus::metrics {

template <class Accumulator>
void StartEach(std::vector<Accumulator>* arms) {
  for (Accumulator& arm : *arms) arm.Start();
}

// Does not allocate if *values has been filled before.
template <class Accumulator>
void FillEach(const std::vector<Accumulator>& arms, double (Accumulator::*value)() const,
              std::vector<double>* values) {
  values->resize(arms.size());
  for (size_t k = 0; k < arms.size(); ++k) (*values)[k] = (arms[k].*value)();
}

}  // namespace evalbus::metrics
