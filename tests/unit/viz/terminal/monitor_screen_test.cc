// Tests the monitor's screen with scripted messages.
#include "viz/terminal/monitor_screen.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "lcmtypes/source.h"
#include "tests/unit/viz/scripted_run.h"
#include "viz/watch/score_rows.h"

namespace evalbus::viz::monitor_screen_test {

using std::chrono::milliseconds;
class MonitorScreenTest : public testing::Test, protected ScriptedRun {
 protected:
  std::vector<Line> Lines(int width, int height) {
    watch_.Update(now_);
    return MonitorScreen(watch_, kUrl, width, height, now_);
  }
  std::vector<std::string> Screen(int width, int height) {
    std::vector<std::string> texts;
    for (const Line& line : Lines(width, height)) texts.push_back(LineText(line));
    return texts;
  }
  std::string All(int width, int height) {
    std::string all;
    for (const std::string& line : Screen(width, height)) all += line + "\n";
    return all;
  }

  static constexpr char kUrl[] = "udpm://239.255.76.67:31234?ttl=0";
};

constexpr char kGolden[] = R"(
small/position   two_arms   realtime                              a_run   q ends

episode 2   running       2.52 s of 5 s    1.00 x real time   progress 50 %
  ● held                       0.52 s     ○ lifted

                  left right  both         lift                      0.123 m
wrist path       1.250 0.750 2.000 m       left_gripper_to_pot       0.250 m
joint path       10.50 4.000 14.50 rad     pose error                0.031 rad
wrist rotation   2.000 1.000 3.000 rad     slips                         3
wrist jerk, rms  150.0 90.00 125.0 m/s³    collisions with the scene     2
joint jerk, rms   2000  123k 70000 rad/s³  self collisions               0
servo work       5.000 2.500 7.500 J       time touching the scene   0.060 s
wrist jerk, mean 100.5 80.00 90.25 m/s³    deepest penetration       0.400 mm
joint jerk, mean  1000 12345  6000 rad/s³  arm speed difference      0.500 rad/s
peak wrist speed 0.310 0.300       m/s     gripper height difference 12.10 mm
                                           joint limit margin        0.200 rad

contacts    2     deepest left/pad – pot/lid 0.300 mm
clearance   41.00 mm   smallest 12.00 mm at 0.84 s   right/link – counter/top
counted     0 missing ticks  0 refused samples  0 action clips  4 late actions
episodes    2 of 10 done, success 50 % (anytime CI 9 to 91)
components  lag 12   ● collision ● metrics ● policy ● recorder ● run ● sim
per second  STATE 50  CONTACTS 50  PARTIAL 50  STATUS 14
)";

TEST_F(MonitorScreenTest, FillsAnEightyByTwentyFourTerminal) {
  Play();
  EXPECT_EQ("\n" + All(80, 24), kGolden) << All(80, 24);
}

TEST_F(MonitorScreenTest, ReportsResponseTimesInRealTime) {
  Play();
  EXPECT_EQ(All(80, 40).find("real time   STATE"), std::string::npos);
  episode_end_t end{};
  end.header.episode = 2;
  end.pacing_error.count = 100;
  end.action_latency = {100, 0.00031, 0.00095, 0.0021, 0.0123};
  end.partial_latency = {100, 0.0004, 0.001, 0.002, 0.003};
  watch_.Receive(channels::kEpisodeEnd, Encode(end), now_);
  const std::string all = All(80, 40);
  for (const char* line : {"real time   STATE to ACTION  p50 0.31  p99 0.95  p99.9 2.10  max 12.30 ms\n",
                           "            STATE to score   p50 0.40  p99 1.00  p99.9 2.00  max 3.00 ms\n"}) {
    EXPECT_NE(all.find(line), std::string::npos) << all;
  }
}

TEST_F(MonitorScreenTest, NeverExceedsTheTerminal) {
  const auto check = [&] {
    for (int width = 1; width <= 200; width += width < 30 ? 1 : 7) {
      for (int height = 1; height <= 60; height += height < 30 ? 1 : 7) {
        const auto lines = Lines(width, height);
        ASSERT_LE(lines.size(), static_cast<size_t>(height));
        for (const Line& line : lines) ASSERT_LE(LineWidth(line), width) << LineText(line);
      }
    }
    EXPECT_TRUE(Lines(0, 0).empty());
  };
  check();
  Play();
  check();
  now_ += milliseconds(3000);  // if all components are silent, there is more to display
  check();
}

