// Tests force metrics and force limits with STATEs that were written by hand. A tick lasts 0.02 s.
#include <gtest/gtest.h>

#include <cmath>

#include "base/errors.h"
#include "evalbus/contact_force_t.hpp"
#include "lcmtypes/extended_value.h"
#include "metrics/episode/episode_scorer.h"
#include "metrics/episode/result_json.h"
#include "tests/unit/small_world.h"

namespace evalbus::metrics::force_metrics_test {

using namespace small_world;

contact_force_t Force(int8_t kind, int a, int b, double peak, double mean = 0, double energy = 0) {
  contact_force_t force{};
  force.kind = kind;
  force.body_a = a;
  force.body_b = b;
  force.peak_force_N = peak;
  force.mean_force_N = mean;
  force.touch_energy_J = energy;
  return force;
}

void Press(state_t* state, const std::vector<contact_force_t>& forces) {
  state->contact_force = forces;
  state->num_contact_forces = static_cast<int32_t>(forces.size());
}

class ForceMetrics : public testing::Test {
 protected:
  explicit ForceMetrics(const std::string& limits = "") {
    model_info_t model = Model();
    model.limits_yaml = limits;
    model.limits_file = "limits.yaml";
    dut_ = std::make_unique<EpisodeScorer>(model, ParseTask(kTask, "small.yaml", false));
    dut_->Start();
    dut_->Tick(State(0), Contacts(0));
  }
  void Tick(const state_t& state) { dut_->Tick(state, Contacts(state.header.tick)); }
  episode_summary_t Summary(int64_t last_tick) {
    episode_end_t end{};
    end.header = Header(last_tick);
    end.end_reason = "time_limit";
    return dut_->Summary({}, end);
  }
  std::unique_ptr<EpisodeScorer> dut_;
};

// The forces that the sim sums up in a tick are read as metrics.
TEST_F(ForceMetrics, AreThoseOfTheTicks) {
  state_t first = State(1);
  first.scene_force_N = {10, 30};
  first.object_force_N = {5};
  Press(&first, {Force(contact_force_t::SCENE, kLeftHand, kCounter, 30, 2, 0.5),
                 Force(contact_force_t::SELF, kLeftHand, kRightHand, 4, 1, 0.75),
                 Force(contact_force_t::OBJECT, kLeftHand, kPot, 5, 7, 9),
                 Force(contact_force_t::OTHER, kCounter, kPot, 100, 100, 100)});
  first.gripper[0].grip_force_peak_N = 12;
  first.gripper[0].grip_force_mean_N = 6;
  first.gripper[0].grip_time_s = 0.01;
  first.arm[0].joint_torque_peak_Nm = {43.5};
  first.arm[0].joint_command_rad = {0.3};
  Tick(first);
  state_t second = State(2);
  second.scene_force_N = {20};
  second.self_force_N = {8};
  Press(&second, {Force(contact_force_t::SCENE, kLeftHand, kCounter, 20, 4)});
  second.gripper[0].grip_force_peak_N = 20;
  second.gripper[0].grip_force_mean_N = 10;
  second.gripper[0].grip_time_s = 0.02;
  second.arm[0].joint_velocity_radps = {0.5};
  second.arm[0].joint_command_rad = {-0.4};
  Tick(second);
  const extended_metrics_t live = [&] {
    partial_metrics_t partial{};
    dut_->Partial(&partial);
    return partial.extended;
  }();
  EXPECT_EQ(ExtendedValue(live, "peak_scene_force_N"), 30);
  EXPECT_TRUE(std::isnan(ExtendedValue(live, "p95_scene_force_N"))) << "known at the end only";

  const extended_metrics_t e = Summary(2).extended;
  EXPECT_EQ(ExtendedValue(e, "peak_scene_force_N"), 30);
  EXPECT_NEAR(ExtendedValue(e, "p95_scene_force_N"), 20 + 0.9 * 10, 1e-12);  // of 10, 20, 30
  EXPECT_EQ(ExtendedValue(e, "peak_object_force_N"), 5);
  EXPECT_EQ(ExtendedValue(e, "p95_object_force_N"), 5);
  EXPECT_EQ(ExtendedValue(e, "peak_self_force_N"), 8);
  EXPECT_NEAR(ExtendedValue(e, "unwanted_impulse_Ns"), (2 + 1 + 4) * 0.02, 1e-12);
  EXPECT_EQ(ExtendedValue(e, "peak_touch_energy_J"), 0.75);
  EXPECT_NEAR(ExtendedValue(e, "grip_force_mean_N.left"), (6 + 10) * 0.02 / 0.03, 1e-12);
  EXPECT_EQ(ExtendedValue(e, "grip_force_peak_N.left"), 20);
  EXPECT_TRUE(std::isnan(ExtendedValue(e, "grip_force_mean_N.right")));
  EXPECT_TRUE(std::isnan(ExtendedValue(e, "grip_force_peak_N.right")));
  EXPECT_EQ(ExtendedValue(e, "min_joint_torque_margin"), 0.5);  // 43.5 N m remain of 87 N m
  EXPECT_NEAR(ExtendedValue(e, "tracking_error_rad.left"), std::sqrt((0.09 + 0.16) / 2), 1e-12);
  EXPECT_EQ(ExtendedValue(e, "tracking_error_rad.right"), 0);
  EXPECT_EQ(ExtendedValue(e, "idle_time_s.left"), 0.02);
  EXPECT_EQ(ExtendedValue(e, "idle_time_s.right"), 0.04);
  EXPECT_TRUE(std::isnan(ExtendedValue(e, "limit_violations"))) << "without limits";
  EXPECT_TRUE(std::isnan(ExtendedValue(e, "squeeze_excess_N"))) << "without limits";
}

TEST_F(ForceMetrics, WithoutContactThePeaksAreZeroAndThePercentilesAbsent) {
  Tick(State(1));
  const extended_metrics_t e = Summary(1).extended;
  for (const char* where : {"scene", "object", "self"}) {
    EXPECT_EQ(ExtendedValue(e, std::string("peak_") + where + "_force_N"), 0) << where;
    EXPECT_TRUE(std::isnan(ExtendedValue(e, std::string("p95_") + where + "_force_N"))) << where;
  }
  EXPECT_EQ(ExtendedValue(e, "unwanted_impulse_Ns"), 0);
  EXPECT_EQ(ExtendedValue(e, "peak_touch_energy_J"), 0);
}

TEST_F(ForceMetrics, ATickWithAForceThatIsNoNumberIsRefused) {
  for (const auto spoil : {+[](state_t* s) { s->scene_force_N = {NAN}; },
                           +[](state_t* s) { s->gripper[1].grip_force_mean_N = INFINITY; },
                           +[](state_t* s) { s->arm[0].joint_command_rad = {NAN}; },
                           +[](state_t* s) { Press(s, {Force(contact_force_t::SELF, 1, 3, 1, NAN)}); }}) {
    dut_->Start();
    dut_->Tick(State(0), Contacts(0));
    state_t state = State(1);
    spoil(&state);
    Tick(state);
    EXPECT_EQ(dut_->refused_samples(), 1);
    EXPECT_FALSE(Summary(1).complete);
  }
}

class ForceLimits : public ForceMetrics {
 protected:
  // The first two ticks of a contact are transient.
  ForceLimits()
      : ForceMetrics(
            "limits:\n"
            "  counter: {bodies: [counter], quasi_static_force_N: 50, transient_force_N: 100, "
            "transient_s: 0.04}\n"
            "  hands: {bodies: [left/hand, right/hand], quasi_static_force_N: 9, transient_force_N: 9}\n") {}

