#include "policy_bridge/planning/servo_lead.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "models/model_info.h"
#include "models/mujoco_ptr.h"
#include "tests/unit/models/models_test_util.h"

namespace evalbus::policy::servo_lead_test {

constexpr double kStiffness = 400, kDamping = 30, kMass = 2, kLength = 0.5, kGravity = 9.81;

// Returns a model of an arm that is horizontal at angle 0: a point mass kMass at kLength from a hinge about
// y. custom: content of <custom>.
ModelPtr MakeModel(const std::string& custom, double damping = kDamping) {
  TempFolder folder;
  const auto file = folder.Write(
      "arm.xml", "<mujoco><option gravity='0 0 -9.81'/><custom>" + custom +
                     "</custom><worldbody><body><joint name='hinge' axis='0 -1 0'/>"
                     "<inertial pos='0.5 0 0' mass='2' diaginertia='1e-9 1e-9 1e-9'/></body></worldbody>"
                     "<actuator><general joint='hinge' biastype='affine' gainprm='400' biasprm='0 -400 -" +
                     std::to_string(damping) + "'/></actuator></mujoco>");
  char error[200];
  ModelPtr model(mj_loadXML(file.c_str(), nullptr, error, sizeof error));
  EXPECT_TRUE(model) << error;
  return model;
}

model_info_t OneArm() {
  model_info_t info{};
  arm_info_t arm{};
  arm.num_joints = 1;
  arm.joint_qpos_index = {0};
  info.arm.push_back(arm);
  return info;
}

double Target(const mjModel& model, double angle, double velocity) {
  ServoLead lead(model, OneArm());
  std::vector<JointVector> targets;
  lead.Lead({JointVector::Constant(1, angle)}, {JointVector::Constant(1, velocity)}, &targets);
  return targets[0][0];
}

TEST(ServoLead, LeadsByTheDelayOfTheVelocityTerm) {
  const ModelPtr model = MakeModel("");
  EXPECT_TRUE(CompensatesGravity(*model));
  EXPECT_NEAR(Target(*model, 0.3, 1.5), 0.3 + kDamping * 1.5 / kStiffness, 1e-12);
  EXPECT_EQ(Target(*MakeModel("", 0), 0.3, 1.5), 0.3);
}

TEST(ServoLead, CarriesTheWeightOfAnUncompensatedArm) {
  const ModelPtr model = MakeModel("<numeric name='gravity_compensation' data='0'/>");
  EXPECT_FALSE(CompensatesGravity(*model));
  for (const double angle : {-1.0, 0.0, 0.7}) {
    const double weight = kMass * kGravity * kLength * std::cos(angle);
    EXPECT_NEAR(Target(*model, angle, -0.5), angle + (weight - kDamping * 0.5) / kStiffness, 1e-9);
  }
}

// As an independent check, the simulated arm must stay at the desired angle with this target.
TEST(ServoLead, HoldsTheArmWhereItIsWanted) {
  const ModelPtr model = MakeModel("<numeric name='gravity_compensation' data='0'/>");
  const DataPtr data(mj_makeData(model.get()));
  data->ctrl[0] = Target(*model, 0.4, 0);
  for (int step = 0; step < 5000; ++step) mj_step(model.get(), data.get());
  EXPECT_NEAR(data->qpos[0], 0.4, 1e-6);
}

}  // namespace evalbus::policy::servo_lead_test
