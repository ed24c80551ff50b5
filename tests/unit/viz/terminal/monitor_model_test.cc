// The monitor's screen, from scripted messages.
#include "viz/terminal/monitor_model.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "bus/channels.h"
#include "evalbus/episode_begin_t.hpp"
#include "evalbus/episode_end_t.hpp"
#include "tests/unit/small_world.h"

namespace evalbus::viz {
namespace {

using std::chrono::milliseconds;
using namespace small_world;

class MonitorModelTest : public testing::Test {
 protected:
  template <class Message>
  void Say(const Channel<Message>& channel, const Message& message) {
    dut_.Hear(channel.name, Encode(message), now_);
  }
  void SayModel() {
    model_info_t model = small_world::Model();
    model.variation = "position";
    model.robot = "two_arms";
    model.clock = "realtime";
    model.run_id = "a_run";
    model.time_limit_us = 5'000'000;
    Say(channels::kModel, model);
  }
  void SayBegin(int episode, int attempt = 0) {
    episode_begin_t begin{};
    begin.header = Header(0, episode);
    begin.header.attempt = attempt;
    begin.seed = 77;
    Say(channels::kEpisodeBegin, begin);
  }
  void SayStatus(const std::string& name, int episode, int64_t tick,
                 int8_t state = component_status_t::READY) {
    component_status_t status{};
    status.component = name;
    status.state = state;
    status.episode = episode;
    status.last_tick = tick;
    Say(channels::kStatus, status);
  }
  static metric_values_t Metrics() {
    metric_values_t m{};
    m.tracks_vel_sync = m.tracks_vertical_sync = m.tracks_slippage = m.tracks_collisions = 1;
    m.tracks_cartesian_jerk = m.tracks_joint_jerk = m.tracks_cartesian_path_length = 1;
    m.tracks_joint_path_length = m.tracks_orientation_path_length = 1;
    m.completion_time_s = 2.5;
    m.stage_index = {1, 2};
    m.stage_name = {"held", "lifted"};
    m.stage_reached = {1, 0};
    m.num_stages = 2;
    m.subtask_progress = 0.5;
    m.target_distance_name = {"lift", "left_gripper_to_pot"};
    m.target_distance_m = {0.1234, 0.25};
    m.num_target_distances = 2;
    m.pose_error_name = {""};
    m.object_pose_error_rad = {0.031};
    m.num_pose_errors = 1;
    m.slip_count = 3;
    m.object_name = {"pot"};
    m.slip_count_per_object = {3};
    m.num_objects = 1;
    m.env_collision_count = 2;
    m.bimanual_arm_velocity_difference_radps = 0.5;
    m.bimanual_gripper_vertical_difference_m = 0.0121;
    m.arm_name = {"left", "right"};
    m.num_arms = 2;
    m.cartesian_path_length_m = {1.25, 0.75};
    m.joint_path_length_rad = {10.5, 4};
    m.orientation_path_length_rad = {2, 1};
    m.avg_cartesian_jerk_mps3 = {100.5, 80};
    m.rms_cartesian_jerk_mps3 = {150, 90};
    m.avg_joint_jerk_radps3 = {1000, 12345};
    m.rms_joint_jerk_radps3 = {2000, 123456};
    m.overall_avg_cartesian_jerk_mps3 = 90.25;
    m.overall_rms_cartesian_jerk_mps3 = 125;
    m.overall_avg_joint_jerk_radps3 = 6000;
    m.overall_rms_joint_jerk_radps3 = 70000;
    return m;
  }
  static extended_metrics_t Extended() {
    extended_metrics_t e{};
    const auto add = [&e](const std::string& name, const std::string& unit, double value) {
      e.name.push_back(name);
      e.unit.push_back(unit);
      e.value_mixed.push_back(value);
      ++e.num_values;
    };
    add("min_clearance_m", "m", 0.012);
    add("min_clearance_time_s", "s", 0.84);
    add("peak_penetration_m", "m", 0.0004);
    add("contact_time_s", "s", 0.06);
    add("mechanical_work_J.left", "J", 5);
    add("mechanical_work_J.right", "J", 2.5);
    add("peak_wrist_speed_mps.left", "m/s", 0.31);
    add("peak_wrist_speed_mps.right", "m/s", 0.3);
    add("min_joint_limit_margin_rad", "rad", 0.2);
    e.stage_time_s = {0.52, -1};
    e.num_stages = 2;
    e.deadline_misses = 4;
    return e;
  }
  // One tick of everything.
  void SayTick(int episode, int64_t tick, bool with_clearance = false) {
    Say(channels::kState, State(tick, episode));
    contacts_t contacts = Contacts(tick, {{kLeftPad, kLidGeom}, {kTop, kWall}}, episode);
    contacts.contact[0].distance_m = -0.0003;
    contacts.contact[1].distance_m = -0.0002;
    contacts.has_clearance = with_clearance;
    contacts.clearance_m = with_clearance ? 0.041 : 0;
    contacts.clearance_robot_geom = with_clearance ? int{kRightLink} : -1;
    contacts.clearance_scene_geom = with_clearance ? int{kTop} : -1;
    Say(channels::kContacts, contacts);
    partial_metrics_t partial{};
    partial.header = Header(tick, episode);
    partial.metrics = Metrics();
    partial.extended = Extended();
    Say(channels::kPartial, partial);
  }
  void SaySummary(int episode, const std::string& reason) {
    episode_end_t end{};
    end.header = Header(75, episode);
    end.end_reason = reason;
    Say(channels::kEpisodeEnd, end);
    episode_summary_t summary{};
    summary.header = end.header;
    summary.end_reason = reason;
    summary.complete = 1;
    summary.metrics = Metrics();
    summary.extended = Extended();
    Say(channels::kEpisodeSummary, summary);
    run_summary_t run{};
    run.num_episodes = run.num_complete = episode + 1;
    run.num_success = 1;
    run.success_rate = 1.0 / (episode + 1);
    run.success_rate_lower = 0.0945;
    run.success_rate_upper = 0.9055;
    Say(channels::kRunSummary, run);
  }
  // 2.5 simulated seconds of episode 2 at 50 Hz and real time, after two others.
  void Play() {
    SayModel();
    for (const int episode : {0, 1}) {
      SayBegin(episode);
      SayTick(episode, 0);
      SaySummary(episode, episode == 0 ? "success" : "time_limit");
    }
    now_ += milliseconds(1000);
    SayBegin(2);
    for (int64_t tick = 0; tick <= 125; ++tick) {
      SayTick(2, tick, tick % 5 == 0);
      if (tick % 20 == 0) {
        for (const char* name : {"collision", "metrics", "policy", "recorder", "run"})
          SayStatus(name, 2, tick);
        SayStatus("recorder", 2, std::max<int64_t>(0, tick - 12));
        SayStatus("sim", 2, tick);
      }
      now_ += milliseconds(20);
    }
    SayTick(2, 126);  // clearance is not of every tick
  }
  std::vector<std::string> Screen(int width, int height) {
    std::vector<std::string> texts;
    for (const Line& line : dut_.Lines(width, height, now_)) texts.push_back(LineText(line));
    return texts;
  }
  std::string All(int width, int height) {
    std::string all;
    for (const std::string& line : Screen(width, height)) all += line + "\n";
    return all;
  }

