#include "metrics/statistics/letters.h"

#include <gtest/gtest.h>

#include <random>

namespace evalbus::metrics::letters_test {

using Matrix = std::vector<std::vector<bool>>;
using Letters = std::vector<std::string>;

Matrix Differ(size_t n, const std::vector<std::pair<size_t, size_t>>& pairs) {
  Matrix matrix(n, std::vector<bool>(n));
  for (const auto& [i, j] : pairs) matrix[i][j] = matrix[j][i] = true;
  return matrix;
}

TEST(Letters, ByHand) {
  EXPECT_EQ(CompactLetters(Differ(3, {})), (Letters{"a", "a", "a"}));
  EXPECT_EQ(CompactLetters(Differ(3, {{0, 2}})), (Letters{"a", "ab", "b"}));
  EXPECT_EQ(CompactLetters(Differ(3, {{0, 1}, {0, 2}, {1, 2}})), (Letters{"a", "b", "c"}));
  EXPECT_EQ(CompactLetters(Differ(4, {{0, 2}, {0, 3}, {1, 3}})), (Letters{"a", "ab", "bc", "c"}));
  // The order is not the order of the rates: only the middle policy differs from the last.
  EXPECT_EQ(CompactLetters(Differ(3, {{1, 2}})), (Letters{"ab", "a", "b"}));
  EXPECT_EQ(CompactLetters({}), Letters{});
}

TEST(Letters, AreSharedJustByThoseThatDoNotDiffer) {
  std::mt19937 random(3);
  for (int trial = 0; trial < 300; ++trial) {
    const size_t n = 2 + random() % 6;
    Matrix differs(n, std::vector<bool>(n));
    for (size_t i = 0; i < n; ++i) {
      for (size_t j = i + 1; j < n; ++j) differs[i][j] = differs[j][i] = random() % 3 == 0;
    }
    const Letters letters = CompactLetters(differs);
    for (size_t i = 0; i < n; ++i) {
      EXPECT_FALSE(letters[i].empty());
      for (size_t j = i + 1; j < n; ++j) {
        EXPECT_EQ(letters[i].find_first_of(letters[j]) == std::string::npos, differs[i][j]);
      }
    }
  }
}

}  // namespace evalbus::metrics::letters_test
