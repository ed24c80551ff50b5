// Compares the data that a page receives during an episode with the data from the episode's log.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <chrono>
#include <cmath>
#include <filesystem>

#include "base/run_layout.h"
#include "bus/channels.h"
#include "report/episode_tracks.h"
#include "tests/deadline.h"
#include "tests/unit/runner/in_process_run.h"
#include "tests/unit/temporary_folder.h"
#include "viz/viewer/block.h"

namespace evalbus::runner::live_track_test {

// Returns the angle between two rotations, rad.
double Angle(const double* a, const double* b) {
  const Eigen::Quaterniond p(a[0], a[1], a[2], a[3]), q(b[0], b[1], b[2], b[3]);
  return p.normalized().angularDistance(q.normalized());
}

TEST(LiveTrack, IsThatOfTheLogAndShowsTheStates) {
  TemporaryFolder folder;
  const std::filesystem::path out = folder.path() / "run";
  InProcessRun run("lift_pot/position", out);
  Bus& bus = run.bus();

  report::Scenes scenes;
  std::unique_ptr<viz::EpisodeTrack> track;
  std::shared_ptr<model_info_t> model;
  std::vector<state_t> states;
  int said = 0, of_criteria = 0;
  bus.Subscribe(channels::kModel, [&](const model_info_t& m) { model = std::make_shared<model_info_t>(m); });
  bus.Subscribe(channels::kEpisodeBegin, [&](const episode_begin_t& m) {
    if (track) return;
    const viz::SceneBlocks& scene = scenes.Of(*model, out);
    track = std::make_unique<viz::EpisodeTrack>(
        model, m.header,
        viz::EpisodeTrack::About{
            .run = 0, .policy = "expert", .scene = scene.id(), .bodies = scene.moving_bodies()});
    track->Receive(m, scene.Appearance(m.seed));
  });
  bus.Subscribe(channels::kState, [&](const state_t& m) {
    track->Receive(m);
    if (m.header.tick == static_cast<int64_t>(states.size())) states.push_back(m);
  });
  bus.Subscribe(channels::kContacts, [&](const contacts_t& m) { track->Receive(m); });
  bus.Subscribe(channels::kPartial, [&](const partial_metrics_t& m) {
    track->Receive(m);
    ++said;
  });
  bus.Subscribe(channels::kCriteria, [&](const criteria_t& m) {
    track->Receive(m);
    ++of_criteria;
  });
  bus.Subscribe(channels::kEpisodeEnd, [&](const episode_end_t& m) { track->Receive(m); });
  bus.Subscribe(channels::kEpisodeSummary, [&](const episode_summary_t& m) { track->Receive(m); });

  run.Start();
  const std::filesystem::path log = EpisodeLog(out, 0);
  const auto deadline = std::chrono::steady_clock::now() + kDeadline;
  while (!(track && track->summary() && std::filesystem::exists(log)) &&
         std::chrono::steady_clock::now() < deadline) {
    bus.Handle(std::chrono::steady_clock::now() + std::chrono::milliseconds(5));
    for (const auto& component : run.components()) component->Poll(std::chrono::steady_clock::now());
  }
  ASSERT_TRUE(track && track->summary());
  ASSERT_TRUE(std::filesystem::exists(log));
  ASSERT_GT(states.size(), 100u);
  // There are 50 ticks per second, but the conditions are published at most 20 times per second.
  EXPECT_GT(of_criteria, said / 4);
  EXPECT_LT(of_criteria, said / 2);

  const std::string live = track->EpisodeBlock();
  const auto recorded =
      report::TrackEpisode(log, {.run = 0, .policy = "expert", .scene = {}, .bodies = {}}, &scenes);
  EXPECT_EQ(live, recorded->EpisodeBlock());

  const viz::BlockReader block(live);
  const std::vector<double> position = block.Values("position_m"), quat = block.Values("quat");
  const auto bodies = block.head()["bodies"].get<std::vector<int>>();
  const size_t n = states.size();
  ASSERT_EQ(block.Shape("position_m"), (std::vector<size_t>{bodies.size(), 3, n}));
  double worst = 0, worst_angle = 0;
  for (size_t tick = 0; tick < n; ++tick) {
    for (size_t i = 0; i < bodies.size(); ++i) {
      const body_pose_t& body = states[tick].body[static_cast<size_t>(bodies[i])];
      Eigen::Vector3d shown;
      double turned[4];
      for (size_t k = 0; k < 3; ++k) shown[static_cast<int>(k)] = position[(i * 3 + k) * n + tick];
      for (size_t k = 0; k < 4; ++k) turned[k] = quat[(i * 4 + k) * n + tick];
      worst = std::max(worst, (shown - Eigen::Map<const Eigen::Vector3d>(body.position_m)).norm());
      worst_angle = std::max(worst_angle, Angle(turned, body.quat_wxyz));
    }
  }
  EXPECT_LT(worst, 2e-5);
  EXPECT_LT(worst_angle, 1e-4);
  EXPECT_GT(worst, 1e-6) << "as if nothing were rounded";
  // Compares the distance between a clearance's two points with its curve, which is in mm.
  size_t clearance_row = 0;
  for (const auto& curve : block.head()["curves"]) {
    if (curve["name"] == "clearance_m") clearance_row = curve["first_row"];
  }
  const std::vector<double> curves = block.Values("curves"), points = block.Values("clearance_points_m");
  int measured = 0;
  for (size_t tick = 0; tick < n; ++tick) {
    const double clearance = curves[clearance_row * n + tick] * 1e-3;
    if (std::isnan(clearance)) continue;
    Eigen::Vector3d between;
    for (size_t k = 0; k < 3; ++k) {
      between[static_cast<int>(k)] = points[(3 + k) * n + tick] - points[k * n + tick];
    }
    EXPECT_NEAR(between.norm(), std::max(0.0, clearance), 1e-6);
    ++measured;
  }
  EXPECT_GT(measured, 20);
  // Bodies that do not move must also have their pose from STATE.
  const viz::BlockReader scene(*scenes.FindBlock(block.head()["scene"].get<std::string>()));
  for (size_t i = 0; i < states[0].body.size(); ++i) {
    const auto& body = scene.head()["bodies"][i];
    if (body["moves"]) continue;
    for (size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(body["position_m"][k].get<double>(), states[0].body[i].position_m[k], 1e-9) << i;
    }
    EXPECT_LT(Angle(body["quat_wxyz"].get<std::vector<double>>().data(), states[0].body[i].quat_wxyz), 1e-6);
  }
}

}  // namespace evalbus::runner::live_track_test
