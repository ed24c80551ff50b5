#include "base/suggestion.h"

#include <algorithm>
#include <cctype>

namespace evalbus {
namespace {

// Returns the smallest number of insertions, deletions, replacements and swaps of neighboring characters that
// turn a into b; case is ignored. No character is edited after a swap.
size_t EditDistance(const std::string& a, const std::string& b) {
  const auto same = [](char x, char y) { return std::tolower(x) == std::tolower(y); };
  std::vector<std::vector<size_t>> distance(a.size() + 1, std::vector<size_t>(b.size() + 1));
  for (size_t i = 0; i <= a.size(); ++i) {
    for (size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        distance[i][j] = i + j;
        continue;
      }
      const size_t replaced = distance[i - 1][j - 1] + (same(a[i - 1], b[j - 1]) ? 0 : 1);
      distance[i][j] = std::min({distance[i - 1][j] + 1, distance[i][j - 1] + 1, replaced});
      if (i > 1 && j > 1 && same(a[i - 1], b[j - 2]) && same(a[i - 2], b[j - 1]))
        distance[i][j] = std::min(distance[i][j], distance[i - 2][j - 2] + 1);
    }
  }
  return distance[a.size()][b.size()];
}

}  // namespace

std::string NearestName(const std::string& name, const std::vector<std::string>& candidates) {
  std::string nearest;
  size_t least = std::max<size_t>(1, name.size() / 3) + 1;
  for (const std::string& candidate : candidates) {
    // A key without its unit is the most frequent mistake, so it counts as very similar.
    const bool lacks_end = name.size() >= 3 && candidate.starts_with(name + "_");
    const size_t distance = lacks_end ? 1 : EditDistance(name, candidate);
    if (distance < least) {
      least = distance;
      nearest = candidate;
    }
  }
  if (!nearest.empty() || name.size() < 3) return nearest;
  // An abbreviation stands for the shortest candidate that begins with it.
  for (const std::string& candidate : candidates) {
    if (candidate.starts_with(name) && (nearest.empty() || candidate.size() < nearest.size()))
      nearest = candidate;
  }
  return nearest;
}

std::string ListOf(std::vector<std::string> names) {
  std::ranges::sort(names);
  names.erase(std::unique(names.begin(), names.end()), names.end());
  std::string list;
  for (const std::string& name : names) {
    if (!name.empty()) list += (list.empty() ? "" : ", ") + name;
  }
  return list;
}

std::string Suggestion(const std::string& name, const std::vector<std::string>& candidates) {
  const std::string list = ListOf(candidates);
  return Suggestion(name, candidates, list.empty() ? "" : "; expected one of " + list);
}

std::string Suggestion(const std::string& name, const std::vector<std::string>& candidates,
                       const std::string& otherwise) {
  const std::string nearest = NearestName(name, candidates);
  return nearest.empty() ? otherwise : "; did you mean '" + nearest + "'?";
}

}  // namespace evalbus
