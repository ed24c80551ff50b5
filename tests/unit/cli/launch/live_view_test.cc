#include "cli/launch/live_view.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "cli/results/episode_json.h"

namespace evalbus::launch {
namespace {

using std::chrono::seconds;

// Characters of the longest line; UTF-8 continuation bytes do not count.
int LongestLine(const std::string& text) {
  std::istringstream lines(text);
  int longest = 0;
  for (std::string line; std::getline(lines, line);) {
    longest = std::max(longest, static_cast<int>(std::count_if(line.begin(), line.end(),
                                                               [](char c) { return (c & 0xC0) != 0x80; })));
  }
  return longest;
}

std::string Joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

bool Has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

metric_values_t Metrics() {
  metric_values_t m{};
  m.completion_time_s = 2;
  m.num_stages = 2;
  m.stage_index = {1, 2};
  m.stage_name = {"pot_held", "pot_lifted"};
  m.stage_reached = {1, 0};
  m.num_target_distances = 2;
  m.target_distance_name = {"lift", "gap"};
  m.target_distance_m = {0.0123, -0.0001};
  m.slip_count = 3;
  m.env_collision_count = 4;
  m.self_collision_count = 5;
  m.num_arms = 2;
  m.arm_name = {"left", "right"};
  m.cartesian_path_length_m = {0.5, 0.25};
  m.overall_rms_cartesian_jerk_mps3 = 4.5116;
  return m;
}

extended_metrics_t Extended() {
  extended_metrics_t e{};
  e.name = {"min_clearance_m"};
  e.unit = {"m"};
  e.value_mixed = {0.1634};
  e.num_values = 1;
  e.num_stages = 2;
  e.stage_time_s = {1.5, -1};
  return e;
}

metrics::RunSummary Summary(int complete, int success) {
  metrics::RunSummary s;
  s.episodes = s.complete = complete;
  s.successes = success;
  s.success_rate = complete > 0 ? static_cast<double>(success) / complete : 0;
  s.wilson = {0.0945, 0.9055};
  s.failure_reasons = {{"timeout", 3}, {"dropped", 1}};
  const double nan = std::nan("");
  s.metrics = {
      {"slip_count", 2, 1.5, 0.5, 1, 1, 2, 1, 2, {1, 2}},
      {"extended.min_clearance_m", 2, 0.16345, nan, 0.2, 0.1, 0.3, 0.1, 0.3, {nan, nan}},
      {"bimanual_gripper_vertical_difference",
       2,
       0.0001234,
       12.3456,
       1234.5678,
       0,
       1,
       0,
       1,
       {0.0001, 0.0125}},
  };
  return s;
}

TEST(FormatDuration, HasTheUnitThatFits) {
  EXPECT_EQ(FormatDuration(-3), "0 s");
  EXPECT_EQ(FormatDuration(0.4), "0 s");
  EXPECT_EQ(FormatDuration(59.4), "59 s");
  EXPECT_EQ(FormatDuration(59.5), "1:00 min");
  EXPECT_EQ(FormatDuration(65), "1:05 min");
  EXPECT_EQ(FormatDuration(3599), "59:59 min");
  EXPECT_EQ(FormatDuration(3600), "1:00:00 h");
  EXPECT_EQ(FormatDuration(90061), "25:01:01 h");
}

TEST(SummaryTable, ShowsRateIntervalAndMetricsWithUnits) {
  EXPECT_EQ(SummaryTable(Summary(5, 1), 80),
            "Success in 1 of 5 episodes: 20 % (95 % interval 9 to 91 %, Wilson)\n"
            "Failures: 3 timeout, 1 dropped\n"
            "\n"
            "                              mean   its 95 % interval      std   median\n"
            "slips                        1.500        1 to       2    0.500        1\n"
            "smallest clearance           163.5                   -        -    200.0  mm\n"
            "gripper height difference    0.123    0.100 to   12.50    12346    1235k  mm\n");
}

TEST(SummaryTable, FitsEveryWidth) {
  for (const int width : {50, 60, 70, 80, 100}) {
    const std::string table = SummaryTable(Summary(2, 1), width);
    EXPECT_LE(LongestLine(table), width) << table;
    EXPECT_TRUE(Has(table, "mean")) << width;
    EXPECT_EQ(Has(table, "interval"), true) << table;
    EXPECT_EQ(Has(table, "median"), width >= 80) << table;
    EXPECT_FALSE(Has(table, " \n")) << table;
  }
}

TEST(SummaryTable, SaysWhatIsLeftOut) {
  metrics::RunSummary summary = Summary(2, 1);
  summary.episodes = 5;
  EXPECT_TRUE(Has(SummaryTable(summary, 80), "3 of 5 episodes incomplete"));
  const std::string none = SummaryTable(Summary(0, 0), 80);
  EXPECT_EQ(none, "");
  summary.complete = 0;
  EXPECT_EQ(SummaryTable(summary, 80), "5 of 5 episodes incomplete: left out of all this\n");
}

class LiveViewTest : public testing::Test {
 protected:
  ~LiveViewTest() override { std::fclose(file_); }
  std::string Printed() {
    std::fflush(file_);
    std::string text(static_cast<size_t>(std::ftell(file_)), '\0');
    std::rewind(file_);
    EXPECT_EQ(std::fread(text.data(), 1, text.size(), file_), text.size());
    return text;
  }
  void Begin(int episode) {
    episode_begin_t begin{};
    begin.header.episode = episode;
    dut_.OnEpisodeBegin(begin);
  }
  void Partial() {
    partial_metrics_t partial{};
    partial.metrics = Metrics();
    partial.extended = Extended();
    dut_.OnPartial(partial);
  }
  void Done(int episode, const std::string& detail = "") {
    episode_summary_t summary{};
    summary.header.episode = episode;
    summary.end_reason = "time_limit";
    summary.failure_reason = "grasp_miss";
    summary.end_detail = detail;
    summary.complete = 1;
    summary.metrics = Metrics();
    summary.extended = Extended();
    summary.metrics.tracks_cartesian_path_length = 1;
    summary.metrics.tracks_collisions = 1;
    summary.metrics.success = episode == 0;
    dut_.OnEpisodeDone(results::EpisodeJson("lift_pot", "base", summary));
  }
  std::vector<std::string> Lines(int width) {
    return dut_.Lines(width, std::chrono::steady_clock::now() + seconds(10));
  }

