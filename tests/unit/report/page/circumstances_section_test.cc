#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "report/page/report_sections.h"

namespace evalbus::report::circumstances_section_test {

using testing::HasSubstr;

std::string Section(const results::RunCircumstances& circumstances) {
  ReportRun run;
  run.circumstances = circumstances;
  Markup html;
  WriteCircumstances({run, "", "h2", "h3", &html});
  return html.str();
}

// Episodes with x below 0.5 m succeed, and those above fail.
results::RunCircumstances Circumstances() {
  results::Circumstance x{.name = "pot_x_m",
                          .episodes = {20, 10},
                          .p = 0.01,
                          .p_holm = 0.02,
                          .from = 0.5,
                          .to = std::numeric_limits<double>::infinity(),
                          .inside = {10, 0},
                          .bins = {{0.4, 0.5, {10, 10}}, {0.5, 0.6, {10, 0}}}};
  return {.run = "run",
          .policy = "expert",
          .task = "lift_pot/position",
          .episodes = {20, 10},
          .parameters = {x},
          .tested = 2};
}

TEST(CircumstancesSection, HasTheSentenceAndAFigure) {
  const std::string html = Section(Circumstances());
  EXPECT_THAT(html,
              HasSubstr("Success falls from 100 % (10 of 10) to 0 % (0 of 10) where pot x is above 0.500 m "
                        "(p = 0.020; 2 parameters tested)."));
  EXPECT_THAT(html, HasSubstr("0.400 to 0.500 m: 10 of 10 succeeded, 100 % (95 % interval 72 to 100 %)"));
  // The axis begins at 34 and is 216 pixels wide. The shaded half ends at its right end.
  EXPECT_THAT(html, HasSubstr("<rect class=\"shaded\" x=\"142\" y=\"10\" width=\"108\" height=\"98\"/>"));
}

TEST(CircumstancesSection, ChoicesAreATable) {
  results::RunCircumstances circumstances = Circumstances();
  results::Circumstance& texture = circumstances.parameters[0];
  texture.name = "table_texture_choice";
  texture.is_choice = true;
  texture.bins = {{.from = 0, .to = 0, .episodes = {10, 10}, .choice = "table/oak"},
                  {.from = 1, .to = 1, .episodes = {10, 0}, .choice = "checker", .is_low = true}};
  const std::string html = Section(circumstances);
  EXPECT_THAT(html, HasSubstr("where table texture is checker (p = 0.020"));
  EXPECT_THAT(html, HasSubstr("<b>checker</b>"));
  EXPECT_THAT(html, HasSubstr("<span>table/oak</span>"));
  EXPECT_THAT(html, HasSubstr("title=\"checker: 0 of 10 succeeded, 0 % (95 % interval 0 to 28 %)\""));
}

TEST(CircumstancesSection, IsLeftOutIfAllEpisodesSucceeded) {
  results::RunCircumstances circumstances = Circumstances();
  circumstances.episodes = {20, 20};
  EXPECT_EQ(Section(circumstances), "");
}

}  // namespace evalbus::report::circumstances_section_test
