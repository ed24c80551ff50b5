#include <gmock/gmock.h>

#include "report/page/page.h"

namespace evalbus::report::strip_test {

using testing::HasSubstr;
using testing::Not;

// Every tenth episode failed, beginning with the first one.
std::vector<std::vector<StripCell>> Columns(int count) {
  std::vector<std::vector<StripCell>> columns;
  for (int i = 0; i < count; ++i) {
    const std::string number = std::to_string(i);
    columns.push_back({{i % 10 == 0 ? "bad" : "good", number, "episode " + number, "#" + number}});
  }
  return columns;
}

std::string Written(int count) {
  Markup html;
  WriteStrip(Columns(count), &html);
  return html.str();
}

size_t CountOf(const std::string& part, const std::string& text) {
  size_t count = 0;
  for (size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

TEST(Strip, HasASquareForEachEpisode) {
  const std::string html = Written(200);
  EXPECT_EQ(CountOf("<a ", html), 200u);
  EXPECT_THAT(html, HasSubstr("<a class=\"bad\" title=\"episode 10\" href=\"#10\" tabindex=\"-1\">10</a>"));
  EXPECT_THAT(html, Not(HasSubstr("combined")));
}

// 5,000 episodes are combined into 100 squares of 50 episodes. In each square, 45 episodes succeeded and five
// failed, including the first.
TEST(Strip, CombinesManyEpisodes) {
  EXPECT_EQ(ColumnsPerSquare(200), 1u);
  EXPECT_EQ(ColumnsPerSquare(201), 10u);
  EXPECT_EQ(ColumnsPerSquare(2000), 10u);
  EXPECT_EQ(ColumnsPerSquare(5000), 50u);
  const std::string html = Written(5000);
  EXPECT_EQ(CountOf("class=\"combined\"", html), 100u);
  EXPECT_THAT(html, HasSubstr("title=\"50 to 99: 45 of 50 succeeded\" style=\"--share:90.0%\" href=\"#50\""));
}

TEST(Strip, TheLastSquareMayHaveFewer) {
  EXPECT_THAT(Written(205), HasSubstr("title=\"200 to 204: 4 of 5 succeeded\""));
}

}  // namespace evalbus::report::strip_test
