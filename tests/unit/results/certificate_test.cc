#include "results/certificate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/errors.h"
#include "results/certificate_text.h"
#include "tests/unit/results/compare_fixture.h"

namespace evalbus::results::certificate_test {

using nlohmann::ordered_json;
using testing::HasSubstr;
using testing::Not;

class CertificateTest : public CompareTest {
 protected:
  // Results of one policy on one engine: '1' for a success, '0' for a failure, by episode.
  RecordedRuns Policy(const std::string& engine, const std::string& policy, const std::string& success) {
    std::vector<bool> each;
    for (const char c : success) each.push_back(c == '1');
    ordered_json info = Info(static_cast<int>(each.size()));
    info["mujoco_version"] = engine;
    RecordedRuns runs = Run(engine + "-" + policy, info, each, 5);
    runs.name = policy;
    return runs;
  }
  // Like Policy(), with two stages in each episode, reached ('1') or not: "10" reached the first stage only.
  RecordedRuns Stages(const std::string& engine, const std::vector<std::string>& stages) {
    ordered_json info = Info(static_cast<int>(stages.size()));
    info["mujoco_version"] = engine;
    std::vector<ordered_json> lines;
    for (size_t i = 0; i < stages.size(); ++i) {
      const bool first = stages[i][0] == '1', second = stages[i][1] == '1';
      lines.push_back(
          EpisodeLine(static_cast<int>(i), second, {{"task_stage_reached", {{"1", first}, {"2", second}}}}));
    }
    WriteRun(folder_.path() / engine, info, lines);
    RecordedRuns runs = ReadRuns(folder_.path() / engine);
    runs.name = "expert";
    return runs;
  }
};

TEST_F(CertificateTest, NoFlipIsStatedFirst) {
  const std::string all = std::string(90, '1') + std::string(10, '0');
  const Certificate certificate =
      Certify({{"2.2.2", {Policy("2.2.2", "expert", all)}}, {"3.3.3", {Policy("3.3.3", "expert", all)}}});
  EXPECT_EQ(Headline(certificate),
            "No verdict flips: 0 of 100 episodes flip between MuJoCo 2.2.2 and 3.3.3.");
  const std::string text = CertificateText(certificate, {});
  EXPECT_TRUE(text.starts_with(Headline(certificate) + "\n")) << text;
  // Wilson's upper bound of 0 in 100: z^2 / (n + z^2) = 3.8415 / 103.8415.
  EXPECT_THAT(text, HasSubstr("0 of 100       0 to 4 %"));
  EXPECT_THAT(text, HasSubstr("0 of 100 episodes differ in some number; all reach the same stages"));
  EXPECT_THAT(text, Not(HasSubstr("ranking")));
  // A certificate compares engines on purpose, so no remark states that the engines differ.
  EXPECT_THAT(certificate.comparisons[0].comparison.remarks, testing::IsEmpty());
}

// Wilson's upper bound of 0 in 1: z^2 / (1 + z^2) = 3.8415 / 4.8415.
TEST_F(CertificateTest, EqualPairsCountAsOneInTheInterval) {
  const Certificate certificate = Certify(
      {{"2.2.2", {Stages("2.2.2", {"11", "11", "11"})}}, {"3.3.3", {Stages("3.3.3", {"11", "11", "11"})}}});
  EXPECT_THAT(CertificateText(certificate, {}), HasSubstr("0 of 3      0 to 79 %"));
}

TEST_F(CertificateTest, FlipsAreCountedAndTested) {
  // From one engine to the other, expert loses 6 seeds; noisy loses one and gains one.
  const Certificate certificate =
      Certify({{"2.2.2", {Policy("2.2.2", "expert", "1111111110"), Policy("2.2.2", "noisy", "1000000000")}},
               {"3.3.3", {Policy("3.3.3", "expert", "0000001110"), Policy("3.3.3", "noisy", "0100000000")}}});
  ASSERT_EQ(certificate.comparisons.size(), 2u);
  const PolicyOnEngine &expert = certificate.comparisons[0], &noisy = certificate.comparisons[1];
  EXPECT_EQ(expert.policy, "expert");
  EXPECT_EQ(expert.engine, "3.3.3");
  EXPECT_EQ(expert.flipped(), 6);
  EXPECT_EQ(expert.comparison.success.pairs.only_b, 6);
  // 2 P(Binomial(6, 1/2) <= 0) = 2 / 64; Holm doubles the smaller of two.
  EXPECT_DOUBLE_EQ(expert.comparison.success.p, 0.03125);
  EXPECT_DOUBLE_EQ(expert.comparison.success.p_adjusted, 0.0625);
  EXPECT_EQ(expert.different, 6);
  EXPECT_EQ(noisy.flipped(), 2);
  EXPECT_EQ(noisy.comparison.success.p, 1);
  EXPECT_THAT(Headline(certificate),
              testing::StartsWith(
                  "Verdicts depend on the engine: 8 of 20 episodes flip between MuJoCo 2.2.2 and 3.3.3;"));
  const ordered_json json = CertificateJson(certificate, {});
  EXPECT_EQ(json["headline"], Headline(certificate));
  const ordered_json& flips = json["comparisons"][1]["flips"];
  ASSERT_EQ(flips.size(), 2u);
  EXPECT_EQ(flips[0]["seed"], EpisodeSeed(7, 0));
  EXPECT_EQ(flips[0]["succeeded_here"], false);
  EXPECT_EQ(flips[0]["failure_reason"], "timeout");
  EXPECT_EQ(flips[1]["seed"], EpisodeSeed(7, 1));
  EXPECT_EQ(flips[1]["succeeded_here"], true);
  const std::string text = CertificateText(certificate, {});
  EXPECT_THAT(text, HasSubstr("noisy, lift_pot/position, seed " + std::to_string(EpisodeSeed(7, 1)) +
                              " (episode 1): success on 3.3.3, time limit on 2.2.2\n"));
}

TEST_F(CertificateTest, OnlyTheFirstFlipsAreListed) {
  const Certificate certificate = Certify({{"2.2.2", {Policy("2.2.2", "expert", std::string(13, '1'))}},
                                           {"3.3.3", {Policy("3.3.3", "expert", std::string(13, '0'))}}});
  const std::string text = CertificateText(certificate, {});
  EXPECT_THAT(text, HasSubstr("(episode 9)"));
  EXPECT_THAT(text, Not(HasSubstr("(episode 10)")));
  EXPECT_THAT(text, HasSubstr("\n3 more in the JSON file\n"));
  EXPECT_EQ(CertificateJson(certificate, {})["comparisons"][0]["flips"].size(), 13u);
}

TEST_F(CertificateTest, NamesTheFirstStageThatDiffers) {
  // Episodes 1 and 2 diverge at stage 2, in opposite directions. Episode 3 diverges at stage 1, although
  // stage 2 also differs.
  const Certificate certificate = Certify({{"2.2.2", {Stages("2.2.2", {"11", "11", "10", "11"})}},
                                           {"3.3.3", {Stages("3.3.3", {"11", "10", "11", "00"})}}});
  const std::vector<StageParting>& partings = certificate.comparisons[0].partings;
  ASSERT_EQ(partings.size(), 2u);
  EXPECT_EQ(partings[0].task, "lift_pot/position");
  EXPECT_EQ(partings[0].stage, 1);
  EXPECT_EQ(partings[0].pairs, 1);
  EXPECT_EQ(partings[0].only_reference, 1);
  EXPECT_EQ(partings[0].seed, EpisodeSeed(7, 3));
  EXPECT_EQ(partings[1].stage, 2);
  EXPECT_EQ(partings[1].pairs, 2);
  EXPECT_EQ(partings[1].only_reference, 1);
  EXPECT_EQ(partings[1].seed, EpisodeSeed(7, 1));
  const StageNames names = {{"lift_pot/position", {{1, "grasped"}, {2, "lifted"}}}};
  EXPECT_THAT(
      CertificateText(certificate, names),
      HasSubstr("3 of 4 episodes differ in some number; first stage at which the engines differ: stage 1 of "
                "lift_pot/position, grasped, in 1 episode"));
  EXPECT_EQ(CertificateJson(certificate, names)["comparisons"][0]["partings"][1]["name"], "lifted");
}

TEST_F(CertificateTest, ARankingSurvivesOrNot) {
  const auto pair = [&](const std::string& a, const std::string& b, const std::string& a_there,
                        const std::string& b_there) {
    const Certificate certificate =
        Certify({{"2.2.2", {Policy("2.2.2", "a", a), Policy("2.2.2", "b", b)}},
                 {"3.3.3", {Policy("3.3.3", "a", a_there), Policy("3.3.3", "b", b_there)}}});
    EXPECT_EQ(certificate.pairs.size(), 1u);
    const PolicyPair& one = certificate.pairs[0];
    EXPECT_EQ(certificate.ranking_survives(), !one.order_reverses() && !one.verdict_changes());
    EXPECT_EQ(CertificateJson(certificate, {})["ranking_survives"], certificate.ranking_survives());
    EXPECT_THAT(Headline(certificate),
                HasSubstr(certificate.ranking_survives() ? "ranking of the policies is the same."
                          : one.verdict_changes()        ? "ranking of the policies changes."
                                                         : "; policies change places between which no engine "
                                                           "shows a difference."));
    return std::pair(one.order_reverses(), one.verdict_changes());
  };
  // Ten pairs that only one policy wins have p = 2 / 1024. Five such pairs have p = 2 / 32 = 0.0625, which is
  // not significant.
  const std::string all(10, '1'), none(10, '0'), half = "1111100000", other = "0000011111",
                                                 few = "1110000000";
  EXPECT_EQ(pair(all, none, all, none), std::pair(false, false));
  EXPECT_EQ(pair(half, few, few, half), std::pair(true, false));
  // Equal rates have no order that could reverse.
  EXPECT_EQ(pair(half, few, half, other), std::pair(false, false));
  EXPECT_EQ(pair(all, none, all, half), std::pair(false, true));
  EXPECT_EQ(pair(all, none, none, all), std::pair(true, true));
}

TEST_F(CertificateTest, ThreeEnginesAreComparedWithTheFirst) {
  const Certificate certificate = Certify({{"2.2.2", {Policy("2.2.2", "expert", "1111")}},
                                           {"3.1.3", {Policy("3.1.3", "expert", "1110")}},
                                           {"3.3.3", {Policy("3.3.3", "expert", "1001")}}});
  EXPECT_EQ(Headline(certificate),
            "Verdicts depend on the engine: 1 of 4 episodes flip between MuJoCo 2.2.2 and 3.1.3, 2 of 4 "
            "episodes flip between MuJoCo 2.2.2 and 3.3.3.");
  EXPECT_THROW(Certify({{"2.2.2", {Policy("2.2.2", "expert", "1111")}}}), InputError);
}

}  // namespace evalbus::results::certificate_test