TEST_F(MonitorScreenTest, KeepsWhatMattersMostWhereThereIsLittleRoom) {
  Play();
  const std::string small = All(60, 20);
  for (const char* text :
       {"small/position", "episode 2   running", "● held", "○ lifted", "collisions with the scene", "slips",
        "wrist path               1.250 0.750 2.000 m", "contacts", "clearance", "2 of 10 done",
        "(anytime CI 9 to 91)", "components"}) {
    EXPECT_NE(small.find(text), std::string::npos) << text << "\n" << small;
  }
  EXPECT_EQ(small.find("jerk"), std::string::npos) << small;
  const auto tiny = Screen(40, 3);
  EXPECT_NE(tiny[0].find("small/position"), std::string::npos);
  EXPECT_NE(tiny[1].find("episode 2"), std::string::npos);
}

TEST_F(MonitorScreenTest, UsesMoreRoomForTheComponentsAndTheLastEpisodes) {
  Play();
  const std::string large = All(120, 40);
  for (const char* text : {"component   state      tick   lag   lost  undecodable  foreign   silent",
                           "recorder    running     108    12      0            0        0    0.1 s",
                           "         1  slipped from the gripper   2.50 s  stages 1/2",
                           "         0  success                    2.50 s  stages 1/2"}) {
    EXPECT_NE(large.find(text), std::string::npos) << text << "\n" << large;
  }
}

TEST_F(MonitorScreenTest, EveryValueHasItsUnit) {
  Play();
  const std::string screen = All(120, 40);
  for (const char* text :
       {"wrist path                1.250  0.750  2.000 m ",
        "joint path                10.50  4.000  14.50 rad ",
        "wrist rotation            2.000  1.000  3.000 rad ",
        "wrist jerk, rms           150.0  90.00  125.0 m/s³ ",
        "wrist jerk, mean          100.5  80.00  90.25 m/s³ ",
        "joint jerk, rms            2000   123k  70000 rad/s³ ",
        "joint jerk, mean           1000  12345   6000 rad/s³ ",
        "servo work                5.000  2.500  7.500 J ",
        "peak wrist speed          0.310  0.300        m/s ", "2.52 s of 5 s", "progress 50 %"}) {
    EXPECT_NE(screen.find(text), std::string::npos) << text << "\n" << screen;
  }
  const std::pair<const char*, const char*> values[] = {{"collisions with the scene", "2"},
                                                        {"self collisions", "0"},
                                                        {"slips", "3"},
                                                        {"lift", "0.123 m"},
                                                        {"left_gripper_to_pot", "0.250 m"},
                                                        {"pose error", "0.031 rad"},
                                                        {"deepest penetration", "0.400 mm"},
                                                        {"time touching the scene", "0.060 s"},
                                                        {"arm speed difference", "0.500 rad/s"},
                                                        {"gripper height difference", "12.10 mm"},
                                                        {"joint limit margin", "0.200 rad"}};
  for (const auto& [label, value] : values) {
    bool found = false;
    for (const std::string& line : Screen(120, 40)) {
      const size_t at = line.find(std::string(label) + " ");
      if (at == std::string::npos) continue;
      const size_t begin = line.find_first_not_of(' ', at + std::string(label).size());
      found = found || line.compare(begin, std::string(value).size(), value) == 0;
    }
    EXPECT_TRUE(found) << label << " " << value << "\n" << screen;
  }
}

