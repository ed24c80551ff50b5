#include "report/comparison_report.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "base/text.h"
#include "report/page/page.h"
#include "tests/unit/results/compare_fixture.h"

namespace evalbus::report::comparison_report_test {

using results::Comparison;
using results::EpisodeSeed;
using results::Info;
using results::RecordedRuns;
using testing::HasSubstr;
using testing::Not;

class ComparisonReportTest : public results::CompareTest {};

TEST_F(ComparisonReportTest, LinksTheVideosOfSeedsThatFlipped) {
  const RecordedRuns a = Run("a", Info(4), {true, true, false, false}, 5);
  const RecordedRuns b = Run("b", Info(4), {true, false, false, true}, 5);
  const Comparison comparison = CompareRuns(b, a);
  const std::filesystem::path page = folder_.path() / "pages/comparison.html";
  std::string html = ComparisonReport({comparison}, page, "0.1.0", 0).html;
  EXPECT_THAT(html, HasSubstr("2 seeds where only one policy succeeds"));
  EXPECT_THAT(html, HasSubstr(std::to_string(EpisodeSeed(7, 1))));
  EXPECT_THAT(html, HasSubstr(std::to_string(EpisodeSeed(7, 3))));
  // Seeds without a flip are only in the strip.
  EXPECT_THAT(html, Not(HasSubstr("number seed\">" + std::to_string(EpisodeSeed(7, 2)))));
  EXPECT_THAT(html, HasSubstr("<h1>No difference shown between b and a: 0 points, 95 % CI "));
  EXPECT_THAT(html, HasSubstr("evalbus render"));
  results::WriteFile(folder_.path() / "b/episodes/0001/front.mp4", "video");
  html = ComparisonReport({comparison}, page, "0.1.0", 0).html;
  EXPECT_THAT(html, HasSubstr("href=\"../b/episodes/0001/front.mp4\""));
  EXPECT_THAT(html, Not(HasSubstr("evalbus render")));
}

TEST_F(ComparisonReportTest, StatesWhatMeansCoverAndWhichIntervalsAreAdjusted) {
  const Comparison comparison =
      CompareRuns(Run("b", Info(8), First(8, 8), 5), Run("a", Info(8), First(7, 8), 6));
  const std::string html = ComparisonReport({comparison}, folder_.path() / "page.html", "0.1.0", 0).html;
  EXPECT_THAT(html, HasSubstr("over the 7 pairs in which both succeeded"));
  EXPECT_THAT(html, HasSubstr("Intervals are not adjusted"));
}

// The numbers of a row have the same decimals, those of the table in the terminal.
TEST_F(ComparisonReportTest, NumbersHaveAsManyDecimalsAsTheirDifferenceBears) {
  const Comparison comparison =
      CompareRuns(Run("b", Info(8), First(8, 8), 5), Run("a", Info(8), First(7, 8), 6));
  const results::MetricComparison* tested = nullptr;
  for (const results::MetricComparison& metric : comparison.tasks[0].metrics)
    tested = metric.p ? &metric : tested;
  ASSERT_NE(tested, nullptr);
  const auto text = [&](double value) {
    return WithMinus(Fixed(value * tested->number.scale(), tested->decimals()));
  };
  EXPECT_THAT(ComparisonReport({comparison}, folder_.path() / "page.html", "0.1.0", 0).html,
              HasSubstr(fmt::format("{}</data> ({} to {})", text(tested->difference),
                                    text(tested->difference_95.lower), text(tested->difference_95.upper))));
}

// These runs have no logs.
TEST_F(ComparisonReportTest, NamesOnlyAFewEpisodesThatCannotBeShown) {
  const Comparison comparison =
      CompareRuns(Run("b", Info(8), First(8, 8), 5), Run("a", Info(8), First(7, 8), 6));
  const std::string html =
      ComparisonReport({comparison}, folder_.path() / "page.html", "0.1.0", 8 << 20).html;
  EXPECT_THAT(html, HasSubstr("episode 7 is not shown in 3D: "));
  EXPECT_THAT(html, HasSubstr("episode 1 is not shown in 3D: "));
  EXPECT_THAT(html, Not(HasSubstr("episode 2 is not shown in 3D")));
  EXPECT_THAT(html, HasSubstr("5 more episodes are not shown in 3D"));
}

}  // namespace evalbus::report::comparison_report_test
