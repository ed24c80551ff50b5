#include "policy_bridge/actions/rotation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/random.h"

namespace evalbus::policy::rotation_test {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

const double kRootHalf = std::sqrt(0.5);
std::vector<double> Written(RotationForm form, const Quaterniond& rotation) {
  std::vector<double> values(NumValues(form));
  WriteRotation(form, rotation, values);
  return values;
}

Matrix3d Read(RotationForm form, const std::vector<double>& values) {
  return ReadRotation(form, values).toRotationMatrix();
}

void ExpectNear(const std::vector<double>& values, const std::vector<double>& expected) {
  ASSERT_EQ(values.size(), expected.size());
  for (size_t i = 0; i < values.size(); ++i) EXPECT_NEAR(values[i], expected[i], 1e-12) << "value " << i;
}

std::string Error(RotationForm form, const std::vector<double>& values) {
  try {
    ReadRotation(form, values);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "none";
}

Matrix3d About(int axis, double angle) {
  const int a = (axis + 1) % 3, b = (axis + 2) % 3;
  Matrix3d matrix = Matrix3d::Identity();
  matrix(a, a) = matrix(b, b) = std::cos(angle);
  matrix(a, b) = -std::sin(angle);
  matrix(b, a) = std::sin(angle);
  return matrix;
}

struct Row {
  RotationForm form;
  std::vector<double> values;
};

// A rotation by 90 degrees about z turns the x axis to y and the y axis to -x.
TEST(Rotation, QuarterTurnAboutZInEachForm) {
  Matrix3d turned;
  turned << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  const Row rows[] = {{RotationForm::kQuaternionWxyz, {kRootHalf, 0, 0, kRootHalf}},
                      {RotationForm::kQuaternionXyzw, {0, 0, kRootHalf, kRootHalf}},
                      {RotationForm::kAxisAngle, {0, 0, std::numbers::pi / 2}},
                      {RotationForm::kAxisAngleRobosuite, {0, 0, std::numbers::pi / 2}},
                      {RotationForm::kEulerXyzExtrinsic, {0, 0, std::numbers::pi / 2}},
                      {RotationForm::kEulerXyzIntrinsic, {0, 0, std::numbers::pi / 2}},
                      {RotationForm::kRotation6d, {0, 1, 0, -1, 0, 0}},
                      {RotationForm::kRotation6dInterleaved, {0, -1, 1, 0, 0, 0}},
                      {RotationForm::kRotation6dRows, {0, -1, 0, 1, 0, 0}}};
  for (const Row& row : rows) {
    SCOPED_TRACE(static_cast<int>(row.form));
    EXPECT_LT((Read(row.form, row.values) - turned).norm(), 1e-12);
    ExpectNear(Written(row.form, Quaterniond(kRootHalf, 0, 0, kRootHalf)), row.values);
  }
}

// Roll and yaw are 90 degrees. About fixed axes the roll is first: x remains x and then goes to y; y goes to
// z and remains; z goes to -y and then to x. About its own axes the yaw is first: x goes to y and z; y goes
// to -x and remains; z remains and goes to -y.
TEST(Rotation, EulerAnglesAboutFixedAndOwnAxes) {
  Matrix3d fixed, own;
  fixed << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  own << 0, -1, 0, 0, 0, -1, 1, 0, 0;
  EXPECT_LT((Read(RotationForm::kEulerXyzExtrinsic, {std::numbers::pi / 2, 0, std::numbers::pi / 2}) - fixed)
                .norm(),
            1e-12);
  EXPECT_LT(
      (Read(RotationForm::kEulerXyzIntrinsic, {std::numbers::pi / 2, 0, std::numbers::pi / 2}) - own).norm(),
      1e-12);
}

// The expected matrices are products of the three elementary matrices.
TEST(Rotation, EulerAnglesEqualProductsOfMatrices) {
  Random random(1, 0);
  for (int i = 0; i < 1000; ++i) {
    std::vector<double> angles;
    for (int j = 0; j < 3; ++j) angles.push_back(random.Uniform(-2 * std::numbers::pi, 2 * std::numbers::pi));
    const Matrix3d x = About(0, angles[0]), y = About(1, angles[1]), z = About(2, angles[2]);
    EXPECT_LT((Read(RotationForm::kEulerXyzExtrinsic, angles) - z * y * x).norm(), 1e-12);
    EXPECT_LT((Read(RotationForm::kEulerXyzIntrinsic, angles) - x * y * z).norm(), 1e-12);
  }
}

// Here the first and the third angle rotate about the same axis. The third is 0, as in scipy.
TEST(Rotation, GimbalLock) {
  for (double end : {std::numbers::pi / 2, -std::numbers::pi / 2}) {
    for (double x : {-3.0, -0.5, 0.0, 1.0, 2.5}) {
      for (RotationForm form : {RotationForm::kEulerXyzExtrinsic, RotationForm::kEulerXyzIntrinsic}) {
        const Quaterniond q(Read(form, {x, end, 0.7}));
        const std::vector<double> angles = Written(form, q);
        EXPECT_NEAR(angles[1], end, 1e-7);
        EXPECT_LT((Read(form, angles) - q.toRotationMatrix()).norm(), 1e-12);
      }
    }
  }
  // Exactly at the gimbal lock, the y axis remains, x goes to -z and z goes to x.
  const std::vector<double> angles =
      Written(RotationForm::kEulerXyzExtrinsic, Quaterniond(kRootHalf, 0, kRootHalf, 0));
  EXPECT_NEAR(angles[0], 0, 1e-12);
  EXPECT_NEAR(angles[1], std::numbers::pi / 2, 1e-7);
  EXPECT_EQ(angles[2], 0);
}

// robosuite writes the opposite quaternion of 90 degrees about z as 270 degrees about -z.
TEST(Rotation, RobosuitesAxisAngleKeepsTheSideOfItsQuaternion) {
  const auto written = [](double w, double x, double y, double z) {
    return Written(RotationForm::kAxisAngleRobosuite, Quaterniond(w, x, y, z));
  };
  ExpectNear(written(-kRootHalf, 0, 0, -kRootHalf), {0, 0, -3 * std::numbers::pi / 2});
  ExpectNear(Written(RotationForm::kAxisAngle, Quaterniond(-kRootHalf, 0, 0, -kRootHalf)),
             {0, 0, std::numbers::pi / 2});
  ExpectNear(written(0, 1, 0, 0), {std::numbers::pi, 0, 0});
  ExpectNear(written(1, 0, 0, 0), {0, 0, 0});
  ExpectNear(written(-1, 0, 0, 0), {0, 0, 0});
  // A w beyond 1, caused by rounding, is clipped.
  ExpectNear(written(1 + 1e-12, 0, 0, 1e-9), {0, 0, 0});
  ExpectNear(written(-1 - 1e-12, 0, 0, 1e-9), {0, 0, 0});
  // 120 degrees about (1, 1, 1) is (0.5, 0.5, 0.5, 0.5). The opposite quaternion is 240 degrees about -(1, 1,
  // 1).
  const double third = 2 * std::numbers::pi / 3 / std::sqrt(3.0);
  ExpectNear(written(0.5, 0.5, 0.5, 0.5), {third, third, third});
  ExpectNear(written(-0.5, -0.5, -0.5, -0.5), {-2 * third, -2 * third, -2 * third});
}

TEST(Rotation, QuaternionsKeepTheirSign) {
  ExpectNear(Written(RotationForm::kQuaternionWxyz, Quaterniond(-0.5, 0.5, -0.5, 0.5)),
             {-0.5, 0.5, -0.5, 0.5});
  ExpectNear(Written(RotationForm::kQuaternionXyzw, Quaterniond(-0.5, 0.5, -0.5, 0.5)),
             {0.5, -0.5, 0.5, -0.5});
}

TEST(Rotation, WhatIsNotUnitOrOrthogonalIsMadeSo) {
  EXPECT_LT((Read(RotationForm::kQuaternionWxyz, {3, 0, 0, 3}) - About(2, std::numbers::pi / 2)).norm(),
            1e-12);
  EXPECT_LT(
      (Read(RotationForm::kQuaternionXyzw, {0, 0, 2e200, 2e200}) - About(2, std::numbers::pi / 2)).norm(),
      1e-12);
  // The first column keeps its direction, y. The component of the second column along it is removed, so -x
  // remains.
  const Matrix3d turned = About(2, std::numbers::pi / 2);
  EXPECT_LT((Read(RotationForm::kRotation6d, {0, 2, 0, -3, 5, 0}) - turned).norm(), 1e-12);
  EXPECT_LT((Read(RotationForm::kRotation6dInterleaved, {0, -3, 2, 5, 0, 0}) - turned).norm(), 1e-12);
  EXPECT_LT((Read(RotationForm::kRotation6dRows, {0, -2, 0, 3, 5, 0}) - turned).norm(), 1e-12);
}

// Tests rotations about many axes by angles at which the formulas change, as both quaternions.
TEST(Rotation, RoundTripsInEachForm) {
  Random random(2, 0);
  const double angles[] = {0,
                           1e-15,
                           1e-9,
                           1e-7,
                           1e-3,
                           1,
                           std::numbers::pi / 2,
                           std::numbers::pi - 1e-3,
                           std::numbers::pi - 1e-8,
                           std::numbers::pi,
                           std::numbers::pi + 1e-8,
                           std::numbers::pi + 1e-3,
                           2 * std::numbers::pi - 1e-3,
                           2 * std::numbers::pi - 1e-7,
                           2 * std::numbers::pi};
  for (int i = 0; i < 200; ++i) {
    Vector3d axis(random.Uniform(-1, 1), random.Uniform(-1, 1), random.Uniform(-1, 1));
    if (i < 3) axis = Vector3d::Unit(i);
    axis.normalize();
    for (double angle : angles) {
      Quaterniond q(Eigen::AngleAxisd(angle, axis));
      for (int sign = 0; sign < 2; ++sign, q.coeffs() *= -1) {
        for (const auto& [name, form] : kRotationForms) {
          if (form == RotationForm::kNone) continue;
          const std::vector<double> values = Written(form, q);
          // If half the angle is near 0 or pi, its sine in robosuite's formula is the square root of a
          // rounding error.
          const double tolerance = form == RotationForm::kAxisAngleRobosuite ? 1e-7 : 1e-12;
          EXPECT_LT((Read(form, values) - q.toRotationMatrix()).norm(), tolerance)
              << name << ", " << angle << " rad about " << axis.transpose();
          const double length = std::hypot(values[0], values[1], values[2]);
          if (form == RotationForm::kAxisAngle) {
            EXPECT_LE(length, std::numbers::pi + 1e-12);
          }
          if (form == RotationForm::kAxisAngleRobosuite && q.w() < 0 && length > 0) {
            EXPECT_GE(length, std::numbers::pi - 1e-12);
          }
        }
      }
    }
  }
}

// Tests Euler angles at distances of 1e-16 to 0.1 rad from gimbal lock.
TEST(Rotation, RoundTripsNearGimbalLock) {
  Random random(3, 0);
  for (double distance = 1e-16; distance < 0.1; distance *= 3) {
    for (double end : {std::numbers::pi / 2, -std::numbers::pi / 2}) {
      const std::vector<double> angles = {random.Uniform(-std::numbers::pi, std::numbers::pi),
                                          end - std::copysign(distance, end),
                                          random.Uniform(-std::numbers::pi, std::numbers::pi)};
      for (RotationForm form : {RotationForm::kEulerXyzExtrinsic, RotationForm::kEulerXyzIntrinsic}) {
        const Quaterniond q = ReadRotation(form, angles);
        EXPECT_LT((Read(form, Written(form, q)) - q.toRotationMatrix()).norm(), 1e-11) << distance;
      }
    }
  }
}

// Every rotation vector is valid, even one as long as the largest double.
TEST(Rotation, AnyRotationVectorIsOne) {
  EXPECT_LT((Read(RotationForm::kAxisAngle, {0, 0, 2.5 * std::numbers::pi}) - About(2, std::numbers::pi / 2))
                .norm(),
            1e-12);
  EXPECT_LT((Read(RotationForm::kAxisAngleRobosuite, {0, 0, -1.5 * std::numbers::pi}) -
             About(2, std::numbers::pi / 2))
                .norm(),
            1e-12);
  const Matrix3d wild = Read(RotationForm::kAxisAngle, {1e300, -1e308, 1e300});
  EXPECT_NEAR(wild.determinant(), 1, 1e-9);
}

TEST(Rotation, WhatIsNoneIsNamed) {
  const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
  EXPECT_EQ(Error(RotationForm::kQuaternionWxyz, {0, 0, 0, 0}),
            "(0, 0, 0, 0) is not a rotation: the norm of the quaternion is below 1e-6");
  EXPECT_EQ(Error(RotationForm::kQuaternionXyzw, {1, 0, nan, 0}),
            "(1, 0, nan, 0) is not a rotation: a value is not finite");
  EXPECT_EQ(Error(RotationForm::kAxisAngle, {inf, 0, 0}),
            "(inf, 0, 0) is not a rotation: a value is not finite");
  EXPECT_EQ(Error(RotationForm::kRotation6d, {0, 0, 0, 0, 1, 0}),
            "(0, 0, 0, 0, 1, 0) is not a rotation: one of its two vectors is shorter than 1e-6");
  EXPECT_EQ(Error(RotationForm::kRotation6dInterleaved, {1, -2, 0, 0, 0, 0}),
            "(1, -2, 0, 0, 0, 0) is not a rotation: its two vectors are parallel");
  EXPECT_EQ(Error(RotationForm::kEulerXyzExtrinsic, {1, 2}), "(1, 2) is not a rotation: expected 3 values");
  EXPECT_EQ(Error(RotationForm::kNone, {}), "none");
}

}  // namespace evalbus::policy::rotation_test