  // Plays ticks in which the left base presses on the counter with these forces, N. 0 means no contact.
  void PressOnCounter(const std::vector<double>& forces) {
    for (const double force : forces) {
      state_t state = State(++tick_);
      if (force > 0) Press(&state, {Force(contact_force_t::SCENE, kLeftBase, kCounter, force)});
      Tick(state);
    }
  }
  std::vector<limit_violation_t> Violations() { return Summary(tick_).explanation.violation; }
  int64_t tick_ = 0;
};

TEST_F(ForceLimits, AContactIsTransientAtFirstAndQuasiStaticLater) {
  PressOnCounter({90, 100, 50, 50});
  EXPECT_TRUE(Violations().empty()) << "a force at its limit";
  PressOnCounter({51, 70, 60});
  const auto violations = Violations();
  ASSERT_EQ(violations.size(), 1u);
  EXPECT_EQ(violations[0].region, "counter");
  EXPECT_EQ(violations[0].body, "counter/counter");
  EXPECT_EQ(violations[0].robot_body, "left/base");
  EXPECT_EQ(violations[0].limit, "quasi_static");
  EXPECT_EQ(violations[0].limit_N, 50);
  EXPECT_EQ(violations[0].force_N, 70);
  EXPECT_EQ(violations[0].tick, 5);
  EXPECT_EQ(violations[0].time_s, 0.1);
  const episode_summary_t summary = Summary(tick_);
  EXPECT_EQ(ExtendedValue(summary.extended, "limit_violations"), 1);
  EXPECT_NE(summary.explanation.text.find("; 1 violation of force limits, first at 0.10 s, counter: 70 N by "
                                          "left/base on counter/counter, quasi-static limit 50 N"),
            std::string::npos)
      << summary.explanation.text;
  EXPECT_EQ(ExplanationJson(summary.explanation)["limit_violations"].dump(),
            R"([{"region":"counter","body":"counter/counter","robot_body":"left/base",)"
            R"("limit":"quasi_static","limit_N":50.0,"force_N":70.0,"tick":5,"time_s":0.1}])");
}

TEST_F(ForceLimits, AnInterruptionOfATenthOfASecondBeginsANewContact) {
  PressOnCounter({120, 120, 0, 0, 0, 0, 60});  // after 0.08 s it continues and is quasi-static
  ASSERT_EQ(Violations().size(), 2u);
  EXPECT_EQ(Violations()[0].limit, "transient");
  EXPECT_EQ(Violations()[1].limit, "quasi_static");
  PressOnCounter({0, 0, 0, 0, 0, 60});  // after 0.1 s a new, transient contact begins
  EXPECT_EQ(Violations().size(), 2u);
  PressOnCounter({101});
  ASSERT_EQ(Violations().size(), 3u);
  EXPECT_EQ(Violations()[2].limit, "transient");
}

TEST_F(ForceLimits, APairThatIsListedWithoutForceIsNoContact) {
  PressOnCounter({120, 120});
  state_t parted = State(++tick_);
  Press(&parted, {Force(contact_force_t::SCENE, kLeftBase, kCounter, 0)});
  Tick(parted);
  PressOnCounter({0, 0, 0, 0, 101});  // after 0.1 s a new, transient contact begins
  ASSERT_EQ(Violations().size(), 2u);
  EXPECT_EQ(Violations()[1].limit, "transient");
}

TEST_F(ForceLimits, ConcernTheRobotOnly) {
  state_t state = State(++tick_);
  Press(&state, {Force(contact_force_t::OTHER, kCounter, kPot, 1000),
                 Force(contact_force_t::SELF, kLeftHand, kRightHand, 10)});
  Tick(state);
  // Each hand is a body of the region and is pressed by the other one.
  ASSERT_EQ(Violations().size(), 2u);
  EXPECT_EQ(Violations()[0].body, "left/hand");
  EXPECT_EQ(Violations()[1].body, "right/hand");
}

class SqueezeLimits : public ForceMetrics {
 protected:
  SqueezeLimits() : ForceMetrics("limits:\n  egg: {bodies: [pot], grip_force_N: 10}\n") {}

