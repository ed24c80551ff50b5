// Implements the part of mjcf_part.h that converts position servos of newer MuJoCo versions.
#include <mujoco/mujoco.h>

#include "base/angles.h"
#include "models/mjcf_part.h"
#include "models/mjcf_xml.h"

namespace evalbus::mjcf {
namespace {

using tinyxml2::XMLElement;

// Attributes of <position> that MuJoCo 2.2 does not support.
constexpr const char* kLater[] = {"kv", "dampratio", "inheritrange"};

// force = gain * command - stiffness * length - velocity_gain * velocity
struct Servo {
  double gain = 1, stiffness = 0, velocity_gain = 0;
  // Damping relative to critical damping, which only newer versions can compute.
  bool has_damping_ratio = false;
  // Command range as a multiple of the joint's range. 0: the actuator has its own range.
  double inherited_range = 0;
};

bool IsServo(const XMLElement* element) { return Is(element, "position") || Is(element, "general"); }

// Reads the attributes that this element or default class sets.
void Read(const XMLElement* element, Servo* servo) {
  const auto numbers = [&](const char* attribute) {
    const char* text = element->Attribute(attribute);
    return text ? ParseNumbers(element, attribute, text, 0) : std::vector<double>();
  };
  if (Is(element, "general")) {
    const std::vector<double> gain = numbers("gainprm"), bias = numbers("biasprm");
    if (!gain.empty()) servo->gain = gain[0];
    if (bias.size() > 1) servo->stiffness = -bias[1];
    if (bias.size() > 2) servo->velocity_gain = -bias[2];
    return;
  }
  const auto number = [&](const char* attribute, double* value) {
    if (const char* text = element->Attribute(attribute)) {
      *value = ParseNumbers(element, attribute, text, 1)[0];
      return true;
    }
    return false;
  };
  number("kp", &servo->gain);
  servo->stiffness = servo->gain;
  // An element's kv overrides the dampratio of its default class.
  if (number("kv", &servo->velocity_gain)) servo->has_damping_ratio = false;
  servo->has_damping_ratio |= element->Attribute("dampratio") != nullptr;
  number("inheritrange", &servo->inherited_range);
}

}  // namespace

void Part::WriteServos(const std::map<std::string, double>& stiffness) {
  for (XMLElement* section : Sections("actuator")) {
    for (XMLElement* actuator : Children(section)) {
      const std::string name = Get(actuator, "name");
      const auto replaced = stiffness.find(name);
      if (!IsServo(actuator)) {
        if (replaced == stiffness.end()) continue;
        if (!Is(actuator, "motor")) {
          Fail(actuator, "actuator '" + name + "' is a " + actuator->Name() + ", which has no position gain");
        }
        ServoOfMotor(actuator);
      }
      Servo servo;
      for (const XMLElement* defaults : ClassChain(Get(actuator, "class", "main"))) {
        for (const char* kind : {"general", "position"}) {
          if (const XMLElement* values = defaults->FirstChildElement(kind)) Read(values, &servo);
        }
      }
      Read(actuator, &servo);
      if (servo.inherited_range > 0) InheritRange(actuator, servo.inherited_range);
      if (replaced != stiffness.end()) {
        // The gain is scaled with the stiffness, so that the command keeps its unit.
        servo.gain = replaced->second * (servo.stiffness == 0 ? 1 : servo.gain / servo.stiffness);
        servo.stiffness = replaced->second;
        servo.velocity_gain = 0;
      } else if (Is(actuator, "general")) {
        continue;
      } else if (servo.has_damping_ratio) {
        Fail(actuator, "<position>: attribute 'dampratio' is not known to MuJoCo " +
                           std::string(mj_versionString()) +
                           "; give the robot's description a position gain");
      }
      for (const char* attribute : kLater) actuator->DeleteAttribute(attribute);
      if (replaced == stiffness.end() && servo.velocity_gain == 0) continue;
      actuator->SetName("general");
      actuator->DeleteAttribute("kp");
      Set(actuator, "dyntype", "none");
      Set(actuator, "gaintype", "fixed");
      Set(actuator, "biastype", "affine");
      Set(actuator, "gainprm", Join(std::vector<double>{servo.gain, 0, 0}));
      Set(actuator, "biasprm", Join(std::vector<double>{0, -servo.stiffness, 0 - servo.velocity_gain}));
    }
  }
  // The attributes have been applied to all servos, so they are removed from the default classes.
  for (const auto& [name, defaults] : classes_) {
    if (XMLElement* position = defaults->FirstChildElement("position")) {
      for (const char* attribute : kLater) position->DeleteAttribute(attribute);
    }
  }
}

void Part::ServoOfMotor(XMLElement* motor) {
  const std::string gear = Effective(motor, "main", "gear").value_or("1");
  const std::vector<double> ratio = ParseNumbers(motor, "gear", gear, 0);
  if (ratio.empty() || ratio[0] != 1) {
    Fail(motor, Tag(motor) + ": attribute 'gear': a motor with a gear cannot become a position servo");
  }
  // A motor's command is a torque, so the limits of its command become the limits of the servo's force.
  if (const auto torque = Effective(motor, "main", "ctrlrange"); torque && !motor->Attribute("forcerange")) {
    Set(motor, "forcelimited", "true");
    Set(motor, "forcerange", *torque);
  }
  Set(motor, "ctrllimited", "false");
  motor->DeleteAttribute("ctrlrange");
}

void Part::InheritRange(XMLElement* actuator, double factor) {
  const std::string joint = Get(actuator, "joint");
  std::optional<std::string> text;
  std::string type;
  const auto search = [&](const auto& self, XMLElement* body, const std::string& childclass) -> void {
    for (XMLElement* child : Children(body)) {
      if (Is(child, "body")) self(self, child, Get(child, "childclass", childclass));
      if (!Is(child, "joint") || Get(child, "name") != joint) continue;
      text = Effective(child, childclass, "range");
      type = Effective(child, childclass, "type").value_or("hinge");
    }
  };
  for (XMLElement* section : Sections("worldbody")) search(search, section, "main");
  if (!text) Fail(actuator, Tag(actuator) + ": attribute 'inheritrange': its joint has no range");
  const std::vector<double> range = ParseNumbers(actuator, "range", *text, 2);
  // A command range is in radians regardless of the compiler's angle setting.
  const double unit = type == "hinge" && compiler("angle", "degree") == "degree" ? kDegree : 1;
  const double middle = unit * (range[0] + range[1]) / 2, half = unit * factor * (range[1] - range[0]) / 2;
  Set(actuator, "ctrlrange", Join(std::vector<double>{middle - half, middle + half}));
}

}  // namespace evalbus::mjcf
