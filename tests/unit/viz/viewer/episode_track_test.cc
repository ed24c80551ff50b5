#include "viz/viewer/episode_track.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "lcmtypes/source.h"
#include "tests/unit/small_world.h"

namespace evalbus::viz::episode_track_test {

using namespace small_world;

const std::vector<int> kMoving = {kLeftHand, kPot};

EpisodeTrack MakeTrack() {
  return EpisodeTrack(std::make_shared<model_info_t>(Model()), Header(0),
                      {.run = 3, .policy = "expert", .scene = "abc", .bodies = kMoving});
}

partial_metrics_t Partial(int64_t tick) {
  partial_metrics_t partial{};
  partial.header = Header(tick);
  metric_values_t& m = partial.metrics;
  m.num_samples = tick;
  m.completion_time_s = 0.02 * static_cast<double>(tick);
  m.num_stages = 2;
  m.stage_index = {1, 2};
  m.stage_name = {"held", "lifted"};
  m.stage_reached = {tick >= 2, 0};
  m.num_target_distances = 2;
  m.target_distance_name = {"lift", "left_gripper_to_pot"};
  m.target_distance_m = {0.5 - 0.1 * static_cast<double>(tick), 1};
  m.num_arms = 2;
  m.arm_name = {"left", "right"};
  m.tracks_cartesian_path_length = true;
  m.cartesian_path_length_m = {0.25 * static_cast<double>(tick), 0};
  m.num_objects = 1;
  m.object_name = {"pot"};
  m.slip_count_per_object = {tick >= 3};
  partial.extended.num_stages = 2;
  partial.extended.stage_time_s = {tick >= 2 ? 0.04 : -1, -1};
  partial.extended.num_values = 2;
  partial.extended.name = {"min_clearance_m", "grasp_count.left"};
  partial.extended.unit = {"m", "count"};
  partial.extended.value_mixed = {0.125, static_cast<double>(tick >= 4)};
  return partial;
}

criteria_t Criteria(int64_t tick, double height) {
  criteria_t criteria{};
  criteria.header = Header(tick);
  criteria.success.resize(2);
  criteria.success[0].predicate = "touching";
  criteria.success[0].text = "pot does not touch counter";
  criteria.success[0].holds = tick > 0;
  criteria.success[1].predicate = "height_above";
  criteria.success[1].has_value = true;
  criteria.success[1].value_mixed = height;
  criteria.success[1].threshold_mixed = 1.1;
  criteria.success[1].comparison = ">=";
  criteria.num_success = 2;
  return criteria;
}

// Receives all messages of a tick in the usual order. toucher: the geom that touches the pot.
void Receive(int64_t tick, EpisodeTrack* track, int toucher = kTop) {
  state_t state = State(tick);
  state.body[kPot].position_m[2] = 1 + 0.01 * static_cast<double>(tick);
  track->Receive(state);
  contacts_t contacts = Contacts(tick, {{toucher, kWall}});
  contacts.has_clearance = tick % 2 == 0;
  contacts.clearance_m = 0.5;
  contacts.clearance_robot_geom = kLeftPad;
  contacts.clearance_scene_geom = kTop;
  contacts.clearance_robot_point_m[2] = 0.25;
  track->Receive(contacts);
  track->Receive(Partial(tick));
}

const nlohmann::ordered_json& CurveOf(const BlockReader& block, const std::string& name) {
  for (const auto& curve : block.head()["curves"]) {
    if (curve["name"] == name) return curve;
  }
  throw std::runtime_error("no curve " + name);
}

// Returns the values of all ticks in a block.
std::vector<double> RowOf(const BlockReader& block, const std::string& name, size_t part = 0) {
  const std::vector<size_t> shape = block.Shape("curves");
  const std::vector<double> values = block.Values("curves");
  const size_t row = CurveOf(block, name)["first_row"].get<size_t>() + part;
  return {values.begin() + static_cast<std::ptrdiff_t>(row * shape[1]),
          values.begin() + static_cast<std::ptrdiff_t>((row + 1) * shape[1])};
}

TEST(EpisodeTrack, ABlockHasTheContentsOfTheMessages) {
  EpisodeTrack track = MakeTrack();
  episode_begin_t begin{};
  begin.header = Header(0);
  begin.seed = 17;
  begin.parameter_name = {"pot_x_m"};
  begin.parameter_value_mixed = {0.5};
  begin.num_parameters = 1;
  track.Receive(begin);
  for (int64_t tick = 0; tick < 6; ++tick) Receive(tick, &track);
  // The last tick is not complete, because messages that arrive before the next PARTIAL may still belong to
  // it.
  EXPECT_EQ(track.ticks(), 5);

  const BlockReader block(track.EpisodeBlock());
  EXPECT_EQ(block.head()["run"], 3);
  EXPECT_EQ(block.head()["seed"], 17);
  EXPECT_EQ(block.head()["scene"], "abc");
  EXPECT_EQ(block.head()["tick_s"], 0.02);
  EXPECT_EQ(block.head()["ticks"], 5);
  EXPECT_EQ(block.head()["is_over"], false);
  EXPECT_TRUE(block.head()["success"].is_null());
  EXPECT_EQ(block.head()["bodies"], kMoving);
  EXPECT_EQ(block.head()["parameters"][0], nlohmann::ordered_json::array({"pot_x_m", 0.5}));
  EXPECT_EQ(block.head()["stages"][0]["tick"], 2);
  EXPECT_TRUE(block.head()["stages"][1]["tick"].is_null());

  // The pot is the second of the two bodies, and z is its third row.
  const std::vector<double> position = block.Values("position_m");
  ASSERT_EQ(block.Shape("position_m"), (std::vector<size_t>{2, 3, 5}));
  for (size_t tick = 0; tick < 5; ++tick) {
    EXPECT_NEAR(position[(1 * 3 + 2) * 5 + tick], 1 + 0.01 * static_cast<double>(tick), 1e-5);
    EXPECT_EQ(block.Values("quat")[(1 * 4 + 0) * 5 + tick], 1);
  }
  // Values have displayed units. The clearance is in mm and is missing at odd ticks.
  const std::vector<double> clearance = RowOf(block, "clearance_m");
  EXPECT_EQ(clearance[0], 500);
  EXPECT_TRUE(std::isnan(clearance[1]));
  EXPECT_EQ(CurveOf(block, "clearance_m")["unit"], "mm");
  EXPECT_EQ(RowOf(block, "target_distance"), (std::vector<double>{0.5F, 0.4F, 0.3F, 0.2F, 0.1F}));
  EXPECT_EQ(RowOf(block, "cartesian_path_length", 0), (std::vector<double>{0, 0.25, 0.5, 0.75, 1}));
  EXPECT_EQ(RowOf(block, "gripper_opening", 1), (std::vector<double>(5, 0.5)));
  EXPECT_EQ(RowOf(block, "extended.min_clearance_m")[3], 125);
  EXPECT_EQ(block.Values("clearance_points_m")[2 * 5], 0.25);
  EXPECT_TRUE(std::isnan(block.Values("clearance_points_m")[2 * 5 + 1]));
  EXPECT_EQ(block.Values("clearance_geoms")[0], kLeftPad);
  EXPECT_EQ(block.Values("clearance_geoms")[1], -1);
  // Each tick has one contact, 1 mm deep.
  EXPECT_EQ(block.Values("contact_from"), (std::vector<double>{0, 1, 2, 3, 4, 5}));
  EXPECT_EQ(block.Values("contact_geoms")[0], kTop);
  EXPECT_EQ(block.Values("contact_geoms")[5], kWall);
  EXPECT_FLOAT_EQ(static_cast<float>(block.Values("contact_depth_m")[0]), 1e-3F);
  EXPECT_TRUE(block.Values("missing").empty());
}

TEST(EpisodeTrack, WhatTheSourceDoesNotKnowHasNoCurve) {
  EpisodeTrack track = MakeTrack();
  for (int64_t tick = 0; tick < 3; ++tick) {
    track.Receive(State(tick));
    track.Receive(Contacts(tick));
    partial_metrics_t partial = Partial(tick);
    partial.metrics.tracks_collisions = true;
    partial.metrics.env_collision_count = kUnavailableCount;
    partial.metrics.self_collision_count = 4;
    partial.extended.action_clips = kUnavailableCount;
    partial.metrics.target_distance_m[0] = std::numeric_limits<double>::quiet_NaN();
    track.Receive(partial);
  }
  const BlockReader block(track.EpisodeBlock());
  EXPECT_TRUE(std::isnan(RowOf(block, "env_collision_count")[1]));
  EXPECT_EQ(RowOf(block, "self_collision_count")[1], 4);
  EXPECT_TRUE(std::isnan(RowOf(block, "extended.action_clips")[1]));
  EXPECT_TRUE(std::isnan(RowOf(block, "target_distance")[1]));
}

TEST(EpisodeTrack, CriteriaHoldUntilTheNext) {
  EpisodeTrack track = MakeTrack();
  for (int64_t tick = 0; tick < 6; ++tick) {
    Receive(tick, &track);
    if (tick == 0) track.Receive(Criteria(0, std::numeric_limits<double>::quiet_NaN()));
    if (tick == 3) track.Receive(Criteria(3, 1.25));
  }
  const BlockReader block(track.EpisodeBlock());
  const auto& criteria = block.head()["criteria"];
  ASSERT_EQ(criteria.size(), 2u);
  EXPECT_EQ(criteria[0]["text_first"], "pot does not touch counter");
  EXPECT_FALSE(criteria[0].contains("threshold"));
  EXPECT_EQ(criteria[1]["first_row"], 0);
  EXPECT_EQ(criteria[1]["threshold"], 1.1);
  ASSERT_EQ(block.Shape("criteria"), (std::vector<size_t>{1, 5}));
  EXPECT_TRUE(std::isnan(block.Values("criteria")[2]));
  EXPECT_EQ(block.Values("criteria")[3], 1.25);
  EXPECT_EQ(block.Values("criteria")[4], 1.25);
  const std::vector<double> holds = block.Values("criteria_hold");
  // 2: not known, because the reset state is not evaluated.
  EXPECT_EQ(std::vector<double>(holds.begin(), holds.begin() + 5), (std::vector<double>{2, 2, 2, 1, 1}));
}

TEST(EpisodeTrack, TicksJoinToTheWhole) {
  EpisodeTrack track = MakeTrack();
  std::vector<std::vector<double>> joined;
  const auto rows_of = [](const BlockReader& block, const char* array) {
    const std::vector<size_t> shape = block.Shape(array);
    const std::vector<double> values = block.Values(array);
    std::vector<std::vector<double>> rows;
    for (size_t i = 0; i < values.size(); i += shape.back()) {
      rows.emplace_back(values.begin() + static_cast<std::ptrdiff_t>(i),
                        values.begin() + static_cast<std::ptrdiff_t>(i + shape.back()));
    }
    return rows;
  };
  int64_t sent = 0;
  for (int64_t tick = 0; tick < 20; ++tick) {
    Receive(tick, &track);
    if (track.ticks() < sent + 4) continue;
    const BlockReader block(track.TicksBlock(sent));
    EXPECT_EQ(block.head()["from"], sent);
    const auto rows = rows_of(block, "position_m");
    joined.resize(rows.size());
    for (size_t row = 0; row < rows.size(); ++row) {
      joined[row].insert(joined[row].end(), rows[row].begin(), rows[row].end());
    }
    sent = track.ticks();
  }
  ASSERT_EQ(sent, 16);
  auto whole = rows_of(BlockReader(track.EpisodeBlock()), "position_m");
  for (auto& row : whole) row.resize(16);
  EXPECT_EQ(joined, whole);
}

image_t Image(int64_t tick, const std::string& camera, const std::string& bytes) {
  image_t image{};
  image.header = Header(tick);
  image.view.camera = camera;
  image.view.encoding = "jpeg";
  image.data.assign(bytes.begin(), bytes.end());
  image.num_bytes = static_cast<int32_t>(bytes.size());
  return image;
}

TEST(EpisodeTrack, HasTheImagesOfASourcesCameras) {
  EpisodeTrack track = MakeTrack();
  Receive(0, &track);
  EXPECT_FALSE(BlockReader(track.EpisodeBlock()).Has("image_jpeg"));
  const int layout = track.layout();
  track.Receive(Image(0, "front", "JPEG0"));
  track.Receive(Image(0, "left/wrist", "w"));
  EXPECT_NE(track.layout(), layout) << "the whole episode is given again: it has cameras now";
  for (int64_t tick = 1; tick < 4; ++tick) Receive(tick, &track);
  const int64_t sent = track.ticks();
  track.Receive(Image(3, "front", "JPEG3"));
  for (int64_t tick = 4; tick < 7; ++tick) Receive(tick, &track);
  image_t other = Image(5, "front", "of another episode");
  other.header.episode = 9;
  track.Receive(other);

  const BlockReader all(track.EpisodeBlock());
  EXPECT_EQ(all.head()["image_cameras"], nlohmann::ordered_json({"front", "left/wrist"}));
  EXPECT_EQ(all.Values("image_camera"), (std::vector<double>{0, 1, 0}));
  EXPECT_EQ(all.Values("image_tick"), (std::vector<double>{0, 0, 3}));
  EXPECT_EQ(all.Values("image_from"), (std::vector<double>{0, 5, 6, 11}));
  EXPECT_EQ(all.Raw("image_jpeg"), "JPEG0wJPEG3");
  // The data arrived after its ticks were sent, and is sent with the next ticks.
  const BlockReader ticks(track.TicksBlock(sent));
  EXPECT_EQ(ticks.Raw("image_jpeg"), "JPEG3");
}

TEST(EpisodeTrack, LeavesOutEverySecondImageOfTooManyBytes) {
  EpisodeTrack track(std::make_shared<model_info_t>(Model()), Header(0),
                     {.run = 3, .policy = "expert", .scene = "abc", .bodies = kMoving, .image_bytes = 10});
  Receive(0, &track);
  for (int64_t tick = 0; tick < 32; ++tick) track.Receive(Image(tick, "front", "xx"));
  const BlockReader block(track.EpisodeBlock());
  EXPECT_EQ(block.Values("image_tick"), (std::vector<double>{0, 8, 16, 24}));
}

TEST(EpisodeTrack, TicksThatNeverCame) {
  EpisodeTrack track = MakeTrack();
  // The receiver starts in the middle of the episode and misses a tick.
  for (const int64_t tick : {3, 4, 6, 7, 8}) Receive(tick, &track);
  const BlockReader block(track.EpisodeBlock());
  EXPECT_EQ(block.head()["ticks"], 8);
  EXPECT_EQ(block.Values("missing"), (std::vector<double>{0, 1, 2, 5}));
  const std::vector<double> position = block.Values("position_m");
  const auto z = [&](size_t tick) { return position[(1 * 3 + 2) * 8 + tick]; };
  EXPECT_NEAR(z(0), 1.03, 1e-5);
  EXPECT_NEAR(z(5), 1.04, 1e-5);
  EXPECT_NEAR(z(6), 1.06, 1e-5);
  EXPECT_TRUE(std::isnan(RowOf(block, "target_distance")[5]));
  EXPECT_EQ(block.Values("contact_from")[5], block.Values("contact_from")[6]);
  // A block that contains only new ticks begins with the state before them.
  const BlockReader ticks(track.TicksBlock(5));
  EXPECT_NEAR(ticks.Values("position_m")[(1 * 3 + 2) * 3], 1.04, 1e-5);
  EXPECT_EQ(ticks.Values("missing"), (std::vector<double>{5}));
}

TEST(EpisodeTrack, NothingOfOthersAndNothingThatIsNone) {
  EpisodeTrack track = MakeTrack();
  const std::string empty = track.EpisodeBlock();
  state_t state = State(1, 7);
  track.Receive(state);  // another episode
  state = State(1);
  state.header.attempt = 1;
  track.Receive(state);
  state = State(1);
  state.body[kPot].position_m[0] = std::numeric_limits<double>::quiet_NaN();
  track.Receive(state);
  state.body[kPot].position_m[0] = 1e300;
  track.Receive(state);
  state = State(1);
  state.body.pop_back();
  state.num_bodies = static_cast<int32_t>(state.body.size());
  track.Receive(state);
  contacts_t contacts = Contacts(1, {{kTop, 99}});
  track.Receive(contacts);
  partial_metrics_t partial = Partial(-5);
  track.Receive(partial);
  EXPECT_EQ(track.EpisodeBlock(), empty);
  // If a tick arrives twice, the first one counts.
  Receive(1, &track);
  Receive(2, &track);
  const std::string before = track.EpisodeBlock();
  state = State(1);
  state.body[kPot].position_m[2] = 5;
  track.Receive(state);
  EXPECT_EQ(track.EpisodeBlock(), before);
  // A tick in the far future must not make the memory grow.
  state = State(1);
  state.header.tick = EpisodeTrack::kMaxTicks;
  track.Receive(state);
  const BlockReader block(track.EpisodeBlock());
  EXPECT_EQ(block.head()["is_cut"], true);
  EXPECT_EQ(block.head()["ticks"], 2);
}

TEST(EpisodeTrack, WhatHappened) {
  EpisodeTrack track = MakeTrack();
  for (int64_t tick = 0; tick < 6; ++tick) Receive(tick, &track, tick >= 4 ? kLeftPad : kTop);
  // If the contact returns immediately, it counts as the same contact; after 0.1 s, it counts as a new one.
  for (const int64_t tick : {6, 7, 9, 14}) {
    track.Receive(State(tick));
    track.Receive(Contacts(tick, {{kLeftLink, kTop}}));
    track.Receive(Partial(tick));
  }
  std::vector<std::string> texts;
  for (const TrackEvent& event : track.Events())
    texts.push_back(std::to_string(event.tick) + " " + event.text);
  EXPECT_EQ(texts, (std::vector<std::string>{"2 stage 1: held", "3 pot slips", "4 left grasps pot",
                                             "6 left no longer grips pot", "6 left/link touches counter/top",
                                             "14 left/link touches counter/top"}));

  episode_summary_t summary{};
  summary.header = Header(14);
  summary.end_reason = "time_limit";
  summary.failure_reason = "not_lifted";
  summary.metrics = Partial(14).metrics;
  summary.extended = Partial(14).extended;
  object_event_t slip{.object = "pot", .gripper = "left", .tick = 3, .time_s = 0.06, .duration_s = 0};
  object_event_t grasp{.object = "pot", .gripper = "left", .tick = 4, .time_s = 0.08, .duration_s = 0.06};
  summary.explanation.slip = {slip};
  summary.explanation.grasp = {grasp};
  limit_violation_t violation{};
  violation.region = "top";
  violation.body = "counter/counter";
  violation.robot_body = "left/hand";
  violation.limit = "transient";
  violation.limit_N = 200;
  violation.force_N = 310;
  violation.tick = 5;
  summary.explanation.violation = {violation};
  summary.end_detail = "the arm gave up";
  summary.explanation.text = "not lifted";
  const int layout = track.layout();
  track.Receive(summary);
  EXPECT_NE(track.layout(), layout);
  texts.clear();
  for (const TrackEvent& event : track.Events())
    texts.push_back(std::to_string(event.tick) + " " + event.text);
  EXPECT_EQ(texts, (std::vector<std::string>{
                       "2 stage 1: held", "3 pot slips from left", "4 left grasps pot",
                       "5 top: 310 N by left/hand on counter/counter, transient limit 200 N",
                       "6 left/link touches counter/top", "7 left no longer grips pot",
                       "14 left/link touches counter/top", "14 time limit: not lifted: the arm gave up"}));
  const BlockReader block(track.EpisodeBlock());
  EXPECT_EQ(block.head()["ticks"], 15);
  EXPECT_EQ(block.head()["is_over"], true);
  EXPECT_EQ(block.head()["failure_reason"], "not_lifted");
  EXPECT_EQ(block.head()["end_detail"], "the arm gave up");
  EXPECT_EQ(block.head()["success"], false);
  EXPECT_EQ(block.head()["events"][2]["duration_s"], 0.06);
  EXPECT_EQ(block.head()["events"].back()["kind"], "end");
}

TEST(EpisodeTrack, RotationsKeepTheirSign) {
  EpisodeTrack track = MakeTrack();
  state_t state = State(0);
  const double half = std::sqrt(0.5);
  const double a[4] = {half, half, 0, 0}, b[4] = {-half, -half, 0, 0};
  std::copy(a, a + 4, state.body[kPot].quat_wxyz);
  track.Receive(state);
  state.header = Header(1);
  std::copy(b, b + 4, state.body[kPot].quat_wxyz);
  track.Receive(state);
  episode_end_t end{};
  end.header = Header(1);
  track.Receive(end);
  const std::vector<double> quat = BlockReader(track.EpisodeBlock()).Values("quat");
  EXPECT_NEAR(quat[(1 * 4 + 0) * 2 + 0], half, 2e-5);
  EXPECT_NEAR(quat[(1 * 4 + 0) * 2 + 1], half, 2e-5);
}

}  // namespace evalbus::viz::episode_track_test