  // Plays ticks in which the left gripper grips the pot with these peak forces, N. 0 means no grip.
  void Grip(const std::vector<double>& forces) {
    for (const double force : forces) {
      state_t state = State(++tick_);
      if (force > 0) Press(&state, {Force(contact_force_t::OBJECT, kLeftHand, kPot, force, force)});
      state.gripper[0].grip_force_peak_N = force;
      Tick(state);
    }
  }
  int64_t tick_ = 0;
};

TEST_F(SqueezeLimits, MeasureTheExcessAndItsTime) {
  Grip({8, 10});
  EXPECT_EQ(ExtendedValue(Summary(tick_).extended, "squeeze_excess_N"), 0) << "a force at its limit";
  EXPECT_EQ(ExtendedValue(Summary(tick_).extended, "squeeze_time_s"), 0);
  // After 0.06 s without an excess, the violation continues. After 0.1 s, another one begins.
  Grip({12, 17.5, 9, 0, 9, 14, 0, 0, 0, 0, 0, 11});
  const episode_summary_t summary = Summary(tick_);
  EXPECT_EQ(ExtendedValue(summary.extended, "squeeze_excess_N"), 7.5);
  EXPECT_NEAR(ExtendedValue(summary.extended, "squeeze_time_s"), 4 * 0.02, 1e-12);
  EXPECT_EQ(ExtendedValue(summary.extended, "limit_violations"), 2);
  EXPECT_EQ(ExplanationJson(summary.explanation)["limit_violations"][0].dump(),
            R"({"region":"egg","body":"pot/pot","robot_body":"left",)"
            R"("limit":"grip","limit_N":10.0,"force_N":17.5,"tick":3,"time_s":0.06})");
  EXPECT_NE(summary.explanation.text.find("egg: 18 N by left on pot/pot, grip limit 10 N"), std::string::npos)
      << summary.explanation.text;
}

TEST_F(SqueezeLimits, ConcernTheGrippedObject) {
  state_t state = State(1);
  // The gripper grips something else, because no finger presses on the pot.
  state.gripper[0].grip_force_peak_N = 100;
  Tick(state);
  EXPECT_EQ(ExtendedValue(Summary(1).extended, "squeeze_excess_N"), 0);
  EXPECT_EQ(ExtendedValue(Summary(1).extended, "limit_violations"), 0);
}

TEST_F(SqueezeLimits, AreOfManipulatedObjects) {
  model_info_t model = Model();
  model.limits_file = "limits.yaml";
  model.limits_yaml = "limits:\n  egg: {bodies: [pot, counter], grip_force_N: 10}\n";
  try {
    EpisodeScorer scorer(model, ParseTask(kTask, "small.yaml", false));
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(
        error.what(),
        "limits.yaml:2: 'counter' in a region with grip_force_N: expected a manipulated object (pot) "
        "or one of its bodies");
  }
}

TEST_F(ForceLimits, ABodyThatDoesNotExistIsNamed) {
  model_info_t model = Model();
  model.limits_file = "limits.yaml";
  model.limits_yaml =
      "limits:\n  a:\n    bodies: [conter]\n    quasi_static_force_N: 1\n    transient_force_N: 1\n";
  try {
    EpisodeScorer scorer(model, ParseTask(kTask, "small.yaml", false));
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(),
                 "limits.yaml:3: no entity or body has the name 'conter'; did you mean 'counter'?");
  }
}

TEST_F(ForceLimits, ARegionWithoutGeomsIsRefused) {
  model_info_t model = Model();
  model.geom_body[kLidGeom] = kPot;  // the lid has no other geom
  model.limits_file = "limits.yaml";
  model.limits_yaml =
      "limits:\n  a:\n    bodies: [pot/lid]\n    quasi_static_force_N: 1\n    transient_force_N: 1\n";
  try {
    EpisodeScorer scorer(model, ParseTask(kTask, "small.yaml", false));
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(),
                 "limits.yaml:3: no body of region 'a' has a geom that collides, so nothing touches it");
  }
}

}  // namespace evalbus::metrics::force_metrics_test
