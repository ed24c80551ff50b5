#include "report/comparison_report.h"

#include <gmock/gmock.h>

#include "report/page/comparison_page.h"
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
  std::string html = ComparisonReport({comparison}, page, "0.1.0", 0, nullptr).html;
  EXPECT_THAT(html, HasSubstr("2 seeds where only one policy succeeds"));
  EXPECT_THAT(html, HasSubstr(std::to_string(EpisodeSeed(7, 1))));
  EXPECT_THAT(html, HasSubstr(std::to_string(EpisodeSeed(7, 3))));
  // Seeds with equal outcomes appear only in the strip.
  EXPECT_THAT(html, Not(HasSubstr("number seed\">" + std::to_string(EpisodeSeed(7, 2)))));
  EXPECT_THAT(html, HasSubstr("<h1>No difference shown between b and a: 0 points, 95 % CI "));
  EXPECT_THAT(html, HasSubstr("evalbus render"));
  results::WriteFile(folder_.path() / "b/episodes/0001/front.mp4", "video");
  html = ComparisonReport({comparison}, page, "0.1.0", 0, nullptr).html;
  EXPECT_THAT(html, HasSubstr("href=\"../b/episodes/0001/front.mp4\""));
  EXPECT_THAT(html, Not(HasSubstr("evalbus render")));
}

TEST_F(ComparisonReportTest, StatesWhatMeansCoverAndWhichIntervalsAreAdjusted) {
  const Comparison comparison =
      CompareRuns(Run("b", Info(8), First(8, 8), 5), Run("a", Info(8), First(7, 8), 6));
  const std::string html =
      ComparisonReport({comparison}, folder_.path() / "page.html", "0.1.0", 0, nullptr).html;
  EXPECT_THAT(html, HasSubstr("over the 7 pairs in which both succeeded"));
  EXPECT_THAT(html, HasSubstr("Intervals are not adjusted"));
}

// A is the baseline, B the compared run.
TEST_F(ComparisonReportTest, TheComparedRunIsB) {
  const Comparison comparison =
      CompareRuns(Run("b", Info(8), First(8, 8), 5), Run("a", Info(8), First(7, 8), 6));
  const std::string html =
      ComparisonReport({comparison}, folder_.path() / "page.html", "0.1.0", 0, nullptr).html;
  for (const auto& [name, css_class] : {std::pair("a", "side-a"), {"b", "side-b"}}) {
    const size_t row = html.find(std::string("<th scope=\"row\">") + name + "</th>");
    ASSERT_NE(row, std::string::npos);
    EXPECT_EQ(html.substr(html.find("side-", row), 6), css_class);
  }
}

TEST_F(ComparisonReportTest, FlippedSeedsHaveImagesOfBothSides) {
  Comparison comparison =
      CompareRuns(Run("b", Info(3), {true, false, false}, 5), Run("a", Info(3), {true, true, true}, 6));
  for (results::ComparedPair& pair : comparison.tasks[0].pairs) {
    if (pair.is_flipped()) pair.run.cause = {"lost_object", 3.62, "Right gripper lost the pot."};
  }
  const PairStills images{"data:image/jpeg;base64,AA==", "data:image/jpeg;base64,BB=="};
  const std::string html = ComparisonPage(
      {.comparisons = {comparison},
       .videos = [](const auto&, int) { return std::vector<ReportLink>(); },
       .player_url = [](const auto&, const auto&) { return std::string(); },
       .stills = [&](const auto&, const auto& pair) { return pair.run.episode == 1 ? &images : nullptr; },
       .viewer = {},
       .viewer_notes = {},
       .made_by = "0.1.0"});
  EXPECT_THAT(html, HasSubstr("At the decisive moment: a on the left, b on the right."));
  EXPECT_THAT(html, HasSubstr("alt=\"a, episode 1 at 3.62 s\""));
  EXPECT_THAT(html, HasSubstr("alt=\"b, episode 1 at 3.62 s\""));
  EXPECT_LT(html.find(images.baseline), html.find(images.run));
  EXPECT_THAT(html, Not(HasSubstr("alt=\"b, episode 2")));
}

TEST_F(ComparisonReportTest, TheMostFrequentReasonComesFirst) {
  Comparison comparison = CompareRuns(Run("b", Info(3), First(0, 3), 5), Run("a", Info(3), First(3, 3), 6));
  for (size_t i = 0; i < 3; ++i)
    comparison.tasks[0].pairs[i].run.failure_reason = i == 0 ? "collision" : "stall";
  EXPECT_THAT(ComparisonReport({comparison}, folder_.path() / "page.html", "0.1.0", 0, nullptr).html,
              HasSubstr("3 seeds where only a succeeds: 2 robot stopped, 1 collision."));
}

// The runs have no logs from which images could be rendered.
TEST_F(ComparisonReportTest, NamesTheEpisodesWithoutImages) {
  Comparison comparison =
      CompareRuns(Run("b", Info(2), {true, false}, 5), Run("a", Info(2), {true, true}, 6));
  comparison.tasks[0].pairs[1].run.cause = {"lost_object", 3.62, "Right gripper lost the pot."};
  const std::string html =
      ComparisonReport({comparison}, folder_.path() / "page.html", "0.1.0", 8 << 20, nullptr).html;
  EXPECT_THAT(html, HasSubstr("no images of episode 1: "));
  EXPECT_THAT(html, Not(HasSubstr("At the decisive moment")));
}

// The standard error of an interval that is 0.735 s wide is 0.19 s, of which two digits are shown.
TEST_F(ComparisonReportTest, NumbersHaveAsManyDecimalsAsTheirDifferenceBears) {
  Comparison comparison = CompareRuns(Run("b", Info(8), First(8, 8), 5), Run("a", Info(8), First(7, 8), 6));
  for (results::MetricComparison& metric : comparison.tasks[0].metrics) {
    if (metric.number.name == "completion_time") metric.difference_95 = {-1.2345, -0.5};
  }
  EXPECT_THAT(
      ComparisonReport({comparison}, folder_.path() / "page.html", "0.1.0", 0, nullptr).html,
      testing::AllOf(HasSubstr("<data value=\"-1\">−1.00</data> (−1.23 to −0.50)"), HasSubstr(">6.13<")));
}

// These runs have no logs, so their episodes cannot be shown.
TEST_F(ComparisonReportTest, NamesOnlyAFewEpisodesThatCannotBeShown) {
  const Comparison comparison =
      CompareRuns(Run("b", Info(8), First(8, 8), 5), Run("a", Info(8), First(7, 8), 6));
  const std::string html =
      ComparisonReport({comparison}, folder_.path() / "page.html", "0.1.0", 8 << 20, nullptr).html;
  EXPECT_THAT(html, HasSubstr("episode 7 is not shown in 3D: "));
  EXPECT_THAT(html, HasSubstr("episode 1 is not shown in 3D: "));
  EXPECT_THAT(html, Not(HasSubstr("episode 2 is not shown in 3D")));
  EXPECT_THAT(html, HasSubstr("5 more episodes are not shown in 3D"));
}

}  // namespace evalbus::report::comparison_report_test
