// If the source does not provide the inputs of a metric, the score omits it. It is neither zero nor a
// failure.
#include "metrics/episode/metric_availability.h"

#include <gtest/gtest.h>

#include <set>

#include "lcmtypes/end_reason.h"
#include "lcmtypes/metric_catalog.h"
#include "metrics/episode/episode_scorer.h"
#include "metrics/episode/result_json.h"
#include "tests/unit/small_world.h"

namespace evalbus::metrics::metric_availability_test {

using namespace small_world;

// The pot is held at tick 1, released at tick 2 and lifted (success) at tick 3, when a link touches the
// counter.
episode_summary_t ScoreOf(const model_info_t& model, const std::string& yaml = kTask) {
  EpisodeScorer scorer(model, ParseTask(yaml, "small.yaml", false));
  scorer.Start();
  scorer.Tick(State(0), Contacts(0));
  scorer.Tick(State(1), Contacts(1, {{kLeftPad, kWall}, {kTop, kWall}}));
  scorer.Tick(State(2), Contacts(2, {{kTop, kWall}}));
  state_t lifted = State(3);
  lifted.body[kPot].position_m[2] = 1.25;
  lifted.action_clips = 4;
  contacts_t contacts = Contacts(3, {{kLeftLink, kTop}});
  contacts.has_clearance = true;
  contacts.clearance_m = 0.1;
  scorer.Tick(lifted, contacts);
  episode_end_t end{};
  end.header = Header(3);
  end.end_reason = end_reason::kEndOfData;
  return scorer.Summary({}, end);
}

std::set<std::string> Keys(const nlohmann::ordered_json& json) {
  std::set<std::string> keys;
  for (const auto& [key, value] : json.items()) keys.insert(key);
  return keys;
}

// Returns the keys of `more` that are missing in `less`.
std::set<std::string> Lacks(const nlohmann::ordered_json& less, const nlohmann::ordered_json& more) {
  std::set<std::string> lacking;
  const std::set<std::string> has = Keys(less), had = Keys(more);
  std::ranges::set_difference(had, has, std::inserter(lacking, lacking.end()));
  return lacking;
}

TEST(MetricAvailability, WithoutPhysicsOnlyWhatItKnowsIsAbsent) {
  model_info_t model = Model();
  const episode_summary_t all = ScoreOf(model);
  model.has_physics = model.has_velocity = false;
  const episode_summary_t kinematic = ScoreOf(model);
  EXPECT_EQ(ResultJson(kinematic.metrics), ResultJson(all.metrics));
  EXPECT_EQ(
      Lacks(ExtendedJson(kinematic.extended, kinematic.metrics), ExtendedJson(all.extended, all.metrics)),
      (std::set<std::string>{"mechanical_work_J", "action_clips", "deadline_misses", "unreachable_poses",
                             "singular_poses", "grip_force_mean_N", "grip_force_peak_N",
                             "min_joint_torque_margin", "p95_object_force_N", "p95_scene_force_N",
                             "p95_self_force_N", "peak_object_force_N", "peak_scene_force_N",
                             "peak_self_force_N", "peak_touch_energy_J", "unwanted_impulse_Ns",
                             "tracking_error_rad", "command_log_dimensionless_jerk"}));
  EXPECT_EQ(kinematic.verdict, partial_metrics_t::SUCCESS);
}

TEST(MetricAvailability, WithoutTheObjectNothingIsJudged) {
  model_info_t model = Model();
  const episode_summary_t all = ScoreOf(model);
  model.object_is_tracked = {0};
  const episode_summary_t blind = ScoreOf(model);
  EXPECT_EQ(blind.verdict, partial_metrics_t::UNDECIDED);
  EXPECT_EQ(blind.failure_reason, "not_judged");
  EXPECT_TRUE(blind.complete);
  EXPECT_TRUE(blind.explanation.condition.empty());
  EXPECT_TRUE(blind.explanation.grasp.empty());
  EXPECT_NE(blind.explanation.text.find("cannot be determined"), std::string::npos) << blind.explanation.text;
  EXPECT_TRUE(blind.cause.text.starts_with("Not judged at ")) << blind.cause.text;
  EXPECT_EQ(blind.cause.text.find("stage"), std::string::npos) << blind.cause.text;
  const auto metrics = ResultJson(blind.metrics);
  EXPECT_EQ(Lacks(metrics, ResultJson(all.metrics)),
            (std::set<std::string>{"task_stage_reached", "subtask_progress", "target_distance",
                                   "object_pose_error", "slip_count", "slip_count_per_object"}));
  // The contacts of the pads with the pot are missing, but the link's contact with the counter is present.
  EXPECT_EQ(metrics["env_collision_count"], 1);
  EXPECT_EQ(Lacks(ExtendedJson(blind.extended, blind.metrics), ExtendedJson(all.extended, all.metrics)),
            (std::set<std::string>{"first_touch_s", "grasp_count", "grasp_time_s", "longest_grasp_s",
                                   "regrasp_count", "peak_penetration_m", "stage_time_s"}));
}

TEST(MetricAvailability, AFailureThatCanBeJudgedIsOneAndSuccessThenNeedsBoth) {
  const std::string kFailure = "failure: {touching: {a: pot, b: world}}";
  std::string yaml = kTask;
  yaml.replace(yaml.find(kFailure), kFailure.size(), "failure: {touching: {a: left, b: counter}}");
  model_info_t model = Model();
  model.task_yaml = yaml;
  model.object_is_tracked = {0};
  EXPECT_EQ(ScoreOf(model, yaml).verdict, partial_metrics_t::FAILURE);
  // Success does not depend on the pot, but failure does. Failure takes precedence, so no success can be
  // determined.
  yaml = kTask;
  const size_t success = yaml.find("success:"), failure = yaml.find("failure:");
  yaml.replace(success, failure - success, "success: {touching: {a: left, b: counter}}\n");
  EXPECT_EQ(ScoreOf(Model(), yaml).failure_reason, "");
  EXPECT_EQ(ScoreOf(model, yaml).failure_reason, "not_judged");
}

TEST(MetricAvailability, FixturesThatMustNotBeTouchedAreLackingInCollisions) {
  model_info_t model = Model();
  model.forbidden_contact_geom = {kLidGeom};
  model.num_forbidden_contact_geoms = 1;
  model.object_is_tracked = {0};
  const episode_summary_t blind = ScoreOf(model);
  EXPECT_FALSE(ResultJson(blind.metrics).contains("env_collision_count"));
  EXPECT_TRUE(ResultJson(blind.metrics).contains("self_collision_count"));
  const auto extended = ExtendedJson(blind.extended, blind.metrics);
  for (const char* name :
       {"min_clearance_m", "min_clearance_time_s", "contact_time_s", "env_collision_events"}) {
    EXPECT_FALSE(extended.contains(name)) << name;
  }
}

// A source publishes the poses of manipulated objects only, so it is unknown where a part is that a variation
// places.
TEST(MetricAvailability, PartsThatASourceCannotLocateAreLackingInCollisions) {
  std::string yaml = kTask;
  const std::string kVariations = "variations: {base: {}}";
  yaml.replace(yaml.find(kVariations), kVariations.size(),
               "variations: {base: {}, turned: {randomize: [{spawn_yaw: {object: counter, bound_deg: 9}}]}}");
  model_info_t model = Model();
  const episode_summary_t simulated = ScoreOf(model, yaml);
  EXPECT_EQ(ResultJson(simulated.metrics)["env_collision_count"], 1);
  EXPECT_EQ(simulated.verdict, partial_metrics_t::SUCCESS);
  model.has_physics = false;
  const episode_summary_t measured = ScoreOf(model, yaml);
  EXPECT_FALSE(ResultJson(measured.metrics).contains("env_collision_count"));
  EXPECT_TRUE(ResultJson(measured.metrics).contains("slip_count"));
  const auto extended = ExtendedJson(measured.extended, measured.metrics);
  EXPECT_FALSE(extended.contains("min_clearance_m"));
  EXPECT_TRUE(extended.contains("grasp_count"));
  // Success requires that the pot does not touch the counter.
  EXPECT_EQ(measured.failure_reason, "not_judged");
  EXPECT_TRUE(ResultJson(ScoreOf(model).metrics).contains("env_collision_count")) << "the counter is fixed";
}

TEST(MetricAvailability, RatesAreOfJudgedEpisodes) {
  model_info_t model = Model();
  RunStatistics statistics;
  statistics.Add(0, ResultOf({}, ScoreOf(model)));
  model.object_is_tracked = {0};
  RunStatistics blind;
  blind.Add(0, ResultOf({}, ScoreOf(model)));
  statistics.Add(1, ResultOf({}, ScoreOf(model)));
  EXPECT_EQ(statistics.Summary(false).complete, 2);
  EXPECT_EQ(statistics.Summary(false).judged, 1);
  EXPECT_EQ(statistics.Summary(false).success_rate, 1);
  EXPECT_TRUE(std::isnan(blind.Summary(false).success_rate));
  EXPECT_EQ(SummaryJson("small", "base", blind.Summary(false))["slips_per_object"].size(), 0u);
}

}  // namespace evalbus::metrics::metric_availability_test
