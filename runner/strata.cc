#include "runner/strata.h"

#include <algorithm>
#include <numeric>
#include <span>

namespace evalbus::runner {
namespace {

using Points = std::vector<std::vector<double>>;

// Converts values to ranks; equal values have equal ranks.
Points Ranks(const Points& points) {
  Points ranks = points;
  if (points.empty()) return ranks;
  for (size_t dimension = 0; dimension < points[0].size(); ++dimension) {
    std::vector<double> values;
    for (const auto& point : points) values.push_back(point[dimension]);
    std::ranges::sort(values);
    for (size_t k = 0; k < points.size(); ++k) {
      ranks[k][dimension] =
          static_cast<double>(std::ranges::lower_bound(values, points[k][dimension]) - values.begin());
    }
  }
  return ranks;
}

size_t WidestDimension(const Points& ranks, std::span<const int> group) {
  size_t widest = 0;
  double most = -1;
  for (size_t dimension = 0; dimension < ranks[0].size(); ++dimension) {
    const auto rank = [&](int k) { return ranks[static_cast<size_t>(k)][dimension]; };
    const auto [low, high] = std::ranges::minmax(group, {}, rank);
    if (rank(high) - rank(low) > most) {
      most = rank(high) - rank(low);
      widest = dimension;
    }
  }
  return widest;
}

void CutIntoStrata(const Points& ranks, std::span<int> group, int groups,
                   std::vector<std::vector<int>>* strata) {
  if (groups == 1) {
    std::ranges::sort(group);
    strata->emplace_back(group.begin(), group.end());
    return;
  }
  if (!group.empty() && !ranks[0].empty()) {
    const size_t dimension = WidestDimension(ranks, group);
    std::ranges::sort(group, {},
                      [&](int k) { return std::pair(ranks[static_cast<size_t>(k)][dimension], k); });
  }
  const int first = groups / 2;
  const size_t cut = group.size() * static_cast<size_t>(first) / static_cast<size_t>(groups);
  CutIntoStrata(ranks, group.first(cut), first, strata);
  CutIntoStrata(ranks, group.subspan(cut), groups - first, strata);
}

}  // namespace

std::vector<std::vector<int>> Strata(const Points& points, int groups) {
  std::vector<int> all(points.size());
  std::iota(all.begin(), all.end(), 0);
  std::vector<std::vector<int>> strata;
  CutIntoStrata(Ranks(points), all, groups, &strata);
  return strata;
}

std::set<int> FirstOfEach(const std::vector<std::vector<int>>& strata, const std::set<int>& chosen) {
  std::set<int> first;
  for (const std::vector<int>& stratum : strata) {
    const auto found = std::ranges::find_if(stratum, [&](int index) { return chosen.contains(index); });
    if (found != stratum.end()) first.insert(*found);
  }
  return first;
}

}  // namespace evalbus::runner
