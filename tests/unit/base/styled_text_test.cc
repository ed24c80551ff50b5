#include "base/styled_text.h"

#include <gtest/gtest.h>

#include <vector>

namespace evalbus::styled_text_test {

TEST(StyledText, HasCodesWithColorsOnly) {
  EXPECT_EQ(Styled("a", Style::kBad, true), "\x1b[38;5;202ma\x1b[0m");
  EXPECT_EQ(Styled("a", Style::kBad, false), "a");
  EXPECT_EQ(Styled("a", Style::kPlain, true), "a");
  EXPECT_EQ(Styled("a\x1b[2J", Style::kStrong, true), "\x1b[1ma?[2J\x1b[0m");
}

TEST(StyledText, FilesHaveNoColors) {
  std::FILE* file = std::tmpfile();
  EXPECT_FALSE(UsesColors(file));
  std::fclose(file);
}

TEST(Sparkline, HasOneBarPerValueUpToTheWidth) {
  EXPECT_EQ(Sparkline({}, 5), "");
  const std::vector<double> some = {0, 0.5, 1};
  EXPECT_EQ(Sparkline(some, 5), "▁▅█");
  // Each bar stands for two values and shows the second one.
  const std::vector<double> more = {0, 1, 1, 0, 0, 1};
  EXPECT_EQ(Sparkline(more, 3), "█▁█");
  EXPECT_EQ(Sparkline(some, 0), "");
}

}  // namespace evalbus::styled_text_test
