#include "policy_bridge/planning/kinematics.h"

#include <gtest/gtest.h>

#include <memory>

#include "base/errors.h"
#include "base/random.h"
#include "policy_bridge/planning/ik.h"
#include "tests/unit/policy_bridge/policy_scene.h"

namespace evalbus::policy::kinematics_test {

JointVector RandomJoints(const ArmChain& chain, Random* random) {
  JointVector q(chain.num_joints());
  for (int i = 0; i < q.size(); ++i) q[i] = random->Uniform(chain.lower()[i], chain.upper()[i]);
  return q;
}

JointVector Near(const ArmChain& chain, const JointVector& q, double distance, Random* random) {
  JointVector near = q;
  for (double& value : near) value += random->Uniform(-distance, distance);
  return near.cwiseMax(chain.lower()).cwiseMin(chain.upper());
}

TEST(Kinematics, ForwardEqualsMujoco) {
  const PolicyScene& scene = GetPolicyScene();
  const DataPtr data(mj_makeData(&scene.model()));
  Random random(1, 0);
  for (const arm_info_t& arm : scene.info().arm) {
    const ArmChain chain(scene.model(), arm);
    const int site = mj_name2id(&scene.model(), mjOBJ_SITE, arm.wrist_site.c_str());
    for (int i = 0; i < 200; ++i) {
      const JointVector q = RandomJoints(chain, &random);
      for (int j = 0; j < arm.num_joints; ++j) data->qpos[arm.joint_qpos_index[j]] = q[j];
      mj_kinematics(&scene.model(), data.get());
      const Eigen::Isometry3d wrist = chain.Forward(q);
      for (int row = 0; row < 3; ++row) {
        EXPECT_NEAR(wrist.translation()[row], data->site_xpos[3 * site + row], 1e-9);
        for (int col = 0; col < 3; ++col) {
          EXPECT_NEAR(wrist.linear()(row, col), data->site_xmat[9 * site + 3 * row + col], 1e-9);
        }
      }
    }
  }
}

TEST(Kinematics, JacobianEqualsFiniteDifferences) {
  constexpr double kStep = 1e-6;
  const PolicyScene& scene = GetPolicyScene();
  const ArmChain chain(scene.model(), scene.info().arm[0]);
  Random random(2, 0);
  Jacobian jacobian;
  for (int i = 0; i < 50; ++i) {
    const JointVector q = RandomJoints(chain, &random);
    chain.Forward(q, &jacobian);
    for (int j = 0; j < chain.num_joints(); ++j) {
      JointVector before = q, after = q;
      before[j] -= kStep;
      after[j] += kStep;
      const Eigen::Matrix<double, 6, 1> slope =
          PoseDifference(chain.Forward(before), chain.Forward(after)) / (2 * kStep);
      EXPECT_LT((jacobian.col(j) - slope).cwiseAbs().maxCoeff(), 1e-7);
    }
  }
}

TEST(Kinematics, WrongChainIsNamed) {
  const PolicyScene& scene = GetPolicyScene();
  arm_info_t arm = scene.info().arm[0];
  arm.wrist_site = "nowhere";
  EXPECT_THROW(ArmChain(scene.model(), arm), InputError);
  arm = scene.info().arm[0];
  std::swap(arm.joint_qpos_index[2], arm.joint_qpos_index[3]);
  EXPECT_THROW(ArmChain(scene.model(), arm), InputError);
}

TEST(InverseKinematics, ConvergesNearAndStaysWithinLimits) {
  const PolicyScene& scene = GetPolicyScene();
  const ArmChain chain(scene.model(), scene.info().arm[1]);
  Random random(3, 0);
  int converged = 0;
  constexpr int kCount = 500;
  for (int i = 0; i < kCount; ++i) {
    const JointVector q = RandomJoints(chain, &random);
    const Eigen::Isometry3d target = chain.Forward(q);
    const IkResult result = SolveIk(chain, target, Near(chain, q, 0.3, &random));
    EXPECT_TRUE((result.joints.array() >= chain.lower().array()).all());
    EXPECT_TRUE((result.joints.array() <= chain.upper().array()).all());
    if (!result.converged) continue;
    ++converged;
    EXPECT_LT(PoseDifference(chain.Forward(result.joints), target).norm(), 2e-6);
  }
  // The samples that do not converge are at joint limits and singularities.
  EXPECT_GT(converged, kCount * 95 / 100);
}

TEST(InverseKinematics, OutOfReachDoesNotConverge) {
  const PolicyScene& scene = GetPolicyScene();
  const ArmChain chain(scene.model(), scene.info().arm[0]);
  Eigen::Isometry3d target = chain.Forward(chain.home());
  target.translation().x() += 2;
  const IkResult result = SolveIk(chain, target, chain.home());
  EXPECT_FALSE(result.converged);
  EXPECT_TRUE(result.joints.allFinite());
}

TEST(InverseKinematics, SpendsRedundancyOnPosture) {
  const PolicyScene& scene = GetPolicyScene();
  const ArmChain chain(scene.model(), scene.info().arm[0]);
  JointVector start = chain.home();
  start[0] += 0.4;
  start[2] -= 0.5;
  const Eigen::Isometry3d target = chain.Forward(chain.home());
  IkOptions options;
  options.posture = chain.home();
  const IkResult with_posture = SolveIk(chain, target, start, options);
  const IkResult without = SolveIk(chain, target, start);
  ASSERT_TRUE(with_posture.converged && without.converged);
  EXPECT_LT((with_posture.joints - chain.home()).norm(), (without.joints - chain.home()).norm() - 0.05);
}

}  // namespace evalbus::policy::kinematics_test
