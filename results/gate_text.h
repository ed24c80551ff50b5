// Generates the text of a gate's decision.
#pragma once

#include <string>

#include "results/gate.h"

namespace evalbus::results {

// Returns GateCriterion::why, for example "success 90.0 -> 88.0 % in 200 pairs: a loss of at most 4.2 points
// (one-sided 95 % bound), margin 5 points".
std::string WhyText(const GateCriterion& criterion);

// Returns the output of `evalbus gate`: one line with the verdict and its reason, one line per criterion if
// there are several, and the remarks.
std::string GateText(const Gate& gate);

}  // namespace evalbus::results
