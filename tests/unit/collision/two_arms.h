// MJCF text of two Panda-like arms of primitive shapes with hands, a pot and two counters, similar to the
// LiftPot scene. It does not need the composer.
#pragma once

#include <string>

namespace evalbus::collision {

inline std::string TwoArmsXml() {
  const auto finger = [](const std::string& side, const std::string& name, int gripper, const char* quat) {
    return "<body name='robot_" + side + name + "' pos='0 0 .0584' quat='" + quat + "'>" +
           "<joint type='slide' axis='0 1 0' range='0 .04' limited='true'/>" +
           "<geom type='box' pos='0 .0155 .018' size='.0105 .0105 .018'/>" + "<geom name='pad" +
           std::to_string(gripper) + name +
           "' type='box' pos='0 .0045 .0445' size='.0085 .004 .0085'/></body>";
  };
  const auto arm = [&](const std::string& side, int gripper, const char* y) {
    const auto body = [&](const char* name, const char* pose, const char* range, const char* geoms) {
      return "<body name='robot_" + side + name + "' " + pose +
             "><joint axis='0 0 1' limited='true' range='" + range + "'/>" + geoms;
    };
    return "<body name='robot_" + side + "link0' pos='.1 " + y +
           " .6'><geom type='capsule' fromto='-.08 0 .06 0 0 .06' size='.065'/>"
           "<geom type='box' pos='-.03 0 -.51' size='.09 .09 .5'/>" +
           body("link1", "pos='0 0 .333'", "-2.9 2.9",
                "<geom type='capsule' fromto='0 0 -.19 0 0 -.05' size='.058'/>") +
           body("link2", "quat='1 -1 0 0'", "-1.76 1.76",
                "<geom type='capsule' fromto='0 0 -.06 0 0 .06' size='.06'/>") +
           body("link3", "pos='0 -.316 0' quat='1 1 0 0'", "-2.9 2.9",
                "<geom type='capsule' fromto='0 0 -.2 0 0 -.06' size='.058'/>") +
           body("link4", "pos='.0825 0 0' quat='1 1 0 0'", "-3.07 -.07",
                "<geom type='capsule' fromto='0 0 -.06 0 0 .06' size='.06'/>") +
           body("link5", "pos='-.0825 .384 0' quat='1 -1 0 0'", "-2.9 2.9",
                "<geom type='capsule' fromto='0 0 -.31 0 0 -.23' size='.06'/>"
                "<geom type='capsule' fromto='0 .05 -.2 0 .085 -.03' size='.04'/>") +
           body("link6", "quat='1 1 0 0'", "0 3.75",
                "<geom type='capsule' fromto='0 0 -.07 0 0 .01' size='.05'/>") +
           body("link7", "pos='.088 0 0' quat='1 1 0 0'", "-2.9 2.9",
                "<geom type='capsule' fromto='0 0 -.04 0 0 .06' size='.046'/>") +
           "<body name='robot_" + side + "hand' pos='0 0 .107' quat='.9238795 0 0 -.3826834'>" +
           "<geom type='box' pos='0 0 .033' size='.031 .101 .032'/>" +
           finger(side, "left_finger", gripper, "1 0 0 0") +
           finger(side, "right_finger", gripper, "0 0 0 1") +
           "</body></body></body></body></body></body></body></body></body>";
  };
  const auto exclude = [](const std::string& side) {
    return "<exclude body1='robot_" + side + "link0' body2='robot_" + side +
           "link1'/><exclude body1='robot_" + side + "link1' body2='robot_" + side +
           "link3'/><exclude body1='robot_" + side + "link5' body2='robot_" + side + "link7'/>";
  };
  const auto handle = [](const std::string& sign) {
    return "<geom type='box' pos='0 " + sign + ".225 .035' size='.08 .01 .01'/><geom type='box' pos='.072 " +
           sign + ".167 .035' size='.008 .048 .008'/><geom type='box' pos='-.072 " + sign +
           ".167 .035' size='.008 .048 .008'/>";
  };
  return "<mujoco><compiler angle='radian'/><size njmax='5000' nconmax='1000'/><worldbody>"
         "<geom name='floor' type='plane' size='4 4 .1'/>" +
         arm("left_", 0, ".3") + arm("right_", 1, "-.3") +
         "<body name='fixture1' pos='1.1 .3 0' quat='.7071068 0 0 -.7071068'><geom name='counter1' "
         "type='box' pos='0 -.3 .4295' size='.3 .3 .4295'/></body>"
         "<body name='fixture2' pos='1.1 -.3 0' quat='.7071068 0 0 -.7071068'><geom name='counter2' "
         "type='box' pos='0 -.3 .4295' size='.3 .3 .4295'/></body>"
         "<body name='pot' pos='.7 0 .996'><freejoint/><geom name='pot_base' type='box' pos='0 0 -.132' "
         "size='.085 .085 .005'/>"
         "<geom type='cylinder' pos='0 0 -.034' size='.125 .1'/>" +
         handle("") + handle("-") + "</body></worldbody><contact>" + exclude("left_") + exclude("right_") +
         "</contact></mujoco>";
}

}  // namespace evalbus::collision
