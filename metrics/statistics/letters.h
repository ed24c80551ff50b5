// Compact letter display of pairwise comparisons. Two policies that share a letter do not differ
// significantly; two policies that share no letter do. Source: Piepho 2004, "An algorithm for a letter-based
// representation of all-pairwise comparisons", Journal of Computational and Graphical Statistics 13 (insert
// and absorb).
#pragma once

#include <algorithm>
#include <set>
#include <string>
#include <vector>

namespace evalbus::metrics {

// differs[i][j]: whether policies i and j differ significantly; symmetric. Returns the letters of each
// policy. The letter "a" is assigned first, to the group with the lowest indices. After "z", groups have
// numbers instead of letters.
inline std::vector<std::string> CompactLetters(const std::vector<std::vector<bool>>& differs) {
  const size_t n = differs.size();
  std::set<size_t> all;
  for (size_t i = 0; i < n; ++i) all.insert(i);
  std::vector<std::set<size_t>> groups = {all};
  for (size_t i = 0; i < n; ++i) {
    for (size_t j = i + 1; j < n; ++j) {
      if (!differs[i][j]) continue;
      // Split each group that contains both.
      std::vector<std::set<size_t>> split;
      for (const std::set<size_t>& group : groups) {
        if (!group.contains(i) || !group.contains(j)) {
          split.push_back(group);
          continue;
        }
        for (const size_t without : {i, j}) {
          split.push_back(group);
          split.back().erase(without);
        }
      }
      // Drop groups that another group contains.
      groups.clear();
      for (size_t k = 0; k < split.size(); ++k) {
        const bool is_held = std::ranges::any_of(split, [&](const std::set<size_t>& other) {
          if (&other == &split[k] || !std::ranges::includes(other, split[k])) return false;
          return other.size() > split[k].size() || &other < &split[k];
        });
        if (!is_held) groups.push_back(split[k]);
      }
    }
  }
  std::sort(groups.begin(), groups.end());
  std::vector<std::string> letters(n);
  for (size_t k = 0; k < groups.size(); ++k) {
    const std::string letter = k < 26 ? std::string(1, static_cast<char>('a' + k)) : std::to_string(k);
    for (const size_t i : groups[k]) letters[i] += letter;
  }
  return letters;
}

}  // namespace evalbus::metrics
