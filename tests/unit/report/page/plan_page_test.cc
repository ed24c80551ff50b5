// Tests the links and the ranking on a plan's page.
#include "report/page/plan_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "metrics/statistics/interval.h"

namespace evalbus::report::plan_page_test {

using testing::HasSubstr;
using testing::Not;

metrics::RunSummary Summary(int successes, int judged,
                            std::vector<std::pair<std::string, int>> failure_reasons = {}) {
  metrics::RunSummary summary;
  summary.successes = successes;
  summary.judged = judged;
  summary.success_rate = static_cast<double>(successes) / judged;
  summary.wilson = metrics::WilsonInterval(successes, judged);
  summary.failure_reasons = std::move(failure_reasons);
  return summary;
}

PlanReport Report() {
  PlanReport report;
  report.title = "checkpoints";
  report.policies = {"a", "b"};
  report.tasks = {
      {"lift_pot/all", {{.summary = Summary(3, 4), .url = "a/report.html"}, {.summary = Summary(0, 4)}}}};
  report.all.cells = {{.summary = Summary(3, 4, {{"dropped", 1}})},
                      {.summary = Summary(0, 4, {{"dropped", 3}, {"timeout", 1}})}};
  report.failed_episodes.resize(2);
  return report;
}

TEST(PlanPage, LeadsToEpisodesIn3D) {
  PlanReport report = Report();
  report.tasks[0].cells[0].episodes = {{"episode 2", "a/report.html#view:run=0,episode=2"}};
  report.failed_episodes[1] = {{"dropped", "b/report.html#view:run=0,episode=1"}};
  const std::string page = PlanPage(report, "evalbus");
  EXPECT_THAT(page, HasSubstr("<a href=\"a/report.html#view:run=0,episode=2\">episode 2</a>"));
  EXPECT_THAT(page, HasSubstr("<a href=\"b/report.html#view:run=0,episode=1\" title=\"one of them in 3D\">"));
  EXPECT_THAT(page, HasSubstr("0 of 4<"));
}

TEST(PlanPage, ShowsIntervalsAsNumbers) {
  const std::string page = PlanPage(Report(), "evalbus");
  EXPECT_THAT(page, HasSubstr(">30 to 95 %<"));
  EXPECT_THAT(page, HasSubstr(">0 to 49 %<"));
}

// The plan lists the worst policy first.
TEST(PlanPage, RanksPoliciesBySuccess) {
  PlanReport report = Report();
  std::swap(report.policies[0], report.policies[1]);
  std::swap(report.tasks[0].cells[0], report.tasks[0].cells[1]);
  std::swap(report.all.cells[0], report.all.cells[1]);
  report.verdict = "a is 75 points better than b, 95 % CI -1 to 90";
  report.baseline = "b";
  report.verdicts = {{.policy = "a",
                      .text = "text",
                      .difference = "75 points (-1 to 90)",
                      .judgment = "better",
                      .url = "u"}};
  const std::string page = PlanPage(report, "evalbus");
  EXPECT_THAT(page, HasSubstr("<h1>a is 75 points better than b, 95 % CI −1 to 90</h1>"));
  const size_t first = page.find("<th scope=\"row\">a</th>"), second = page.find("<th scope=\"row\">b</th>");
  ASSERT_NE(first, std::string::npos);
  EXPECT_LT(first, second);
  EXPECT_THAT(
      page, HasSubstr("<span class=\"better\">better</span><div class=\"note\">75 points (−1 to 90)</div>"));
}

TEST(PlanPage, LeadsNowhereWithoutThem) {
  EXPECT_THAT(PlanPage(Report(), "evalbus"), Not(HasSubstr("#view:")));
}

}  // namespace evalbus::report::plan_page_test