TEST_F(MonitorScreenTest, WhatWasCountedIsShownWhereThereIsNoRoomForAll) {
  PublishModel();
  PublishBegin(0);
  partial_metrics_t partial{};
  partial.header = Header(1, 0);
  partial.metrics = Metrics();
  partial.extended = Extended();
  partial.extended.unreachable_poses = 12;
  partial.extended.singular_poses = 345;
  Publish(channels::kPartial, partial);
  EXPECT_NE(All(80, 24).find("4 late actions  12 unreachable poses  345 singular poses"), std::string::npos)
      << All(80, 24);
  EXPECT_NE(All(120, 40).find("0 missing ticks  0 refused samples"), std::string::npos) << All(120, 40);
  // A source may lack the data that a count requires.
  partial.header.tick = 2;
  partial.extended.action_clips = kUnavailableCount;
  Publish(channels::kPartial, partial);
  EXPECT_NE(All(240, 40).find("  - action clips"), std::string::npos) << All(240, 40);
}

TEST_F(MonitorScreenTest, UntrackedMetricsAreAbsent) {
  PublishModel();
  PublishBegin(0);
  partial_metrics_t partial{};
  partial.header = Header(1, 0);
  partial.metrics = Metrics();
  partial.metrics.tracks_collisions = partial.metrics.tracks_joint_jerk = partial.metrics.tracks_slippage = 0;
  partial.extended = Extended();
  Publish(channels::kPartial, partial);
  const std::string screen = All(80, 60);
  EXPECT_EQ(screen.find("collisions"), std::string::npos) << screen;
  EXPECT_EQ(screen.find("joint jerk"), std::string::npos);
  EXPECT_EQ(screen.find("slips"), std::string::npos);
  EXPECT_NE(screen.find("wrist jerk"), std::string::npos);
}

TEST_F(MonitorScreenTest, OneArmHasNoSum) {
  PublishModel();
  PublishBegin(0);
  partial_metrics_t partial{};
  partial.header = Header(1, 0);
  partial.metrics.tracks_cartesian_path_length = 1;
  partial.metrics.arm_name = {"arm"};
  partial.metrics.cartesian_path_length_m = {0.5};
  partial.metrics.joint_path_length_rad = partial.metrics.orientation_path_length_rad = {0};
  partial.metrics.avg_cartesian_jerk_mps3 = partial.metrics.rms_cartesian_jerk_mps3 = {0};
  partial.metrics.avg_joint_jerk_radps3 = partial.metrics.rms_joint_jerk_radps3 = {0};
  partial.metrics.num_arms = 1;
  Publish(channels::kPartial, partial);
  const std::string screen = All(80, 60);
  EXPECT_NE(screen.find("wrist path               0.500 m"), std::string::npos) << screen;
  EXPECT_EQ(screen.find("both"), std::string::npos);
}

TEST_F(MonitorScreenTest, AnotherMessageVersionIsNamedAndNothingOfItsModelShown) {
  Play();
  model_info_t model = small_world::Model();
  model.message_version = model_info_t::VERSION + 1;
  model.task = "of_tomorrow";
  const std::string expected = "message version " + std::to_string(model.message_version) +
                               ", but this evalbus reads version " + std::to_string(model_info_t::VERSION);
  for (int repeated = 0; repeated < 2; ++repeated) Publish(channels::kModel, model);
  EXPECT_TRUE(Screen(80, 24)[0].starts_with(expected + "  udpm://")) << Screen(80, 24)[0];
  EXPECT_TRUE(Screen(60, 1)[0].starts_with(expected)) << Screen(60, 1)[0];
  EXPECT_EQ(All(120, 40).find("of_tomorrow"), std::string::npos) << All(120, 40);
  EXPECT_EQ(All(120, 40).find("pot/lid"), std::string::npos) << "names that are not of this model";
  const auto events = watch_.TakeEvents();
  EXPECT_EQ(std::count(events.begin(), events.end(), "MODEL " + expected), 1);
  PublishModel();
  EXPECT_TRUE(Screen(80, 24)[0].starts_with("small/position")) << Screen(80, 24)[0];
}

