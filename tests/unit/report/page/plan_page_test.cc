// A plan's page: its links.
#include "report/page/plan_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace evalbus::report::plan_page_test {

using testing::HasSubstr;
using testing::Not;

PlanReport Report() {
  PlanReport report;
  report.title = "checkpoints";
  report.policies = {"a", "b"};
  report.tasks = {{"lift_pot/all", {{3, 4, 0.3, 0.95, "a/report.html", {}}, {0, 4, 0, 0.49, "", {}}}}};
  report.failure_reasons = {{{"dropped", 1}}, {{"dropped", 3}, {"timeout", 1}}};
  report.failed_episodes.resize(2);
  return report;
}

TEST(PlanPage, LeadsToEpisodesIn3D) {
  PlanReport report = Report();
  report.tasks[0].cells[0].episodes = {{"episode 2", "a/report.html#view:run=0,episode=2"}};
  report.failed_episodes[1] = {{"dropped", "b/report.html#view:run=0,episode=1"}};
  const std::string page = PlanPage(report, "evalbus");
  EXPECT_THAT(page, HasSubstr("3 of 4; <a href=\"a/report.html#view:run=0,episode=2\">episode 2</a>"));
  EXPECT_THAT(page, HasSubstr("<a href=\"b/report.html#view:run=0,episode=1\" title=\"one of them in 3D\">"));
  EXPECT_THAT(page, HasSubstr("0 of 4<"));
}

TEST(PlanPage, LeadsNowhereWithoutThem) {
  EXPECT_THAT(PlanPage(Report(), "evalbus"), Not(HasSubstr("#view:")));
}

}  // namespace evalbus::report::plan_page_test
