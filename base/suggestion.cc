#include "base/suggestion.h"

#include <algorithm>
#include <cctype>

namespace evalbus {
namespace {

// Number of insertions, deletions and replacements that turn a into b; case is ignored.
size_t EditDistance(const std::string& a, const std::string& b) {
  std::vector<size_t> row(b.size() + 1);
  for (size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (size_t i = 1; i <= a.size(); ++i) {
    size_t diagonal = row[0];
    row[0] = i;
    for (size_t j = 1; j <= b.size(); ++j) {
      const size_t change = diagonal + (std::tolower(a[i - 1]) != std::tolower(b[j - 1]));
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, change});
    }
  }
  return row.back();
}

}  // namespace

std::string NearestName(const std::string& name, const std::vector<std::string>& candidates) {
  std::string nearest;
  size_t least = std::max<size_t>(1, name.size() / 3) + 1;
  for (const std::string& candidate : candidates) {
    // A key without its unit is the most frequent mistake.
    const bool lacks_end = name.size() >= 3 && candidate.starts_with(name + "_");
    const size_t distance = lacks_end ? 1 : EditDistance(name, candidate);
    if (distance < least) {
      least = distance;
      nearest = candidate;
    }
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