TEST_F(MonitorScreenTest, OpenedInMidEpisodeShowsWhatCameBefore) {
  // The messages of a tick arrive first, and the names only with the next MODEL.
  PublishTick(4, 75, true);
  std::string screen = All(80, 24);
  EXPECT_NE(screen.find("episode 4   running       1.50 s"), std::string::npos) << screen;
  EXPECT_NE(screen.find("wrist path       1.250 0.750 2.000 m"), std::string::npos);
  EXPECT_NE(screen.find("● held                       0.52 s"), std::string::npos);
  EXPECT_NE(screen.find("waiting for the MODEL message"), std::string::npos);
  EXPECT_NE(screen.find("geom 2 – geom 7"), std::string::npos);
  run_summary_t run{};
  run.num_episodes = run.num_complete = 4;
  run.num_success = 3;
  run.success_rate = 0.75;
  Publish(channels::kRunSummary, run);
  PublishModel();
  screen = All(80, 24);
  EXPECT_NE(screen.find("4 of 10 done, success 75 %"), std::string::npos) << screen;
  EXPECT_NE(screen.find("left/pad – pot/lid 0.300 mm"), std::string::npos);
  EXPECT_NE(screen.find("small/position"), std::string::npos);
}

// The log player reports a replay. Only components that receive it are shown.
TEST_F(MonitorScreenTest, AReplayIsCalledOne) {
  PublishModel();
  EXPECT_NE(All(80, 24).find("two_arms   realtime"), std::string::npos) << All(80, 24);
  PublishBegin(2);
  for (const char* name : {"metrics", "replay"}) PublishStatus(name, 2, 74);
  PublishTick(2, 75);
  const std::string screen = All(80, 24);
  EXPECT_NE(screen.find("two_arms   replay"), std::string::npos) << screen;
  EXPECT_NE(screen.find("episode 2   running       1.50 s"), std::string::npos) << screen;
  EXPECT_NE(screen.find("● metrics ● replay"), std::string::npos) << screen;
  EXPECT_EQ(screen.find("✕"), std::string::npos) << screen;
}

TEST_F(MonitorScreenTest, OpenedWhileThePolicyComputesShowsWhereWeAre) {
  PublishStatus("sim", 3, 17);
  EXPECT_NE(All(80, 24).find("episode 3   waiting for the next tick"), std::string::npos) << All(80, 24);
}

TEST_F(MonitorScreenTest, ANewEpisodeAndANewAttemptShowNoOldValues) {
  Play();
  PublishBegin(3);
  std::string screen = All(80, 24);
  EXPECT_NE(screen.find("episode 3   waiting for components"), std::string::npos) << screen;
  EXPECT_NE(screen.find("wrist path           -     -     - m"), std::string::npos) << screen;
  EXPECT_NE(screen.find("○ held"), std::string::npos);
  PublishTick(3, 0);
  PublishBegin(3, 1);
  screen = All(80, 24);
  EXPECT_NE(screen.find("episode 3, attempt 2"), std::string::npos) << screen;
  EXPECT_NE(screen.find("wrist path           -     -     - m"), std::string::npos);
}

TEST_F(MonitorScreenTest, TheSameEpisodeMayBeginAgain) {
  Play();
  PublishSummary(2, "success");
  PublishBegin(2);
  EXPECT_NE(All(80, 24).find("wrist path           -     -     - m"), std::string::npos) << All(80, 24);
  PublishTick(2, 75);
  EXPECT_NE(All(80, 24).find("episode 2   running       1.50 s"), std::string::npos) << All(80, 24);
}

TEST_F(MonitorScreenTest, TheEndIsShownUntilTheNextEpisode) {
  Play();
  PublishSummary(2, "failure");
  const std::string screen = All(80, 24);
  EXPECT_NE(screen.find("episode 2   dropped"), std::string::npos) << screen;
  EXPECT_NE(screen.find("wrist path       1.250 0.750 2.000 m"), std::string::npos);
  EXPECT_NE(screen.find("3 of 10 done"), std::string::npos);
}

