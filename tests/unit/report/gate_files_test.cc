#include "report/gate_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tinyxml2.h>

namespace evalbus::report::gate_files_test {

using results::GateVerdict;
using testing::HasSubstr;

results::Gate Example() {
  results::Gate gate;
  gate.run = "new_<b>";
  gate.baseline = "old";
  gate.verdict = GateVerdict::kFail;
  gate.why = "slips 0.1 -> 0.9";
  gate.criteria.resize(3);
  gate.criteria[0].what = "success";
  gate.criteria[0].verdict = GateVerdict::kPass;
  gate.criteria[0].why = "a loss of at most 2 points";
  gate.criteria[1].what = "slips";
  gate.criteria[1].verdict = GateVerdict::kFail;
  gate.criteria[1].why = gate.why;
  gate.criteria[2].what = "wrist path";
  gate.tasks = {{.name = "lift_pot/position",
                 .pairs = 60,
                 .successes = 50,
                 .baseline_successes = 55,
                 .gained = 1,
                 .lost = 6}};
  gate.remarks = {"a | b"};
  return gate;
}

TEST(GateJunit, EachCriterionIsATestCase) {
  tinyxml2::XMLDocument document;
  ASSERT_EQ(document.Parse(GateJunit(Example()).c_str()), tinyxml2::XML_SUCCESS);
  const auto* const suite = document.FirstChildElement("testsuites")->FirstChildElement("testsuite");
  EXPECT_STREQ(suite->Attribute("name"), "evalbus gate: new_<b> against old");
  EXPECT_EQ(suite->IntAttribute("tests"), 3);
  EXPECT_EQ(suite->IntAttribute("failures"), 2);
  const auto* one = suite->FirstChildElement("testcase");
  EXPECT_STREQ(one->Attribute("name"), "success");
  EXPECT_EQ(one->FirstChildElement("failure"), nullptr);
  one = one->NextSiblingElement("testcase");
  EXPECT_STREQ(one->FirstChildElement("failure")->Attribute("type"), "FAIL");
  EXPECT_STREQ(one->FirstChildElement("failure")->Attribute("message"), "slips 0.1 -> 0.9");
  one = one->NextSiblingElement("testcase");
  EXPECT_STREQ(one->FirstChildElement("failure")->Attribute("type"), "CANNOT TELL");
}

// The table and the sentence show the same digits.
TEST(GateMarkdown, ShowsTheBoundsOfTheSentence) {
  results::Gate gate = Example();
  results::GateCriterion& success = gate.criteria[0];
  success.pairs = 12;
  success.baseline_mean = 100;
  success.mean = 250 / 3.0;
  success.mean_unit = "%";
  success.loss = 50 / 3.0;
  success.loss_lower = -14.37;
  success.loss_upper = 43.81;
  success.margin = 5;
  success.unit = "points";
  success.verdict = GateVerdict::kCannotTell;
  EXPECT_THAT(GateMarkdown(gate),
              HasSubstr("| CANNOT TELL | success | 100.0 % | 83.3 % | 16.67 points | -14.4 "
                        "points to 43.9 points | 5 points | 12 |\n"));
  EXPECT_THAT(WhyText(success),
              HasSubstr("success 100.0 -> 83.3 % in 12 pairs: between a gain of 14.4 points "
                        "and a loss of 43.9 points "));
}

TEST(GateMarkdown, IsATableWithEscapedNames) {
  const std::string text = GateMarkdown(Example());
  EXPECT_TRUE(text.starts_with("### FAIL: new\\_&lt;b\\> against old\n\nslips 0.1 -\\> 0.9\n\n")) << text;
  EXPECT_THAT(text, HasSubstr("| lift\\_pot/position | 60 | 55 | 50 | 6 | 1 |\n"));
  EXPECT_THAT(text, HasSubstr("- a \\| b\n"));
}

}  // namespace evalbus::report::gate_files_test
