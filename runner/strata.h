// Divides many random starts into groups (strata) of neighbors with equal probability. One start from each
// group covers the distribution more evenly than the same number of independent random starts.
#pragma once

#include <set>
#include <vector>

namespace evalbus::runner {

// Divides the points into groups of equal size, up to rounding. Splits recursively along the dimension with
// the largest extent. Extents are measured in ranks over all points, so that units do not matter. All points
// must have the same number of dimensions. Returns the indices of each group's points, in ascending order. If
// there are fewer points than groups, some groups are empty.
std::vector<std::vector<int>> Strata(const std::vector<std::vector<double>>& points, int groups);

// Returns, for each group, its first index that `chosen` contains, if there is one.
std::set<int> FirstOfEach(const std::vector<std::vector<int>>& strata, const std::set<int>& chosen);

}  // namespace evalbus::runner