TEST_F(MonitorScreenTest, ASilentComponentIsDeadAndComesBack) {
  Play();
  for (int i = 0; i < 5; ++i) {
    now_ += milliseconds(500);
    for (const char* name : {"collision", "metrics", "recorder", "run", "sim"}) PublishStatus(name, 2, 75);
  }
  std::string screen = All(80, 24);
  EXPECT_NE(screen.find("✕ policy silent for 3 s   last tick 120"), std::string::npos) << screen;
  EXPECT_NE(screen.find("● metrics"), std::string::npos);
  const std::string large = All(120, 40);
  EXPECT_NE(large.find("policy      ✕ silent"), std::string::npos) << large;
  PublishStatus("policy", 2, 76);
  screen = All(80, 24);
  EXPECT_EQ(screen.find("✕"), std::string::npos) << screen;
  const auto events = watch_.TakeEvents();
  EXPECT_EQ(std::count_if(events.begin(), events.end(),
                          [](const std::string& e) { return e.find("no message from policy for ") == 0; }),
            1);
  EXPECT_EQ(events.back(), "policy publishes again");
}

TEST_F(MonitorScreenTest, ScoresOfAnotherEpisodeAreNotShown) {
  Play();
  partial_metrics_t partial{};
  partial.header = Header(3, 9);
  Publish(channels::kPartial, partial);
  EXPECT_NE(All(80, 24).find("wrist path       1.250 0.750 2.000 m"), std::string::npos) << All(80, 24);
}

TEST_F(MonitorScreenTest, FailureIsShownWithItsText) {
  Play();
  component_status_t status{};
  status.component = "policy";
  status.state = component_status_t::FAILED;
  status.error = "no\x1bmodel";
  Publish(channels::kStatus, status);
  EXPECT_NE(All(80, 24).find("✕ policy failed: no?model"), std::string::npos) << All(80, 24);
}

TEST_F(MonitorScreenTest, LagIsThatOfTheTimeOfPublication) {
  PublishModel();
  PublishBegin(0);
  for (int64_t tick = 0; tick < 50; ++tick) Publish(channels::kState, State(tick, 0));
  PublishStatus("recorder", 0, 37);
  for (int64_t tick = 50; tick < 900; ++tick) Publish(channels::kState, State(tick, 0));
  EXPECT_NE(All(80, 24).find("recorder    running      37    12"), std::string::npos) << All(80, 24);
}

TEST_F(MonitorScreenTest, RatesAndSpeedAreOfTheLastSecond) {
  Play();
  const std::string screen = All(80, 24);
  EXPECT_NE(screen.find("STATE 50  CONTACTS 50"), std::string::npos) << screen;
  EXPECT_NE(screen.find("1.00 x real time"), std::string::npos) << screen;
  now_ += milliseconds(1000);
  All(80, 24);
  PublishTick(2, 126);
  now_ += milliseconds(5000);
  EXPECT_NE(All(80, 50).find("STATE 0.2  CONTACTS 0.2"), std::string::npos) << All(80, 50);
}

TEST_F(MonitorScreenTest, SurvivesWhatDoesNotDecode) {
  Play();
  const std::vector<uint8_t> noise(100, 0xFF);
  for (const char* channel :
       {channels::kState.name, channels::kContacts.name, channels::kPartial.name, channels::kModel.name,
        channels::kStatus.name, channels::kEpisodeBegin.name, channels::kEpisodeEnd.name,
        channels::kEpisodeSummary.name, channels::kRunSummary.name}) {
    watch_.Receive(channel, noise, now_);
    watch_.Receive(channel, {}, now_);
  }
  const std::string screen = All(120, 60);
  EXPECT_NE(screen.find("18 undecodable"), std::string::npos) << screen;
  EXPECT_NE(screen.find("wrist path                1.250"), std::string::npos);
}

TEST_F(MonitorScreenTest, ARepeatedScoreIsShownOnce) {
  PublishModel();
  const auto scores = [&] {
    return std::ranges::count_if(watch_.TakeEvents(), [](const std::string& event) {
      return event.find("episode 0 success") != std::string::npos;
    });
  };
  PublishBegin(0);
  PublishTick(0, 0);
  PublishSummary(0, "success");
  EXPECT_EQ(scores(), 1);
  PublishSummary(0, "success");
  EXPECT_EQ(scores(), 0);
  // If the same episode is played a second time, it is displayed again.
  PublishBegin(0);
  PublishSummary(0, "success");
  EXPECT_EQ(scores(), 1);
}