  FILE* file_ = std::tmpfile();
  LiveView dut_{file_, {"lift_pot", "base", "expert", "lockstep", 50, 7, 4}};
};

TEST_F(LiveViewTest, BeforeTheFirstScoreThereIsProgressOnly) {
  const auto lines = Lines(80);
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_EQ(lines[0], "");
  EXPECT_EQ(lines[1], "episode 1 of 4  ──────────────────── 0 %");
}

TEST_F(LiveViewTest, ShowsScoresAsTheyCome) {
  Begin(0);
  Partial();
  const std::string text = Joined(Lines(80));
  EXPECT_TRUE(Has(text, "  time          2.00 s  0.2 x real time\n")) << text;
  EXPECT_TRUE(Has(text, "  stage 1     ● pot_held  1.50 s\n")) << text;
  EXPECT_TRUE(Has(text, "  stage 2     ○ pot_lifted\n")) << text;
  EXPECT_TRUE(Has(text, "  distance     0.012 m  lift\n")) << text;
  EXPECT_TRUE(Has(text, "  distance     0.000 m  gap\n")) << text;
  EXPECT_TRUE(Has(text, "  clearance     163 mm\n")) << text;
  EXPECT_TRUE(Has(text, "  collisions  4 scene, 5 self, 3 slips\n")) << text;
  EXPECT_TRUE(Has(text, "  path          0.75 m  jerk 4.512 m/s³ rms\n")) << text;
  // Two of an unknown length, guessed as ten seconds, of one of four episodes.
  EXPECT_TRUE(Has(text, " 5 %  3:10 min left\n")) << text;
}

TEST_F(LiveViewTest, KnowsWhatIsDone) {
  Begin(0);
  Partial();
  Done(0);
  Begin(1);
  const std::string text = Joined(Lines(80));
  EXPECT_TRUE(Has(text, "episode 2 of 4  ━━━━━─────────────── 25 %")) << text;
  EXPECT_TRUE(Has(text, "  success     1 of 1, 95 % interval 21 to 100 %\n")) << text;
  // The finished episode's scores are not the new one's.
  EXPECT_FALSE(Has(text, "stage")) << text;
  for (int episode = 1; episode < 4; ++episode) Done(episode);
  EXPECT_TRUE(Has(Joined(Lines(80)), "episode 4 of 4  ━━━━━━━━━━━━━━━━━━━━ 100 %  0 s left"))
      << Joined(Lines(80));
}

TEST_F(LiveViewTest, FitsEveryWidth) {
  Begin(0);
  Partial();
  Done(0);
  Begin(1);
  Partial();
  for (int width = 1; width < 100; ++width) EXPECT_LE(LongestLine(Joined(Lines(width))), width);
  // At the width of half a screen nothing is cut yet.
  EXPECT_TRUE(Has(Joined(Lines(50)), "left\n")) << Joined(Lines(50));
  EXPECT_TRUE(Has(Joined(Lines(50)), "m/s³ rms\n"));
}

TEST_F(LiveViewTest, WithoutATerminalThereArePlainLinesOnly) {
  Begin(0);
  Partial();
  dut_.Poll(std::chrono::steady_clock::now() + seconds(1));
  Done(0, "the reason");
  dut_.OnRemark("a remark");
  dut_.Finish();
  EXPECT_EQ(Printed(),
            "lift_pot/base  policy expert  seed 7  lockstep 50 Hz  4 episodes\n"
            "episode  end                time  stages  slips  collisions  clearance     path\n"
            "      0  grasp_miss       2.00 s     1/2      3       4 + 5     163 mm   0.75 m  the reason\n"
            "a remark\n");
}

}  // namespace
}  // namespace evalbus::launch
