// Expected values are counted by hand from the verdicts in each test.
#include "results/operator_results.h"

#include <gmock/gmock.h>

#include "tests/unit/results/compare_fixture.h"

namespace evalbus::results::operator_results_test {

using testing::DoubleEq;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Optional;
using testing::StartsWith;

class OperatorResultsTest : public CompareTest {
 protected:
  // outcomes: one letter for each episode: s (success), f (failure), a (abstain), or - for no verdict.
  JudgedRun Judged(const std::string& name, const std::vector<bool>& automatic, const std::string& outcomes) {
    JudgedRun judged{Run(name, Info(static_cast<int>(automatic.size())), automatic, 4).runs[0], {}};
    for (size_t i = 0; i < outcomes.size(); ++i) {
      if (outcomes[i] == '-') continue;
      judged.verdicts.push_back({.episode = static_cast<int>(i),
                                 .operator_name = "ann",
                                 .outcome = outcomes[i] == 's'   ? Outcome::kSuccess
                                            : outcomes[i] == 'f' ? Outcome::kFailure
                                                                 : Outcome::kAbstain});
    }
    return judged;
  }
};

TEST_F(OperatorResultsTest, CountRatesAndAgreement) {
  JudgedRun judged = Judged("a", First(6, 10), "sssssfsffa");
  judged.verdicts[0].stages = 3;
  judged.verdicts[1].stages = 4;
  judged.verdicts[9].rubric = 2.5;
  const auto results = OperatorResults(judged.run, judged.verdicts);
  ASSERT_EQ(results.size(), 1u);
  EXPECT_EQ(results[0].rates.judged, 9);
  EXPECT_EQ(results[0].rates.successes, 6);
  EXPECT_EQ(results[0].abstentions, 1);
  EXPECT_EQ(results[0].agreement.both, 5);
  EXPECT_EQ(results[0].agreement.only_a, 1);
  EXPECT_EQ(results[0].agreement.only_b, 1);
  EXPECT_EQ(results[0].agreement.neither, 2);
  // p_o = 7/9, p_e = (6 * 6 + 3 * 3) / 81.
  EXPECT_THAT(results[0].kappa, Optional(DoubleEq(0.5)));
  EXPECT_THAT(
      OperatorSentences(results[0]),
      ElementsAre("Operator ann: success in 6 of 9 episodes, 67 % (95 % interval 35 to 88 %), 1 abstention.",
                  "The automatic verdict is equal in 7 of 9 episodes; Cohen's kappa 0.50. Success only for "
                  "the operator: 1; only automatic: 1.",
                  "Mean number of stages reached, as counted by the operator: 3.50.",
                  "Mean rubric score: 2.50 of 10."));
}

TEST_F(OperatorResultsTest, SayWhenKappaIsUndefined) {
  const JudgedRun judged = Judged("a", First(3, 3), "sss");
  EXPECT_THAT(OperatorSentences(OperatorResults(judged.run, judged.verdicts)[0])[1],
              HasSubstr("kappa is undefined, because both gave one and the same verdict"));
  const auto json = JudgmentJson({judged});
  EXPECT_EQ(json["runs"][0]["operators"][0]["agreement"]["cohen_kappa"], nullptr);
  EXPECT_EQ(json["runs"][0]["operators"][0]["operator_success_rate"], 1);
  const JudgedRun none = Judged("b", First(3, 3), "aa");
  EXPECT_THAT(OperatorSentences(OperatorResults(none.run, none.verdicts)[0]),
              ElementsAre("Operator ann judged no episode a success or a failure, 2 abstentions.",
                          "No episode has both this operator's and an automatic verdict."));
}

// Episodes without an automatic verdict count in the operator's rate but not in the agreement.
TEST_F(OperatorResultsTest, IncompleteEpisodesHaveNoAutomaticVerdict) {
  JudgedRun judged = Judged("a", First(2, 4), "sfsf");
  judged.run.episodes[0].complete = false;
  judged.run.episodes[1].failure_reason = "not_judged";
  const auto results = OperatorResults(judged.run, judged.verdicts);
  EXPECT_EQ(results[0].rates.judged, 4);
  EXPECT_EQ(results[0].rates.successes, 2);
  EXPECT_EQ(results[0].agreement.pairs(), 2);
  EXPECT_EQ(results[0].agreement.only_a, 1);
}

TEST_F(OperatorResultsTest, EachOperatorCountsAlone) {
  JudgedRun judged = Judged("a", First(2, 4), "ssss");
  judged.verdicts[3].operator_name = "Bob";
  const auto results = OperatorResults(judged.run, judged.verdicts);
  ASSERT_EQ(results.size(), 2u);
  EXPECT_EQ(results[0].operator_name, "Bob");
  EXPECT_EQ(results[0].rates.judged, 1);
  EXPECT_EQ(results[1].rates.judged, 3);
}

// The automatic verdicts of both runs are equal. The operator's verdicts differ in four pairs, so p = 2 /
// 2^4.
TEST_F(OperatorResultsTest, TwoRunsAreComparedByTheOperatorsVerdicts) {
  JudgedRun a = Judged("a", First(5, 10), "sssssfsffa"), b = Judged("b", First(5, 10), "ssffffffff");
  // Bob's verdicts do not count in a comparison by Ann's verdicts.
  for (JudgedRun* judged : {&a, &b})
    judged->verdicts.push_back({.episode = 9, .operator_name = "bob", .outcome = Outcome::kSuccess});
  const auto comparison = CompareByOperator(b, a, "ann");
  ASSERT_TRUE(comparison);
  EXPECT_TRUE(comparison->success.paired);
  EXPECT_EQ(comparison->success.pairs.both, 2);
  EXPECT_EQ(comparison->success.pairs.only_a, 0);
  EXPECT_EQ(comparison->success.pairs.only_b, 4);
  EXPECT_EQ(comparison->success.pairs.neither, 3);
  EXPECT_DOUBLE_EQ(comparison->success.p, 0.125);
  const std::vector<std::string> lines = JudgmentLines({a, b});
  EXPECT_EQ(lines.rbegin()[3], "Difference by the verdicts of ann");
  EXPECT_THAT(lines.rbegin()[2], StartsWith("  No difference shown between b and a: -44.4 points"));
  const auto json = JudgmentJson({a, b});
  EXPECT_EQ(json["comparisons"][0]["comparison"]["comparisons"][0]["success"]["p"], 0.125);
}

// The verdicts of the operator cover three episodes of each run, all of which count.
TEST_F(OperatorResultsTest, ComparisonsHaveNoRemarksOnAutomaticResults) {
  const JudgedRun a = Judged("a", First(5, 10), "sss");
  JudgedRun b = Judged("b", First(5, 10), "sff");
  b.run.info["only"] = {0, 1, 2, 3};
  b.run.unfinished = {4};
  b.run.cut_line = 5;
  RecordedEpisode& invalid = b.run.episodes[0];
  invalid.complete = false;
  invalid.invalid = true;
  invalid.end_reason = "server_error";
  b.run.episodes[1].decided_at_start = true;
  const auto comparison = CompareByOperator(b, a, "ann");
  ASSERT_TRUE(comparison);
  EXPECT_EQ(comparison->success.trials, 3);
  EXPECT_THAT(comparison->remarks, IsEmpty());
}

TEST_F(OperatorResultsTest, RunsWithoutAPairOfVerdictsAreNotCompared) {
  const JudgedRun a = Judged("a", First(5, 10), "ss--------"), b = Judged("b", First(5, 10), "--ff------");
  EXPECT_FALSE(CompareByOperator(b, a, "ann"));
  EXPECT_EQ(JudgmentJson({a, b})["comparisons"].size(), 0u);
  EXPECT_EQ(JudgmentLines({a, b}).back(), "  No pair of episodes has a success or failure on both sides.");
}

}  // namespace evalbus::results::operator_results_test
