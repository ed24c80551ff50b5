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
  // In episode i of 40, pot_y_m is 0.01 * i. Episodes 28 to 39 fail.
  RunCircumstances Of(const std::function<void(int, ordered_json*)>& change = {}) {
    std::vector<ordered_json> lines;
    for (int i = 0; i < 40; ++i) {
      lines.push_back(EpisodeLine(i, i < 28, {{"completion_time", 4}, {"slip_count", 0}}));
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
  // x is constant, so it is not tested.
  ASSERT_EQ(found.parameters.size(), 1);
  const Circumstance& y = found.parameters[0];
  EXPECT_EQ(y.name, "pot_y_m");
  EXPECT_LT(y.p_holm, 0.001);
  EXPECT_EQ(y.inside_rate() + y.outside_rate(), 1);
  EXPECT_THAT(CircumstanceSentences(found),
              ElementsAre("Success falls from 100 % (28 of 28) to 0 % (0 of 12) where pot y is above 0.275 m "
                          "(p < 0.001; 1 parameter tested)."));
  ASSERT_EQ(y.bins.size(), 5);
  EXPECT_EQ(BinText(y, y.bins[0]), "0.000 to 0.070 m");
  EXPECT_EQ(y.bins[3].episodes.successes, 4);
  EXPECT_THAT(CircumstancesText(found, false), HasSubstr("4 of 8      50 %  (95 % interval 22 to 78 %)"));
}

TEST_F(CircumstancesTest, FindsFailuresAtBothEnds) {
  const RunCircumstances found = Of([](int i, ordered_json* line) {
    (*line)["parameters"]["pot_y_m"] = i < 28 ? 0.1 + 0.001 * i : 0.2 * (i % 2) + 0.001 * i;
  });
  EXPECT_THAT(CircumstanceSentences(found)[0], HasSubstr("where pot y is outside "));
}

TEST_F(CircumstancesTest, TestsThePresenceOfDistractorsOnce) {
  const RunCircumstances found = Of([](int i, ordered_json* line) {
    if (i < 28) return;
    (*line)["parameters"]["red_mug_x_m"] = 0.01 * (i % 7);
    (*line)["parameters"]["red_mug_yaw_rad"] = 0.01 * (i % 3);
  });
  std::vector<std::string> names;
  for (const Circumstance& parameter : found.parameters) names.push_back(parameter.name);
  EXPECT_THAT(names, ElementsAre("pot_y_m", "red_mug_present", "red_mug_x_m", "red_mug_yaw_rad"));
  EXPECT_THAT(CircumstanceSentences(found),
              testing::Contains(HasSubstr(
                  "Success falls from 100 % (28 of 28) to 0 % (0 of 12) where red mug is present (p")));
  EXPECT_EQ(NameOfParameter("red_mug_yaw_rad").label, "red mug yaw");
  EXPECT_EQ(NameOfParameter("red_mug_yaw_rad").unit, "degrees");
}

TEST_F(CircumstancesTest, NamesTheChoicesWithWhichEpisodesFail) {
  // Episodes 30 to 39 fail. These and three other episodes have the texture "checker" or "dots".
  const auto change = [](int i, ordered_json* line) {
    (*line)["parameters"] = {{"table_texture_choice", i >= 27 ? 1 + 2 * (i % 2) : 2 * (i % 2)}};
  };
  nlohmann::ordered_json info = Info(40);
  info["parameter_choices"] = {
      {"table_texture_choice", {"table/oak", "checker", "marble", "dots", "stripes"}}};
  const auto of = [&](const ordered_json& run_info) {
    std::vector<ordered_json> lines;
    for (int i = 0; i < 40; ++i) {
      lines.push_back(EpisodeLine(i, i < 30, {{"completion_time", 4}}));
      change(i, &lines.back());
    }
    const std::filesystem::path folder = folder_.path() / "choices";
    std::filesystem::remove_all(folder);
    WriteRun(folder, run_info, lines);
    const RecordedRun run = ReadRun(folder);
    return FindCircumstances({&run}).front();
  };
  const RunCircumstances found = of(info);
  ASSERT_EQ(found.parameters.size(), 1);
  const Circumstance& texture = found.parameters[0];
  EXPECT_TRUE(texture.is_choice);
  // "stripes" did not occur, so it has no bin.
  ASSERT_EQ(texture.bins.size(), 4);
  EXPECT_THAT(
      CircumstanceSentences(found),
      ElementsAre("Success falls from 100 % (27 of 27) to 23 % (3 of 13) where table texture is checker or "
                  "dots (p < 0.001; 1 parameter tested)."));
  EXPECT_EQ(texture.inside.trials, 13);
  EXPECT_EQ(texture.inside.successes, 3);
  const std::string text = CircumstancesText(found, false);
  EXPECT_THAT(text, HasSubstr("\ntable texture  "));
  EXPECT_THAT(text, HasSubstr("  4 choices\n"));
  EXPECT_THAT(text, HasSubstr("    table/oak "));
  const ordered_json json = CircumstancesJson({found})[0]["parameters"][0];
  EXPECT_EQ(json["low"],
            (ordered_json{{"choices", {"checker", "dots"}}, {"episodes", 13}, {"successes", 3}}));
  EXPECT_EQ(json["bins"][0]["choice"], "table/oak");
  EXPECT_FALSE(json.contains("range"));

  info["parameter_choices"]["table_texture_choice"] = {"table/oak", "checker"};
  EXPECT_THROW(of(info), InputError);
}

TEST_F(CircumstancesTest, NothingIsShownByChance) {
  const RunCircumstances found =
      Of([](int i, ordered_json* line) { (*line)["parameters"]["pot_y_m"] = (i * 17) % 40; });
  EXPECT_THAT(CircumstanceSentences(found),
              ElementsAre(testing::MatchesRegex(
                  "No parameter of the start is shown to drive failure \\(40 "
                  "episodes, 1 parameter tested; smallest adjusted p = 0\\.[0-9]+\\)\\.")));
}

TEST_F(CircumstancesTest, LeavesOutIncompleteEpisodes) {
  const RunCircumstances found = Of([](int i, ordered_json* line) { (*line)["complete"] = i < 28; });
  EXPECT_EQ(found.episodes.trials, 28);
  EXPECT_THAT(CircumstanceSentences(found), ElementsAre("Nothing to explain: all 28 episodes succeeded."));
  EXPECT_THAT(CircumstancesText(found, false), testing::Not(HasSubstr("p (Holm)")));
  const RunCircumstances one = Of([](int i, ordered_json* line) { (*line)["complete"] = i == 30; });
  EXPECT_THAT(
      CircumstanceSentences(one),
      ElementsAre("No parameter of the start separates successes from failures: the only episode failed."));
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
  EXPECT_DOUBLE_EQ(range["to"], 0.275);
  EXPECT_EQ(range["episodes"], 28);
  EXPECT_EQ(range["successes"], 28);
}

}  // namespace evalbus::results::circumstances_test
