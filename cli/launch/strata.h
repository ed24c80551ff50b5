// Starts spread evenly: of many drawn ones, groups of neighbors that are equally likely. One start of each
// group covers what a task draws more evenly than as many that are drawn one by one. Pure.
#pragma once

#include <vector>

namespace evalbus::launch {

// Cuts the points into so many groups, of equal size but for rounding: again and again in halves, each across
// the dimension in which it is widest, measured in ranks over all points (so units do not matter, and each
// group is equally likely). Points are equal in size. Returns each group's points as indices, in order.
// Throws nothing for fewer points than groups: some are empty then.
std::vector<std::vector<int>> Strata(const std::vector<std::vector<double>>& points, int groups);

}  // namespace evalbus::launch
