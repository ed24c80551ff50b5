// Tests position servos as newer MuJoCo versions define them. According to MuJoCo 3's documentation of
// <position>, gainprm is kp, biasprm is 0 -kp -kv, and inheritrange is a multiple of the joint's range.
#include <mujoco/mujoco.h>

#include "models/compile_model.h"
#include "models/scene_composer.h"
#include "tests/unit/models/models_test_util.h"

namespace evalbus::mjcf_servos_test {

constexpr const char* kServos = R"(<mujoco>
  <compiler angle="ANGLE"/>
  <default>
    <default class="large">
      <position kp="2000" kv="100" forcerange="-105 105"/>
      <default class="small"><position kp="500"/></default>
    </default>
    <default class="whole"><position inheritrange="1" ctrlrange="-9 9"/></default>
  </default>
  <worldbody>
    <body><joint name="j" range="LOWER UPPER" limited="true"/><geom size="0.1"/></body>
  </worldbody>
  <actuator>
    <position name="large" joint="j" class="large" ctrlrange="-1 2" ctrllimited="true"/>
    <position name="small" joint="j" class="small"/>
    <position name="own" joint="j" class="whole" kp="30" kv="4"/>
    <position name="plain" joint="j" kp="7"/>
    <position name="critical" joint="j" class="small" dampratio="1"/>
    <motor name="motor" joint="j" ctrlrange="-80 80" ctrllimited="true"/>
    <velocity name="velocity" joint="j"/>
    <motor name="geared" joint="j" gear="50"/>
  </actuator>
</mujoco>)";

std::string Servos(const std::string& angle, const std::string& lower, const std::string& upper) {
  return ReplaceFirst(ReplaceFirst(ReplaceFirst(kServos, "ANGLE", angle), "LOWER", lower), "UPPER", upper);
}

ModelPtr Compose(const std::string& text, const std::map<std::string, double>& stiffness) {
  TempFolder folder;
  SceneComposer composer(folder.Write("base.xml", "<mujoco/>"));
  composer.Attach(folder.Write("part.xml", text), "p/", Pose{}, {.stiffness = stiffness});
  std::vector<std::string> warnings;
  return CompileModel(composer, false, &warnings);
}

struct Servo {
  double gain, stiffness, velocity_gain;
  bool operator==(const Servo&) const = default;
};

Servo ServoIn(const mjModel& model, const std::string& name) {
  const int id = mj_name2id(&model, mjOBJ_ACTUATOR, ("p/" + name).c_str());
  EXPECT_GE(id, 0) << name;
  EXPECT_EQ(model.actuator_biastype[id], mjBIAS_AFFINE) << name;
  return {model.actuator_gainprm[mjNGAIN * id], -model.actuator_biasprm[mjNBIAS * id + 1],
          -model.actuator_biasprm[mjNBIAS * id + 2]};
}

TEST(MjcfServos, VelocityGainsAreThoseOfMuJoCo3) {
  const ModelPtr model = Compose(Servos("radian", "-1", "3"), {{"critical", 40}});
  EXPECT_EQ(ServoIn(*model, "large"), (Servo{2000, 2000, 100}));
  EXPECT_EQ(ServoIn(*model, "small"), (Servo{500, 500, 100}));
  EXPECT_EQ(ServoIn(*model, "own"), (Servo{30, 30, 4}));
  EXPECT_EQ(ServoIn(*model, "plain"), (Servo{7, 7, 0}));
  // An element that is replaced may contain anything.
  EXPECT_EQ(ServoIn(*model, "critical"), (Servo{40, 40, 0}));
  // All other attributes of the classes and of the element remain.
  EXPECT_EQ(model->actuator_forcerange[1], 105);
  EXPECT_EQ(model->actuator_ctrlrange[1], 2);
  EXPECT_EQ(model->actuator_forcerange[3], 105);
}

TEST(MjcfServos, RangesAreInheritedInRadians) {
  const ModelPtr radian = Compose(Servos("radian", "-1", "3"), {{"critical", 40}});
  const int own = mj_name2id(radian.get(), mjOBJ_ACTUATOR, "p/own");
  EXPECT_EQ(radian->actuator_ctrlrange[2 * own], -1);
  EXPECT_EQ(radian->actuator_ctrlrange[2 * own + 1], 3);
  const ModelPtr degree = Compose(Servos("degree", "-90", "180"), {{"critical", 40}});
  EXPECT_NEAR(degree->actuator_ctrlrange[2 * own], -1.5707963267948966, 1e-15);
  EXPECT_NEAR(degree->actuator_ctrlrange[2 * own + 1], 3.141592653589793, 1e-15);
}

TEST(MjcfServos, AStiffnessLeavesTheCommandItsUnit) {
  TempFolder folder;
  SceneComposer composer(folder.Write("base.xml", "<mujoco/>"));
  // The hand's command of 0 to 255 is a tendon length of 0 to 0.04 m. Its stiffness is 100 N/m.
  composer.Attach(kModelsData / "newer_hand.xml", "p/", Pose{}, {.stiffness = {{"grip", 2000}}});
  std::vector<std::string> warnings;
  const Servo servo = ServoIn(*CompileModel(composer, false, &warnings), "grip");
  EXPECT_NEAR(servo.gain, 0.0157 * 20, 1e-15);
  EXPECT_EQ(servo.stiffness, 2000);
  EXPECT_EQ(servo.velocity_gain, 0);
}

// robosuite's arms are torque-controlled, so their motors become servos.
TEST(MjcfServos, AMotorWithAStiffnessIsAServoOfItsTorque) {
  const ModelPtr model = Compose(Servos("radian", "-1", "3"), {{"critical", 40}, {"motor", 700}});
  EXPECT_EQ(ServoIn(*model, "motor"), (Servo{700, 700, 0}));
  const int id = mj_name2id(model.get(), mjOBJ_ACTUATOR, "p/motor");
  EXPECT_TRUE(model->actuator_forcelimited[id]);
  EXPECT_EQ(model->actuator_forcerange[2 * id], -80);
  EXPECT_EQ(model->actuator_forcerange[2 * id + 1], 80);
  EXPECT_FALSE(model->actuator_ctrllimited[id]);
}

TEST(MjcfServos, WhatCannotBeMappedIsNamed) {
  const auto error = [](const std::map<std::string, double>& stiffness) {
    const std::string message = ErrorOf([&] { Compose(Servos("radian", "-1", "3"), stiffness); });
    return message.substr(message.find("part.xml"));
  };
  EXPECT_EQ(error({}), "part.xml:18: <position>: attribute 'dampratio' is not known to MuJoCo " +
                           std::string(mj_versionString()) +
                           "; give the robot's description a position gain");
  EXPECT_EQ(error({{"critical", 1}, {"velocity", 1}}),
            "part.xml:20: actuator 'velocity' is a velocity, which has no position gain");
  EXPECT_EQ(error({{"critical", 1}, {"geared", 1}}),
            "part.xml:21: <motor>: attribute 'gear': a motor with a gear cannot become a position servo");
}

}  // namespace evalbus::mjcf_servos_test
