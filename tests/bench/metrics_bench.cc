// Measures the cost of scoring a tick: the metric step alone (limit: 1 microsecond), and the step followed by
// reading all values. Also measures the cost of scoring a step of a file, compared with the JSON library's
// parsing of the same bytes.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "lcmtypes/metric_catalog.h"
#include "metrics/episode/rollout_metrics.h"
#include "metrics/episode/score_file.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus {
namespace {

constexpr int kSteps = 1000;
constexpr int kJoints = 7;
constexpr double kDt = 0.02;
// Geoms 0 to 9 are the scene, 10 to 49 the robots, and 50 to 59 the pot.
constexpr int kGeoms = 60;

// Two 7-joint arms move smoothly, with 30 contacts, which is as many as when lifting a pot.
struct Episode {
  struct ArmData {
    std::array<double, kJoints> q, w;
  };
  std::vector<std::array<ArmData, 2>> data{kSteps};
  std::vector<std::array<metrics::ArmSample, 2>> arms{kSteps};
  std::vector<double> opening = {0.4, 0.4};
  std::vector<uint8_t> held = {1, 1};
  std::vector<metrics::GeomContact> contacts;
  std::vector<metrics::Sample> samples;

  Episode() {
    for (int k = 0; k < 30; ++k) {
      contacts.push_back({k % 3 == 0 ? k % 10 : 10 + k, 50 + k % 10, -1e-4});  // robot on pot, pot on scene
    }
    contacts[4] = {3, 15, -1e-4};  // robot on scene
    contacts[5] = {12, 31, -1e-4};
    for (int i = 0; i < kSteps; ++i) {
      const double t = i * kDt;
      for (int k = 0; k < 2; ++k) {
        ArmData& d = data[i][k];
        for (int j = 0; j < kJoints; ++j) {
          d.q[j] = 0.3 * std::sin(t + j + k);
          d.w[j] = 0.3 * std::cos(t + j + k);
        }
        arms[i][k] = {d.q,
                      d.w,
                      {0.1 * std::sin(t + k), 0.2 * k, 0.1 * std::cos(t + k)},
                      {std::cos(t / 4), 0, std::sin(t / 4), 0},
                      5 * t};
      }
      samples.push_back({.tick = i + 1,
                         .time = (i + 1) * kDt,
                         .arm = arms[i],
                         .gripper_opening = opening,
                         .holding = held,
                         .pinched = held,
                         .contacts = contacts,
                         .clearance = 0.1});
    }
  }
};

metrics::MetricsConfig Config() {
  metrics::MetricsConfig config;
  for (const char* name : {"left", "right"}) {
    config.arms.push_back({.name = name,
                           .num_joints = kJoints,
                           .joint_lower = std::vector<double>(kJoints, -2),
                           .joint_upper = std::vector<double>(kJoints, 2)});
  }
  config.grippers = {"left", "right"};
  config.objects = {"pot"};
  config.control_dt = kDt;
  config.slip_sample_window = 1;
  config.geom_owner.assign(kGeoms, metrics::GeomOwner::kScene);
  std::fill(config.geom_owner.begin() + 10, config.geom_owner.begin() + 50, metrics::GeomOwner::kRobot);
  std::fill(config.geom_owner.begin() + 50, config.geom_owner.end(), metrics::GeomOwner::kObject);
  for (int k = 1; k <= 4; ++k) config.stages.push_back({.index = k, .name = "stage"});
  config.target_distances = {"lift", "left", "right"};
  config.pose_errors = {""};
  return config;
}

// Compares the metrics with the episode's values in closed form. Returns the name of a wrong metric, or
// nullptr.
const char* Wrong(const metrics::RolloutMetrics& metrics) {
  metric_values_t v{};
  metrics.Values(&v);
  // The path consists of chords of a circle of radius 0.1, each rotated by dt. The pose rotates by dt / 2.
  const double path = (kSteps - 1) * 2 * 0.1 * std::sin(kDt / 2);
  const double jerk = 0.1 * std::pow(2 * std::sin(kDt / 2), 3) / std::pow(kDt, 3);
  for (int k = 0; k < 2; ++k) {
    if (std::abs(v.cartesian_path_length_m[k] - path) > 1e-9) return "cartesian path";
    if (std::abs(v.orientation_path_length_rad[k] - (kSteps - 1) * kDt / 2) > 1e-9) return "orientation path";
    if (std::abs(v.avg_cartesian_jerk_mps3[k] - jerk) > 1e-7) return "jerk";
  }
  if (v.num_jerk_samples != kSteps - 3) return "jerk samples";
  if (std::abs(v.bimanual_gripper_vertical_difference_m) < 1e-3) return "vertical difference";
  if (v.env_collision_count != 1 || v.self_collision_count != 1 || v.slip_count != 0) return "counts";
  return nullptr;
}

void MetricStep(benchmark::State& state) {
  const Episode episode;
  metrics::RolloutMetrics metrics(Config());
  std::vector<double> times;
  for (auto _ : state) {
    metrics.Start(episode.opening, episode.held);
    const auto begin = std::chrono::steady_clock::now();
    for (const metrics::Sample& sample : episode.samples) metrics.Step(sample);
    const std::chrono::duration<double> time = std::chrono::steady_clock::now() - begin;
    times.push_back(time.count() / kSteps);
    state.SetIterationTime(time.count());
  }
  if (const char* wrong = Wrong(metrics)) state.SkipWithError(wrong);
  std::sort(times.begin(), times.end());
  state.counters["p50_us"] = times[times.size() / 2] * 1e6;
  state.counters["limit_us"] = 1;
}
BENCHMARK(MetricStep)->UseManualTime()->Unit(benchmark::kMicrosecond);

void MetricStepAndLiveValues(benchmark::State& state) {
  const Episode episode;
  metrics::RolloutMetrics metrics(Config());
  metric_values_t values{};
  std::vector<double> extended;
  std::vector<double> times;
  for (auto _ : state) {
    metrics.Start(episode.opening, episode.held);
    const auto begin = std::chrono::steady_clock::now();
    for (const metrics::Sample& sample : episode.samples) {
      metrics.Step(sample);
      metrics.Values(&values);
      metrics.extended().Values(&extended);
    }
    const std::chrono::duration<double> time = std::chrono::steady_clock::now() - begin;
    times.push_back(time.count() / kSteps);
    state.SetIterationTime(time.count());
  }
  if (const char* wrong = Wrong(metrics)) state.SkipWithError(wrong);
  std::sort(times.begin(), times.end());
  state.counters["p50_us"] = times[times.size() / 2] * 1e6;
}
BENCHMARK(MetricStepAndLiveValues)->UseManualTime()->Unit(benchmark::kMicrosecond);

// Returns the episode as `evalbus score` reads it, with all digits of every number.
std::string EpisodeText() {
  using nlohmann::json;
  const Episode episode;
  json text = {
      {"robot", {{"arms", {"left", "right"}}, {"dof", kJoints}}},
      {"control_frequency", 1 / kDt},
      {"control_dt", kDt},
      {"config", {{"slip_sample_window", 1}, {"slip_objects", {"pot"}}}},
      {"geoms",
       {{"count", kGeoms}, {"robot", json::array()}, {"scene", json::array()}, {"ignored", json::array()}}},
      {"steps", json::array()},
      {"stages", json::array()},
      {"finalize", {{"success", true}, {"target_distance", nullptr}, {"pose_error", nullptr}}}};
  for (const TrackOption& option : TrackOptions()) text["config"][std::string(option.key)] = true;
  for (int geom = 0; geom < kGeoms; ++geom) {
    text["geoms"][geom < 10 ? "scene" : geom < 50 ? "robot" : "ignored"].push_back(geom);
  }
  const json gripper = {{"gripper_opening", 0.4}, {"holding", {{"pot", true}}}};
  text["initial"] = {{"left", gripper}, {"right", gripper}};
  for (const metrics::Sample& sample : episode.samples) {
    json step = {{"t", sample.time}, {"left", gripper}, {"right", gripper}, {"contacts", json::array()}};
    for (int k = 0; k < 2; ++k) {
      json& arm = step[k == 0 ? "left" : "right"];
      arm["joint_position"] =
          std::vector(sample.arm[k].joint_position.begin(), sample.arm[k].joint_position.end());
      arm["joint_velocity"] =
          std::vector(sample.arm[k].joint_velocity.begin(), sample.arm[k].joint_velocity.end());
      arm["wrist_position"] = sample.arm[k].wrist_position;
      arm["wrist_quaternion"] = sample.arm[k].wrist_quat;
    }
    text["steps"].push_back(step);
  }
  return text.dump();
}

void FileStep(benchmark::State& state) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "episode.json";
  const std::string text = EpisodeText();
  std::ofstream(file) << text;
  nlohmann::ordered_json result;
  for (auto _ : state) result = metrics::ScoreFile(file);
  const double path = (kSteps - 1) * 2 * 0.1 * std::sin(kDt / 2);
  if (!(std::abs(result["cartesian_path_length"]["left"].get<double>() - path) < 1e-9)) {
    state.SkipWithError("cartesian path");
  }
  state.SetItemsProcessed(state.iterations() * kSteps);
  state.SetBytesProcessed(state.iterations() * static_cast<int64_t>(text.size()));
}
BENCHMARK(FileStep)->Unit(benchmark::kMicrosecond);

void FileStepBareParsing(benchmark::State& state) {
  const std::string text = EpisodeText();
  for (auto _ : state) {
    if (!nlohmann::json::accept(text)) state.SkipWithError("no JSON");
  }
  state.SetItemsProcessed(state.iterations() * kSteps);
  state.SetBytesProcessed(state.iterations() * static_cast<int64_t>(text.size()));
}
BENCHMARK(FileStepBareParsing)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace evalbus

BENCHMARK_MAIN();
