#include "runner/live_view.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "results/episode_json.h"
#include "tests/unit/longest_line.h"

namespace evalbus::runner::live_view_test {

using std::chrono::seconds;

std::string Joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

bool Has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

metric_values_t Metrics() {
  metric_values_t m{};
  m.tracks_slippage = m.tracks_collisions = m.tracks_cartesian_path_length = m.tracks_cartesian_jerk = 1;
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
  m.avg_cartesian_jerk_mps3 = {1, 2};
  m.rms_cartesian_jerk_mps3 = {3, 5};
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
  // Publishes the partial metrics of tick 0 and of two seconds later.
  void Partial(int episode = 0) {
    partial_metrics_t partial{};
    partial.header.episode = episode;
    dut_.OnPartial(partial);
    partial.header.sim_time_us = 2'000'000;
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
    summary.metrics.success = episode == 0;
    dut_.OnEpisodeDone(results::EpisodeJson("lift_pot", "base", summary));
  }
  std::vector<std::string> Lines(int width) { return dut_.Lines(width, now_ + seconds(10)); }

  FILE* file_ = std::tmpfile();
  const SteadyTime now_{seconds(1000)};
  LiveView dut_{file_, {"lift_pot", "base", "expert", "lockstep", 50, 7, 4, 0}, [this] { return now_; }};
};

TEST_F(LiveViewTest, BeforeTheFirstScoreThereIsProgressOnly) {
  const auto lines = Lines(80);
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_EQ(lines[0], "");
  EXPECT_EQ(lines[1], "episode 1 of 4  ──────────────────── 0 %");
}

TEST_F(LiveViewTest, StatesThatItWaitsForASourcesNextEpisode) {
  FILE* const file = std::tmpfile();
  const auto printed = [&] {
    std::fflush(file);
    std::string text(static_cast<size_t>(std::ftell(file)), '\0');
    std::rewind(file);
    EXPECT_EQ(std::fread(text.data(), 1, text.size(), file), text.size());
    std::fseek(file, 0, SEEK_END);  // required between reading and writing
    return text;
  };
  const std::string line = "waiting for the source's next episode (1 of 2 finished); Ctrl-C stops\n";
  LiveView view(file, {"lift_pot", "base", "source", "source", 50, 7, 2, 0}, [this] { return now_; });
  episode_summary_t summary{};
  summary.end_reason = "end_of_data";
  summary.end_detail = "no message from the source for 5 s";
  view.OnEpisodeDone(results::EpisodeJson("lift_pot", "base", summary));
  view.Poll(now_ + seconds(1));
  EXPECT_FALSE(Has(printed(), "waiting"));
  view.Poll(now_ + seconds(3));
  EXPECT_TRUE(printed().ends_with(line)) << printed();
  view.Poll(now_ + seconds(6));
  EXPECT_TRUE(printed().ends_with("\n" + line) && !Has(printed(), line + line)) << "once per episode";
  summary.header.episode = 1;
  view.OnEpisodeDone(results::EpisodeJson("lift_pot", "base", summary));
  view.Poll(now_ + seconds(9));
  EXPECT_FALSE(Has(printed(), "2 of 2 finished")) << "no more are expected";
  std::fclose(file);
}

TEST_F(LiveViewTest, ShowsScoresAsTheyCome) {
  Begin(0);
  Partial();
  const std::string text = Joined(Lines(80));
  for (const char* line :
       {"  time                           2.00 s   0.20 x real time\n",
        "  ● pot_held                     1.50 s\n", "  ○ pot_lifted\n",
        "  lift                          0.012 m\n", "  gap                           0.000 m\n",
        "  slips                             3\n", "  collisions with the scene         4\n",
        "  self collisions                   5\n", "  smallest clearance            163.4 mm\n",
        "  wrist path                    0.750 m\n", "  wrist jerk, rms               4.512 m/s³\n"}) {
    EXPECT_TRUE(Has(text, line)) << line << text;
  }
  // An episode of unknown length is assumed to take ten seconds. Two seconds of the first of four are done: 5
  // %.
  EXPECT_TRUE(Has(text, " 5 %  3:10 min left\n")) << text;
}

TEST_F(LiveViewTest, KnowsWhatIsDone) {
  Begin(0);
  Partial();
  Done(0);
  Begin(1);
  const std::string text = Joined(Lines(80));
  EXPECT_TRUE(Has(text, "episode 2 of 4  ━━━━━─────────────── 25 %")) << text;
  EXPECT_TRUE(Has(text, "  success  1 of 1, 100 % (anytime CI 2 to 100)  █\n")) << text;
  // The scores of the finished episode are not shown for the new one.
  EXPECT_FALSE(Has(text, "pot_held")) << text;
  for (int episode = 1; episode < 4; ++episode) Done(episode);
  EXPECT_TRUE(Has(Joined(Lines(80)), "episode 4 of 4  ━━━━━━━━━━━━━━━━━━━━ 100 %  0 s left"))
      << Joined(Lines(80));
}

// Finished episodes of a resumed run count in the rate and in the progress, but are not printed again.
TEST_F(LiveViewTest, KnowsWhatWasThereBefore) {
  std::vector<nlohmann::ordered_json> before;
  for (int episode = 0; episode < 2; ++episode) {
    episode_summary_t summary{};
    summary.header.episode = episode;
    summary.complete = 1;
    summary.metrics = Metrics();
    summary.metrics.slip_count = episode;
    summary.metrics.success = 1;
    before.push_back(results::EpisodeJson("lift_pot", "base", summary));
  }
  FILE* file = std::tmpfile();
  LiveView view(file, {"lift_pot", "base", "expert", "lockstep", 50, 7, 4, 2}, [this] { return now_; });
  for (const auto& episode : before) view.OnEpisodeDone(episode);
  // After ten seconds this session has finished no episode, so the remaining time is unknown.
  const auto at = now_ + seconds(10);
  EXPECT_EQ(view.Lines(80, at)[1], "episode 3 of 4  ━━━━━━━━━━────────── 50 %");
  view.OnEpisodeDone(before[0]);
  const std::string text = Joined(view.Lines(80, at));
  // This session finished one episode in ten seconds, so the last of four episodes needs ten more.
  EXPECT_TRUE(Has(text, "75 %  10 s left")) << text;
  EXPECT_TRUE(Has(text, "success  3 of 3")) << text;
  std::fclose(file);
}

TEST_F(LiveViewTest, FitsEveryWidth) {
  Begin(0);
  Partial();
  Done(0);
  Begin(1);
  Partial(1);
  for (int width = 1; width < 100; ++width) EXPECT_LE(LongestLine(Joined(Lines(width))), width);
  // At half the width of a screen nothing is truncated.
  EXPECT_TRUE(Has(Joined(Lines(50)), "left\n")) << Joined(Lines(50));
  EXPECT_TRUE(Has(Joined(Lines(50)), "m/s³\n"));
}

TEST_F(LiveViewTest, WithoutATerminalThereArePlainLinesOnly) {
  Begin(0);
  Partial();
  dut_.Poll(now_ + seconds(1));
  Done(0, "the reason");
  dut_.OnRemark("a remark");
  dut_.Finish();
  EXPECT_EQ(Printed(),
            "lift_pot/base  policy expert  seed 7  lockstep 50 Hz  4 episodes\n"
            "episode  end                          time  stages  slips  collisions  clearance     path\n"
            "      0  missed the grasp           2.00 s     1/2      3       4 + 5     163 mm   0.75 m  the "
            "reason\n"
            "a remark\n");
}

TEST_F(LiveViewTest, ControlCharactersOfTheBusStayOffTheTerminal) {
  Begin(0);
  partial_metrics_t partial{};
  partial.metrics = Metrics();
  partial.metrics.stage_name = {"\x1b[2Jheld",
                                "\xC2\x9B"
                                "2Jlifted"};
  partial.extended = Extended();
  dut_.OnPartial(partial);
  std::string text = Joined(Lines(80));
  Done(0, "the \x1b[31m reason");
  dut_.OnRemark(
      "retrying: \x1b]0;title\x07 \xC2\x9B"
      "2J \x9B"
      "2J");
  dut_.Finish();
  text += Printed();
  for (const char* control : {"\x1b", "\x07", "\x9B"}) EXPECT_FALSE(Has(text, control)) << text;
  EXPECT_TRUE(Has(text, "  the ?[31m reason\n")) << text;
  EXPECT_TRUE(Has(text, "retrying: ?]0;title? ?2J ?2J\n")) << text;
}

}  // namespace evalbus::runner::live_view_test
