#include "results/ranking.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "tests/unit/longest_line.h"

namespace evalbus::results::ranking_test {

// Returns a run with one episode for each outcome, each from its own initial state.
RecordedRuns Policy(const std::string& name, const std::vector<bool>& outcomes) {
  RecordedRun run;
  run.name = name;
  run.task = "lift_pot";
  run.variation = "position";
  run.info = {{"control_hz", 50}, {"task_sha256", "task"}, {"physics_sha256", "model"}};
  for (size_t i = 0; i < outcomes.size(); ++i) {
    RecordedEpisode episode;
    episode.episode = static_cast<int>(i);
    episode.seed = static_cast<int64_t>(i);
    episode.complete = true;
    episode.success = outcomes[i];
    episode.parameters = {{"pot_x_m", static_cast<double>(i)}};
    run.episodes.push_back(episode);
  }
  run.planned = static_cast<int>(outcomes.size());
  return {.folder = name, .name = name, .is_suite = false, .runs = {run}, .missing = {}};
}

std::vector<RankedRun> Rank(const std::vector<RecordedRuns>& policies) {
  std::vector<const RecordedRuns*> pointers;
  for (const RecordedRuns& policy : policies) pointers.push_back(&policy);
  return RankBySuccess(pointers);
}

std::vector<bool> First(int successes, int episodes) {
  std::vector<bool> outcomes(static_cast<size_t>(episodes));
  std::fill_n(outcomes.begin(), successes, true);
  return outcomes;
}

TEST(Ranking, DifferentTasksHaveNoOrder) {
  std::vector<RecordedRuns> policies = {Policy("a", First(9, 9)), Policy("b", First(5, 9)),
                                        Policy("c", First(1, 9))};
  EXPECT_EQ(Rank(policies).size(), 3u);
  RecordedRun more = policies[1].runs[0];
  more.task = "stack_two_blocks";
  policies[1].runs.push_back(more);
  EXPECT_TRUE(Rank(policies).empty());
}

TEST(Ranking, MostSuccessfulFirstWithLetters) {
  const auto ranking = Rank({Policy("expert", First(20, 50)), Policy("small", First(38, 50)),
                             Policy("large", First(45, 50)), Policy("base", First(28, 50))});
  EXPECT_EQ(
      RankingText(ranking),
      "Ranking by success\n"
      "large         45 of 50   90 %  a\n"
      "small         38 of 50   76 %  b\n"
      "base          28 of 50   56 %  c\n"
      "expert        20 of 50   40 %  d\n"
      "Policies that share a letter do not differ significantly (all pairs tested, p adjusted with Holm's "
      "method, which is stricter than comparisons with the baseline only).\n");
  EXPECT_TRUE(Rank({Policy("a", First(1, 3)), Policy("b", First(2, 3))}).empty());
  EXPECT_LE(LongestLine(RankingText(ranking, 60)), 60);
  EXPECT_EQ(RankingText({}), "");
}

TEST(Ranking, PoliciesWithoutVerdictsAreLast) {
  RecordedRuns nothing = Policy("nothing", First(0, 50));
  for (RecordedEpisode& episode : nothing.runs[0].episodes) episode.complete = false;
  const RecordedRuns worse = Policy("worse", First(10, 50)), better = Policy("better", First(45, 50));
  // If a missing rate counted as equal to every other rate, these two might stay unsorted, because the policy
  // without a rate is between them.
  const std::vector<RankedRun> ranking = Rank({worse, nothing, better});
  ASSERT_EQ(ranking.size(), 3u);
  EXPECT_EQ(ranking[0].name, "better");
  EXPECT_EQ(ranking[1].name, "worse");
  EXPECT_EQ(ranking[2].name, "nothing");
}

// Only the comparisons with the baseline are in the headline, so it agrees with their table.
TEST(Ranking, HeadlineHasTheRatesAndTheComparisons) {
  const std::vector<RecordedRuns> policies = {Policy("base", First(10, 50)), Policy("a", First(45, 50)),
                                              Policy("b", First(44, 50)), Policy("c", First(12, 50)),
                                              Policy("d", First(0, 50))};
  const std::vector<Comparison> comparisons =
      CompareAll({policies[1], policies[2], policies[3], policies[4]}, policies[0]);
  const std::string against =
      "a and b are better than base; d is worse than base; c is not shown to differ from base";
  EXPECT_EQ(RankingHeadline(Rank(policies), comparisons),
            "a 90 %, b 88 %, c 24 %, base 20 %, d 0 %; " + against);
  EXPECT_EQ(RankingHeadline({}, comparisons), against);
  EXPECT_EQ(RankingHeadline(std::vector<RankedRun>(7), comparisons), against);
  EXPECT_EQ(RankingHeadline({}, {}), "");
}

TEST(Ranking, HeadlineNamesPoliciesWithoutACompleteEpisode) {
  RecordedRuns nothing = Policy("nothing", First(0, 50));
  for (RecordedEpisode& episode : nothing.runs[0].episodes) episode.complete = false;
  const RecordedRuns base = Policy("base", First(10, 50)), better = Policy("a", First(45, 50));
  EXPECT_EQ(RankingHeadline(Rank({base, better, nothing}), CompareAll({better, nothing}, base)),
            "a 90 %, base 20 %, nothing –; a is better than base; nothing has no complete episode");
  EXPECT_EQ(RankingHeadline({}, CompareAll({base, better}, nothing)),
            "No conclusion: nothing has no complete episode");
}

// The probability that any two of several equal policies are separated is at most 5 %.
TEST(Ranking, ErrsInFivePercentAtMost) {
  const char* const asked = std::getenv("EVALBUS_SIMULATIONS");
  const int simulations = asked ? std::max(1, std::atoi(asked)) : 400;
  for (const double in_common : {0.0, 0.5}) {
    std::mt19937_64 random(4);
    const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
    int errors = 0;
    for (int i = 0; i < simulations; ++i) {
      // From a fraction `in_common` of the initial states, all policies have the same outcome.
      std::vector<double> luck;
      for (int start = 0; start < 40; ++start) luck.push_back(uniform() < in_common ? uniform() : -1);
      std::vector<RecordedRuns> policies;
      for (int policy = 0; policy < 5; ++policy) {
        std::vector<bool> outcomes;
        for (const double shared : luck) outcomes.push_back((shared < 0 ? uniform() : shared) < 0.5);
        policies.push_back(Policy(std::to_string(policy), outcomes));
      }
      const auto ranking = Rank(policies);
      bool differ = false;
      for (const RankedRun& a : ranking) {
        for (const RankedRun& b : ranking) differ |= a.letters.find_first_of(b.letters) == std::string::npos;
      }
      errors += differ;
    }
    const double share = errors / static_cast<double>(simulations);
    std::printf("ranking of 5 equal policies, %.0f %% of starts in common: %.1f %% wrong\n", 100 * in_common,
                100 * share);
    EXPECT_LE(share, 0.05 + 4 * std::sqrt(0.05 * 0.95 / simulations));
  }
}

}  // namespace evalbus::results::ranking_test
