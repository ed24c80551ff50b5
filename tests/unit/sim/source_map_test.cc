#include "sim/source_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "base/errors.h"

namespace evalbus::sim::source_map_test {

std::string Error(const std::string& text) {
  try {
    ReadSourceMap(text, "map.yaml");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(SourceMap, ReadsNamesZerosAndFrames) {
  const SourceMap map = ReadSourceMap(R"(joints:
  unit: deg
  columns:
    left/joint1: q0
    first_valve/wheel: {column: valve, sign: -1, zero: 90}
objects:
  tray: {name: wood_tray, frame: {position_m: [0, 0, 0.1], quaternion_wxyz: [0.5, 0.5, 0.5, 0.5]}}
  pot: {}
contacts:
  left_cabinet: [walls, counter]
  tray: wood_tray
)",
                                      "map.yaml");
  EXPECT_NEAR(map.angle_unit, std::numbers::pi / 180, 1e-15);
  EXPECT_EQ(map.joints.at("left/joint1").name, "q0");
  EXPECT_EQ(map.joints.at("left/joint1").Position(12), 12);
  EXPECT_EQ(map.joints.at("first_valve/wheel").name, "valve");
  EXPECT_EQ(map.joints.at("first_valve/wheel").Position(100), -10);
  EXPECT_EQ(map.objects.at("tray").name, "wood_tray");
  EXPECT_EQ(map.objects.at("tray").frame.position[2], 0.1);
  EXPECT_EQ(map.objects.at("pot").name, "pot");
  EXPECT_EQ(map.objects.at("pot").frame.quaternion[0], 1);
  ASSERT_EQ(map.contacts.size(), 3u);
  EXPECT_EQ(map.contacts.at("walls").name, "left_cabinet");
  EXPECT_EQ(map.contacts.at("counter").name, "left_cabinet");
  EXPECT_EQ(map.contacts.at("wood_tray").name, "tray");
}

// The source's frame is rotated by 90 degrees around z. Our frame is rotated by another 90 degrees around the
// source's x axis.
TEST(SourceMap, OurFrameIsGivenInTheFrameOfTheSource) {
  const double half = std::sqrt(0.5);
  const body_pose_t pose = PoseInFrame({{1, 2, 3}, {half, 0, 0, half}}, {{0.1, 0, 0}, {half, half, 0, 0}});
  EXPECT_NEAR(pose.position_m[0], 1, 1e-12);
  EXPECT_NEAR(pose.position_m[1], 2.1, 1e-12);
  EXPECT_NEAR(pose.position_m[2], 3, 1e-12);
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(pose.quat_wxyz[i], 0.5, 1e-12) << i;
  // A quaternion of the source that is not exactly of norm 1 rotates, but does not scale.
  const body_pose_t rounded =
      PoseInFrame({{1, 2, 3}, {1.009 * half, 0, 0, 1.009 * half}}, {{0.1, 0, 0}, {half, half, 0, 0}});
  EXPECT_NEAR(rounded.position_m[1], 2.1, 1e-12);
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(rounded.quat_wxyz[i], 0.5, 1e-12) << i;
}

TEST(SourceMap, ErrorsAreOneLineWithFileLineAndKey) {
  EXPECT_EQ(Error("joints:\n  unit: grad\n"), "map.yaml:2: key 'unit': expected deg or rad, got 'grad'");
  EXPECT_EQ(Error("joints:\n  unit: rad\n  columns:\n    a: {column: x, sign: 2}\n"),
            "map.yaml:4: key 'sign': expected 1 or -1, got 2");
  EXPECT_EQ(Error("joints:\n  unit: rad\n  columns:\n    a: x\n    b: {column: x}\n"),
            "map.yaml:5: key 'b': 'x' is already the column of 'a'");
  EXPECT_EQ(Error("objects:\n  a: {name: b}\n  b: {}\n"),
            "map.yaml:3: key 'b': 'b' is already the name of 'a'");
  EXPECT_EQ(Error("contacts:\n  a: [x, y]\n  b: y\n"), "map.yaml:3: key 'b': 'y' is already a name of 'a'");
  EXPECT_NE(Error("objects:\n  a: {frame: {position_m: [0, 0, 0], quaternion_wxyz: [1, 1, 0, 0]}}\n")
                .find("map.yaml:2: key 'quaternion_wxyz': expected a unit quaternion"),
            std::string::npos);
  EXPECT_NE(Error("objects:\n  a: {position_m: [x, y, z]}\n").find("map.yaml:2: key 'position_m'"),
            std::string::npos)
      << Error("objects:\n  a: {position_m: [x, y, z]}\n");
  EXPECT_NE(Error("task: lift_pot\n").find("map.yaml:1: key 'task'"), std::string::npos);
}

}  // namespace evalbus::sim::source_map_test