  SteadyTime now_{std::chrono::hours(1)};
  MonitorModel dut_{"udpm://239.255.76.67:31234?ttl=0", 10};
};

constexpr char kGolden[] = R"(
small/position   two_arms   realtime                              a_run   q ends

episode 2   running       2.52 s of 5 s    1.00 x real time   progress 50 %
  ● held                       0.52 s     ○ lifted

                  left  right   both          collisions, scene          2
wrist path       1.250  0.750  2.000 m        collisions, self           0
joint path       10.50  4.000  14.50 rad      slips                      3
wrist rotation   2.000  1.000  3.000 rad      lift                   0.123 m
wrist jerk rms   150.0  90.00  125.0 m/s³     left_gripper_to_pot    0.250 m
wrist jerk mean  100.5  80.00  90.25 m/s³     pose error             0.031 rad
joint jerk rms    2000   123k  70000 rad/s³   deepest penetration      0.4 mm
joint jerk mean   1000  12345   6000 rad/s³   touching the scene     0.060 s
work             5.000  2.500  7.500 J        arm speed difference   0.500 rad/s
top wrist speed  0.310  0.300        m/s      height difference       12.1 mm
                                              joint limit margin     0.200 rad

contacts    2     deepest left/pad – pot/lid 0.3 mm
clearance   41.0 mm   smallest 12.0 mm at 0.84 s   right/link – counter/top
counted     0 actions clipped   4 late   0 ticks missing   0 samples refused
episodes    2 of 10 done, success 50 % (CI 9 to 91)  last time_limit, success
components  lag 12   ● collision ● metrics ● policy ● recorder ● run ● sim
per second  STATE 50  CONTACTS 50  PARTIAL 50  STATUS 14
)";

TEST_F(MonitorModelTest, FillsAnEightyByTwentyFourTerminal) {
  Play();
  EXPECT_EQ("\n" + All(80, 24), kGolden) << All(80, 24);
}

TEST_F(MonitorModelTest, NeverExceedsTheTerminal) {
  const auto check = [&] {
    for (int width = 1; width <= 200; width += width < 30 ? 1 : 7) {
      for (int height = 1; height <= 60; height += height < 30 ? 1 : 7) {
        const auto lines = dut_.Lines(width, height, now_);
        ASSERT_LE(lines.size(), static_cast<size_t>(height));
        for (const Line& line : lines) ASSERT_LE(LineWidth(line), width) << LineText(line);
      }
    }
    EXPECT_TRUE(dut_.Lines(0, 0, now_).empty());
  };
  check();
  Play();
  check();
  now_ += milliseconds(3000);  // everything silent: more to say
  check();
}

TEST_F(MonitorModelTest, KeepsWhatMattersMostWhereThereIsLittleRoom) {
  Play();
  const std::string small = All(60, 20);
  for (const char* text : {"small/position", "episode 2   running", "● held", "○ lifted", "collisions, scene",
                           "slips", "wrist path       1.250  0.750  2.000 m", "contacts", "clearance",
                           "2 of 10 done", "(CI 9 to 91)", "components"}) {
    EXPECT_NE(small.find(text), std::string::npos) << text << "\n" << small;
  }
  EXPECT_EQ(small.find("jerk"), std::string::npos) << small;
  const auto tiny = Screen(40, 3);
  EXPECT_NE(tiny[0].find("small/position"), std::string::npos);
  EXPECT_NE(tiny[1].find("episode 2"), std::string::npos);
}

TEST_F(MonitorModelTest, UsesMoreRoomForTheComponentsAndTheLastEpisodes) {
  Play();
  const std::string large = All(120, 40);
  for (const char* text : {"component   state      tick   lag   lost  garbled  foreign    heard",
                           "recorder    running     108    12      0        0        0    0.1 s",
                           "         1  time_limit       2.50 s  stages 1/2",
                           "         0  success          2.50 s  stages 1/2"}) {
    EXPECT_NE(large.find(text), std::string::npos) << text << "\n" << large;
  }
}

TEST_F(MonitorModelTest, EveryValueHasItsUnit) {
  Play();
  const std::string screen = All(120, 40);
  for (const char* text :
       {"wrist path       1.250  0.750  2.000 m\n", "joint path       10.50  4.000  14.50 rad",
        "wrist rotation   2.000  1.000  3.000 rad", "wrist jerk rms   150.0  90.00  125.0 m/s³",
        "wrist jerk mean  100.5  80.00  90.25 m/s³", "joint jerk rms    2000   123k  70000 rad/s³",
        "joint jerk mean   1000  12345   6000 rad/s³", "work             5.000  2.500  7.500 J",
        "top wrist speed  0.310  0.300        m/s", "2.52 s of 5 s", "progress 50 %"}) {
    const std::string wanted(text, std::string(text).find_last_not_of('\n') + 1);
    EXPECT_NE(screen.find(wanted), std::string::npos) << wanted << "\n" << screen;
  }
  const std::pair<const char*, const char*> values[] = {{"collisions, scene", "2"},
                                                        {"collisions, self", "0"},
                                                        {"slips", "3"},
                                                        {"lift", "0.123 m"},
                                                        {"left_gripper_to_pot", "0.250 m"},
                                                        {"pose error", "0.031 rad"},
                                                        {"deepest penetration", "0.4 mm"},
                                                        {"touching the scene", "0.060 s"},
                                                        {"arm speed difference", "0.500 rad/s"},
                                                        {"height difference", "12.1 mm"},
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

TEST_F(MonitorModelTest, UntrackedMetricsAreAbsent) {
  SayModel();
  SayBegin(0);
  partial_metrics_t partial{};
  partial.header = Header(1, 0);
  partial.metrics = Metrics();
  partial.metrics.tracks_collisions = partial.metrics.tracks_joint_jerk = partial.metrics.tracks_slippage = 0;
  partial.extended = Extended();
  Say(channels::kPartial, partial);
  const std::string screen = All(80, 60);
  EXPECT_EQ(screen.find("collisions"), std::string::npos) << screen;
  EXPECT_EQ(screen.find("joint jerk"), std::string::npos);
  EXPECT_EQ(screen.find("slips"), std::string::npos);
  EXPECT_NE(screen.find("wrist jerk"), std::string::npos);
}

TEST_F(MonitorModelTest, OneArmHasNoSum) {
  SayModel();
  SayBegin(0);
  partial_metrics_t partial{};
  partial.header = Header(1, 0);
  partial.metrics.tracks_cartesian_path_length = 1;
  partial.metrics.arm_name = {"arm"};
  partial.metrics.cartesian_path_length_m = {0.5};
  partial.metrics.joint_path_length_rad = partial.metrics.orientation_path_length_rad = {0};
  partial.metrics.avg_cartesian_jerk_mps3 = partial.metrics.rms_cartesian_jerk_mps3 = {0};
  partial.metrics.avg_joint_jerk_radps3 = partial.metrics.rms_joint_jerk_radps3 = {0};
  partial.metrics.num_arms = 1;
  Say(channels::kPartial, partial);
  const std::string screen = All(80, 60);
  EXPECT_NE(screen.find("wrist path       0.500 m"), std::string::npos) << screen;
  EXPECT_EQ(screen.find("both"), std::string::npos);
}

TEST_F(MonitorModelTest, AnotherMessageVersionIsNamedAndNothingOfItsModelShown) {
  Play();
  model_info_t model = small_world::Model();
  model.message_version = model_info_t::VERSION + 1;
  model.task = "of_tomorrow";
  const std::string expected = "made by message version " + std::to_string(model.message_version) +
                               ", this evalbus reads " + std::to_string(model_info_t::VERSION);
  for (int repeated = 0; repeated < 2; ++repeated) Say(channels::kModel, model);
  EXPECT_TRUE(Screen(80, 24)[0].starts_with(expected + "  udpm://")) << Screen(80, 24)[0];
  EXPECT_TRUE(Screen(60, 1)[0].starts_with(expected)) << Screen(60, 1)[0];
  EXPECT_EQ(All(120, 40).find("of_tomorrow"), std::string::npos) << All(120, 40);
  EXPECT_EQ(All(120, 40).find("pot/lid"), std::string::npos) << "names that are not of this model";
  const auto events = dut_.TakeEvents(now_);
  EXPECT_EQ(std::count(events.begin(), events.end(), "MODEL " + expected), 1);
  SayModel();
  EXPECT_TRUE(Screen(80, 24)[0].starts_with("small/position")) << Screen(80, 24)[0];
}

TEST_F(MonitorModelTest, OpenedInMidEpisodeShowsWhatCameBefore) {
  // First the messages of a tick; names come with the next MODEL.
  SayTick(4, 75, true);
  std::string screen = All(80, 24);
  EXPECT_NE(screen.find("episode 4   running       1.50 s"), std::string::npos) << screen;
  EXPECT_NE(screen.find("wrist path       1.250  0.750  2.000 m"), std::string::npos);
  EXPECT_NE(screen.find("● held                       0.52 s"), std::string::npos);
  EXPECT_NE(screen.find("waiting for the names"), std::string::npos);
  EXPECT_NE(screen.find("geom 2 – geom 7"), std::string::npos);
  run_summary_t run{};
  run.num_episodes = run.num_complete = 4;
  run.num_success = 3;
  run.success_rate = 0.75;
  Say(channels::kRunSummary, run);
  SayModel();
  screen = All(80, 24);
  EXPECT_NE(screen.find("4 of 10 done, success 75 %"), std::string::npos) << screen;
  EXPECT_NE(screen.find("left/pad – pot/lid 0.3 mm"), std::string::npos);
  EXPECT_NE(screen.find("small/position"), std::string::npos);
}

// Who plays the log says so; of the components of the run, only those that listen afresh are there.
TEST_F(MonitorModelTest, AReplayIsCalledOne) {
  SayModel();
  EXPECT_NE(All(80, 24).find("two_arms   realtime"), std::string::npos) << All(80, 24);
  SayBegin(2);
  for (const char* name : {"metrics", "replay"}) SayStatus(name, 2, 74);
  SayTick(2, 75);
  const std::string screen = All(80, 24);
  EXPECT_NE(screen.find("two_arms   replay"), std::string::npos) << screen;
  EXPECT_NE(screen.find("episode 2   running       1.50 s"), std::string::npos) << screen;
  EXPECT_NE(screen.find("● metrics ● replay"), std::string::npos) << screen;
  EXPECT_EQ(screen.find("✕"), std::string::npos) << screen;
}

TEST_F(MonitorModelTest, OpenedWhileThePolicyThinksShowsWhereWeAre) {
  SayStatus("sim", 3, 17);
  EXPECT_NE(All(80, 24).find("episode 3   waiting for the next tick"), std::string::npos) << All(80, 24);
}

TEST_F(MonitorModelTest, ANewEpisodeAndANewAttemptShowNoOldValues) {
  Play();
  SayBegin(3);
  std::string screen = All(80, 24);
  EXPECT_NE(screen.find("episode 3   waiting for components"), std::string::npos) << screen;
  EXPECT_NE(screen.find("wrist path           -      -      - m"), std::string::npos) << screen;
  EXPECT_NE(screen.find("○ held"), std::string::npos);
  SayTick(3, 0);
  SayBegin(3, 1);
  screen = All(80, 24);
  EXPECT_NE(screen.find("episode 3, try 2"), std::string::npos) << screen;
  EXPECT_NE(screen.find("wrist path           -      -      - m"), std::string::npos);
}

TEST_F(MonitorModelTest, TheSameEpisodeMayBeginAgain) {
  Play();
  SaySummary(2, "success");
  SayBegin(2);
  EXPECT_NE(All(80, 24).find("wrist path           -      -      - m"), std::string::npos) << All(80, 24);
  SayTick(2, 75);
  EXPECT_NE(All(80, 24).find("episode 2   running       1.50 s"), std::string::npos) << All(80, 24);
}

TEST_F(MonitorModelTest, TheEndIsShownUntilTheNextEpisode) {
  Play();
  SaySummary(2, "failure");
  const std::string screen = All(80, 24);
  EXPECT_NE(screen.find("episode 2   failure"), std::string::npos) << screen;
  EXPECT_NE(screen.find("wrist path       1.250  0.750  2.000 m"), std::string::npos);
  EXPECT_NE(screen.find("3 of 10 done"), std::string::npos);
}

TEST_F(MonitorModelTest, ASilentComponentIsDeadAndComesBack) {
  Play();
  for (int i = 0; i < 5; ++i) {
    now_ += milliseconds(500);
    for (const char* name : {"collision", "metrics", "recorder", "run", "sim"}) SayStatus(name, 2, 75);
  }
  std::string screen = All(80, 24);
  EXPECT_NE(screen.find("✕ policy silent for 3 s   last tick 120"), std::string::npos) << screen;
  EXPECT_NE(screen.find("● metrics"), std::string::npos);
  const std::string large = All(120, 40);
  EXPECT_NE(large.find("policy      ✕ silent"), std::string::npos) << large;
  SayStatus("policy", 2, 76);
  screen = All(80, 24);
  EXPECT_EQ(screen.find("✕"), std::string::npos) << screen;
  const auto events = dut_.TakeEvents(now_);
  EXPECT_EQ(std::count_if(events.begin(), events.end(),
                          [](const std::string& e) { return e.find("policy is silent") == 0; }),
            1);
  EXPECT_EQ(events.back(), "policy is back");
}

TEST_F(MonitorModelTest, ScoresOfAnotherEpisodeAreNotShown) {
  Play();
  partial_metrics_t partial{};
  partial.header = Header(3, 9);
  Say(channels::kPartial, partial);
  EXPECT_NE(All(80, 24).find("wrist path       1.250  0.750  2.000 m"), std::string::npos) << All(80, 24);
}

TEST_F(MonitorModelTest, FailureIsShownWithItsText) {
  Play();
  component_status_t status{};
  status.component = "policy";
  status.state = component_status_t::FAILED;
  status.error = "no\x1bmodel";
  Say(channels::kStatus, status);
  EXPECT_NE(All(80, 24).find("✕ policy failed: no?model"), std::string::npos) << All(80, 24);
}

TEST_F(MonitorModelTest, LagIsThatOfTheMomentItWasSaid) {
  SayModel();
  SayBegin(0);
  for (int64_t tick = 0; tick < 50; ++tick) Say(channels::kState, State(tick, 0));
  SayStatus("recorder", 0, 37);
  for (int64_t tick = 50; tick < 900; ++tick) Say(channels::kState, State(tick, 0));
  EXPECT_NE(All(80, 24).find("recorder    running      37    12"), std::string::npos) << All(80, 24);
}

TEST_F(MonitorModelTest, RatesAndSpeedAreOfTheLastSecond) {
  Play();
  const std::string screen = All(80, 24);
  EXPECT_NE(screen.find("STATE 50  CONTACTS 50"), std::string::npos) << screen;
  EXPECT_NE(screen.find("1.00 x real time"), std::string::npos) << screen;
  now_ += milliseconds(1000);
  All(80, 24);
  SayTick(2, 126);
  now_ += milliseconds(5000);
  EXPECT_NE(All(80, 50).find("STATE 0.2  CONTACTS 0.2"), std::string::npos) << All(80, 50);
}

TEST_F(MonitorModelTest, SurvivesWhatDoesNotDecode) {
  Play();
  const std::vector<uint8_t> noise(100, 0xFF);
  for (const char* channel :
       {channels::kState.name, channels::kContacts.name, channels::kPartial.name, channels::kModel.name,
        channels::kStatus.name, channels::kEpisodeBegin.name, channels::kEpisodeEnd.name,
        channels::kEpisodeSummary.name, channels::kRunSummary.name}) {
    dut_.Hear(channel, noise, now_);
    dut_.Hear(channel, {}, now_);
  }
  const std::string screen = All(120, 60);
  EXPECT_NE(screen.find("18 garbled"), std::string::npos) << screen;
  EXPECT_NE(screen.find("wrist path       1.250"), std::string::npos);
}

TEST_F(MonitorModelTest, AScoreThatIsSaidAgainIsShownOnce) {
  SayModel();
  const auto scores = [&] {
    return std::ranges::count_if(dut_.TakeEvents(now_), [](const std::string& event) {
      return event.find("episode 0 success") != std::string::npos;
    });
  };
  SayBegin(0);
  SayTick(0, 0);
  SaySummary(0, "success");
  EXPECT_EQ(scores(), 1);
  SaySummary(0, "success");
  EXPECT_EQ(scores(), 0);
  // The same episode played a second time is news.
  SayBegin(0);
  SaySummary(0, "success");
  EXPECT_EQ(scores(), 1);
}

TEST_F(MonitorModelTest, InventedNamesFillNeitherMemoryNorScreen) {
  for (int i = 0; i < 1000; ++i) {
    SayStatus("component_" + std::to_string(i), 0, 0);
    dut_.Hear("CHANNEL_" + std::to_string(i), Encode(episode_begin_t{}), now_);
  }
  EXPECT_LT(dut_.Lines(100, 10000, now_).size(), 250u);
}

TEST_F(MonitorModelTest, SaysWhatToDoWhereNothingIsHeard) {
  dut_.SilentFor(now_);
  EXPECT_EQ(All(80, 24).find("private network"), std::string::npos);
  now_ += milliseconds(2500);
  EXPECT_NE(All(80, 24).find("udpm://239.255.76.67:31234"), std::string::npos);
  EXPECT_NE(All(80, 24).find("private network"), std::string::npos);
}

TEST_F(MonitorModelTest, TellsEventsAndProgressInLines) {
  Play();
  const auto events = dut_.TakeEvents(now_);
  ASSERT_EQ(events.size(), 7u);
  EXPECT_EQ(events[0], "episode 0 begins, seed 77");
  EXPECT_EQ(
      events[1],
      "episode 0 success after 2.50 s, stages 1/2, slips 3, collisions 2 scene 0 self, wrist path 2.00 m");
  EXPECT_EQ(events[2], "1 of 10 done, success 100 % (CI 9 to 91)");
  EXPECT_EQ(dut_.ProgressLine(now_),
            "episode 2  2.50 s  1.00 x real time  stages 1/2  slips 3  collisions 2 scene 0 self  wrist path "
            "2.00 m  "
            "clearance 41.0 mm");
  run_summary_t again{};
  again.num_episodes = 2;
  Say(channels::kRunSummary, again);
  EXPECT_TRUE(dut_.TakeEvents(now_).empty());
  SaySummary(2, "success");
  EXPECT_EQ(dut_.ProgressLine(now_), "");
}

}  // namespace
}  // namespace evalbus::viz
