#include "results/circumstances.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "results/circumstances_text.h"
#include "tests/unit/results/compare_fixture.h"

namespace evalbus::results::circumstances_test {

using nlohmann::ordered_json;
using testing::ElementsAre;
using testing::HasSubstr;

class CircumstancesTest : public CompareTest {
 protected:
  // Episode i of 40 has the value i at pot_y_m; episodes from 30 on fail.
  RunCircumstances Of(const std::function<void(int, ordered_json*)>& change = {}) {
    std::vector<ordered_json> lines;
    for (int i = 0; i < 40; ++i) {
      lines.push_back(EpisodeLine(i, i < 30, {{"completion_time", 4}, {"slip_count", 0}}));
      lines.back()["parameters"] = {{"pot_x_m", 0.5}, {"pot_y_m", 0.01 * i}};
      if (change) change(i, &lines.back());
    }
    WriteRun(folder_.path() / "run", Info(40), lines);
    const RecordedRun run = ReadRun(folder_.path() / "run");
    return FindCircumstances({&run}).front();
  }
};

TEST_F(CircumstancesTest, NamesTheRangeInWhichEpisodesFail) {
  const RunCircumstances found = Of();
  // The constant x is not tested.
  ASSERT_EQ(found.parameters.size(), 1);
  const Circumstance& y = found.parameters[0];
  EXPECT_EQ(y.name, "pot_y_m");
  EXPECT_LT(y.p_holm, 0.001);
  EXPECT_EQ(y.inside_rate() + y.outside_rate(), 1);
  EXPECT_THAT(
      CircumstanceSentences(found),
      ElementsAre("Success falls from 100 % to 0 % where pot y is above 0.295 m (p < 0.001; 1 parameter "
                  "tested)."));
  ASSERT_EQ(y.bins.size(), 5);
  EXPECT_EQ(BinText(y, y.bins[0]), "0.000 to 0.070 m");
  EXPECT_EQ(y.bins[3].episodes.successes, 6);
  EXPECT_THAT(CircumstancesText(found, false), HasSubstr("6 of 8      75 %  (95 % interval 41 to 93 %)"));
}

TEST_F(CircumstancesTest, FindsFailuresAtBothEnds) {
  const RunCircumstances found = Of([](int i, ordered_json* line) {
    (*line)["parameters"]["pot_y_m"] = i < 30 ? 0.1 + 0.001 * i : 0.2 * (i % 2) + 0.001 * i;
  });
  EXPECT_THAT(CircumstanceSentences(found)[0], HasSubstr("where pot y is outside "));
}

TEST_F(CircumstancesTest, TestsThePresenceOfDistractorsOnce) {
  const RunCircumstances found = Of([](int i, ordered_json* line) {
    if (i < 30) return;
    (*line)["parameters"]["red_mug_x_m"] = 0.01 * (i % 7);
    (*line)["parameters"]["red_mug_yaw_rad"] = 0.01 * (i % 3);
  });
  std::vector<std::string> names;
  for (const Circumstance& parameter : found.parameters) names.push_back(parameter.name);
  EXPECT_THAT(names, ElementsAre("pot_y_m", "red_mug_present", "red_mug_x_m", "red_mug_yaw_rad"));
  EXPECT_THAT(CircumstanceSentences(found),
              testing::Contains(HasSubstr("Success falls from 100 % to 0 % where red mug is present (p")));
  EXPECT_EQ(NameOfParameter("red_mug_yaw_rad").label, "red mug yaw");
  EXPECT_EQ(NameOfParameter("red_mug_yaw_rad").unit, "deg");
}

TEST_F(CircumstancesTest, NothingIsShownByChance) {
  const RunCircumstances found =
      Of([](int i, ordered_json* line) { (*line)["parameters"]["pot_y_m"] = (i * 17) % 40; });
  EXPECT_THAT(
      CircumstanceSentences(found),
      ElementsAre(testing::MatchesRegex("No parameter of the start is shown to drive failure \\(40 "
                                        "episodes, 1 parameter tested; smallest p = 0\\.[0-9]+\\)\\.")));
}

TEST_F(CircumstancesTest, LeavesOutIncompleteEpisodes) {
  const RunCircumstances found = Of([](int i, ordered_json* line) { (*line)["complete"] = i < 30; });
  EXPECT_EQ(found.episodes.trials, 30);
  EXPECT_THAT(CircumstanceSentences(found), ElementsAre("Nothing to explain: all 30 episodes succeeded."));
}

TEST_F(CircumstancesTest, AdjustsForAllRuns) {
  Of();
  const RecordedRun run = ReadRun(folder_.path() / "run");
  const std::vector<RunCircumstances> found = FindCircumstances({&run, &run});
  EXPECT_EQ(found[0].tested, 2);
  EXPECT_DOUBLE_EQ(found[0].parameters[0].p_holm, 2 * found[0].parameters[0].p);
}

TEST_F(CircumstancesTest, JsonHasNoBoundAtTheEndsOfTheValues) {
  const ordered_json json = CircumstancesJson({Of()});
  const ordered_json& range = json[0]["parameters"][0]["range"];
  EXPECT_TRUE(range["from"].is_null());
  EXPECT_DOUBLE_EQ(range["to"], 0.295);
  EXPECT_EQ(range["episodes"], 30);
  EXPECT_EQ(range["successes"], 30);
}

}  // namespace evalbus::results::circumstances_test
