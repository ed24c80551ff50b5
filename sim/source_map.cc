#include "sim/source_map.h"

#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include "base/angles.h"

namespace evalbus::sim {
namespace {

JointMap ReadJointMap(const YamlValue& value) {
  JointMap joint;
  joint.where = value;
  if (!value.is_map()) {
    joint.name = value.Text();
    return joint;
  }
  const YamlMap map(value, {"column"}, {"sign", "zero"});
  joint.name = map["column"].Text();
  if (const YamlValue* sign = map.Find("sign")) {
    joint.sign = sign->Number();
    if (joint.sign != 1 && joint.sign != -1)
      sign->Fail(fmt::format("expected 1 or -1, got {:g}", joint.sign));
  }
  if (const YamlValue* zero = map.Find("zero")) joint.zero = zero->Number();
  return joint;
}

}  // namespace

std::map<std::string, JointMap> ReadJointMaps(const YamlValue& value) {
  std::map<std::string, JointMap> joints;
  std::map<std::string, std::string> taken;
  for (const YamlValue& entry : value.Entries()) {
    const JointMap joint = ReadJointMap(entry);
    if (const auto [other, is_new] = taken.emplace(joint.name, entry.key()); !is_new)
      entry.Fail("'" + joint.name + "' is already the column of '" + other->second + "'");
    joints.emplace(entry.key(), joint);
  }
  return joints;
}

double ReadAngleUnit(const YamlValue& value) {
  const std::string unit = value.Text();
  if (unit == "rad") return 1;
  if (unit == "deg") return kDegree;
  value.Fail("expected deg or rad, got '" + unit + "'");
}

body_pose_t PoseInFrame(const body_pose_t& its, const Pose& frame) {
  body_pose_t pose{};
  // The norm may deviate from 1 by up to 1 % (MeasuredScene::SampleFault), but mju_rotVecQuat requires 1.
  double quat[4];
  mju_copy4(quat, its.quat_wxyz);
  mju_normalize4(quat);
  mju_rotVecQuat(pose.position_m, frame.position.data(), quat);
  mju_addTo3(pose.position_m, its.position_m);
  mju_mulQuat(pose.quat_wxyz, quat, frame.quaternion.data());
  return pose;
}

SourceMap ReadSourceMap(const std::string& text, const std::string& file) {
  const YamlMap yaml(ParseYaml(text, file), {}, {"joints", "objects", "contacts"});
  SourceMap map;
  map.file = file;
  if (const YamlValue* value = yaml.Find("joints")) {
    const YamlMap joints(*value, {"unit"}, {"columns"});
    map.angle_unit = ReadAngleUnit(joints["unit"]);
    if (const YamlValue* columns = joints.Find("columns")) map.joints = ReadJointMaps(*columns);
  }
  std::map<std::string, std::string> taken;
  if (const YamlValue* objects = yaml.Find("objects")) {
    for (const YamlValue& entry : objects->Entries()) {
      const YamlMap keys(entry, {}, {"name", "frame"});
      SourceMap::Object object{entry.key(), {}, entry};
      if (const YamlValue* name = keys.Find("name")) object.name = name->Text();
      if (const YamlValue* frame = keys.Find("frame")) object.frame = ReadPose(*frame, kFarthest);
      if (const auto [other, is_new] = taken.emplace(object.name, entry.key()); !is_new)
        entry.Fail("'" + object.name + "' is already the name of '" + other->second + "'");
      map.objects.emplace(entry.key(), object);
    }
  }
  if (const YamlValue* contacts = yaml.Find("contacts")) {
    for (const YamlValue& entry : contacts->Entries()) {
      const std::vector<std::string> names =
          entry.is_list() ? entry.Texts() : std::vector<std::string>{entry.Text()};
      for (const std::string& name : names) {
        const auto [other, is_new] = map.contacts.emplace(name, SourceMap::ContactName{entry.key(), entry});
        if (!is_new) entry.Fail("'" + name + "' is already a name of '" + other->second.name + "'");
      }
    }
  }
  return map;
}

}  // namespace evalbus::sim