TEST_F(MonitorScreenTest, ShowsWhatComponentsLogAndOfManyLinesTheLast) {
  Play();
  for (int i = 0; i < 30; ++i) PublishLog(log_t::INFO_LEVEL, "line " + std::to_string(i));
  const std::string spacious = All(120, 80);
  EXPECT_NE(spacious.find("sim  e2 t127     line 29"), std::string::npos) << spacious;
  EXPECT_NE(spacious.find("line 25"), std::string::npos) << spacious;
  EXPECT_EQ(spacious.find("line 24"), std::string::npos) << spacious;
}

TEST_F(MonitorScreenTest, KeepsTheLastWarningWhereThereIsLittleRoom) {
  Play();
  PublishLog(log_t::WARN_LEVEL, "no PARTIAL from \x1b[31mmetrics");
  PublishLog(log_t::INFO_LEVEL, "continues");
  const std::string screen = All(100, 30);
  EXPECT_NE(screen.find("no PARTIAL from ?[31mmetrics"), std::string::npos) << screen;
  EXPECT_EQ(screen.find("continues"), std::string::npos) << screen;
}

TEST_F(MonitorScreenTest, InventedNamesFillNeitherMemoryNorScreen) {
  for (int i = 0; i < 1000; ++i) {
    PublishStatus("component_" + std::to_string(i), 0, 0);
    watch_.Receive("CHANNEL_" + std::to_string(i), Encode(episode_begin_t{}), now_);
  }
  EXPECT_LT(Lines(100, 10000).size(), 250u);
}

TEST_F(MonitorScreenTest, ExplainsWhatToDoIfNothingIsReceived) {
  watch_.SilentFor(now_);
  EXPECT_EQ(All(80, 24).find("private network"), std::string::npos);
  now_ += milliseconds(2500);
  EXPECT_NE(All(80, 24).find("udpm://239.255.76.67:31234"), std::string::npos);
  EXPECT_NE(All(80, 24).find("private network"), std::string::npos);
}

TEST(DoneText, StatesKindAndSubjectOfTheInterval) {
  run_summary_t run{};
  run.num_episodes = run.num_complete = 4;
  run.success_rate = 0.75;
  run.success_rate_anytime_lower = 0.17;
  run.success_rate_anytime_upper = 0.99;
  run.success_rate_wilson_lower = 0.30;
  run.success_rate_wilson_upper = 0.95;
  EXPECT_EQ(DoneText(run, 10), "4 of 10 done, success 75 % (anytime CI 17 to 99)");
  EXPECT_EQ(DoneText(run, 0), "4 done, success 75 % (anytime CI 17 to 99)");
  EXPECT_EQ(DoneText(run, 4), "4 of 4 done, success 75 % (95 % CI 30 to 95, Wilson)");
  run.is_part = 1;
  EXPECT_EQ(DoneText(run, 4), "4 of 4 counted here, success 75 % (anytime CI 17 to 99)");
}

TEST_F(MonitorScreenTest, PrintsEventsAndProgressAsLines) {
  Play();
  const auto events = watch_.TakeEvents();
  ASSERT_EQ(events.size(), 7u);
  EXPECT_EQ(events[0], "episode 0 begins, seed 77");
  EXPECT_EQ(
      events[1],
      "episode 0 success after 2.50 s  stages 1/2  slips 3  collisions with the scene 2  self collisions 0  "
      "smallest clearance 12.00 mm  wrist path 2.000 m  wrist jerk, rms 125.0 m/s³");
  EXPECT_EQ(events[2], "1 of 10 done, success 100 % (anytime CI 9 to 91)");
  EXPECT_EQ(
      ProgressLine(watch_),
      "episode 2  2.50 s  1.00 x real time  stages 1/2  slips 3  collisions with the scene 2  self "
      "collisions 0  smallest clearance 12.00 mm  wrist path 2.000 m  wrist jerk, rms 125.0 m/s³  clearance "
      "41.00 mm");
  run_summary_t again{};
  again.num_episodes = 2;
  Publish(channels::kRunSummary, again);
  EXPECT_TRUE(watch_.TakeEvents().empty());
  PublishSummary(2, "success");
  EXPECT_EQ(ProgressLine(watch_), "");
}

}  // namespace evalbus::viz::monitor_screen_test
