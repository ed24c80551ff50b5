#include "models/model_consistency.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/unit/models/models_test_util.h"
#include "tests/unit/small_world.h"

namespace evalbus::model_consistency_test {

model_info_t Model() {
  model_info_t model = small_world::Model();
  model.joint_name = {"left/joint"};
  model.joint_qpos_index = {0};
  model.joint_lower_mixed = model.joint_upper_mixed = {0};
  model.num_joints = 1;
  return model;
}

template <class Change>
std::string ErrorAfter(const Change& change) {
  model_info_t model = Model();
  change(&model);
  return ErrorOf([&] { CheckConsistency(model); });
}

TEST(ModelConsistency, IndicesStayWithinWhatTheMessageCounts) {
  EXPECT_EQ(ErrorAfter([](model_info_t*) {}), "(no error)");
  EXPECT_EQ(ErrorAfter([](model_info_t* m) { m->body_entity[3] = 5; }),
            "MODEL: body_entity names index 5, expected 0 to 4");
  EXPECT_EQ(ErrorAfter([](model_info_t* m) { m->geom_body[0] = -1; }),
            "MODEL: geom_body names index -1, expected 0 to 7");
  EXPECT_EQ(ErrorAfter([](model_info_t* m) { m->object_entity[0] = 9; }),
            "MODEL: object_entity names index 9, expected 0 to 4");
  EXPECT_EQ(ErrorAfter([](model_info_t* m) { m->gripper[1].arm = 2; }),
            "MODEL: gripper.arm names index 2, expected 0 to 1");
  EXPECT_EQ(ErrorAfter([](model_info_t* m) { m->gripper[0].pad_geom[0] = 8; }),
            "MODEL: gripper.pad_geom names index 8, expected 0 to 7");
  for (const int index : {-1, std::numeric_limits<int>::max()}) {
    EXPECT_EQ(ErrorAfter([&](model_info_t* m) { m->joint_qpos_index[0] = index; }),
              "MODEL: joint_qpos_index names index " + std::to_string(index) + ", expected 0 to 1048575");
    EXPECT_EQ(ErrorAfter([&](model_info_t* m) { m->arm[1].joint_qpos_index[0] = index; }),
              "MODEL: arm.joint_qpos_index names index " + std::to_string(index) + ", expected 0 to 1048575");
  }
}

TEST(ModelConsistency, ATickTakesTime) {
  EXPECT_EQ(ErrorAfter([](model_info_t* m) { m->substeps = -10; }),
            "MODEL: a tick is -10 steps of 2000 us, expected more than 0 and less than an hour");
  for (const int64_t step : {int64_t{0}, int64_t{-2000}, std::numeric_limits<int64_t>::max()}) {
    EXPECT_EQ(ErrorAfter([&](model_info_t* m) { m->timestep_us = step; }),
              "MODEL: a tick is 10 steps of " + std::to_string(step) +
                  " us, expected more than 0 and less than an hour");
  }
}

TEST(ModelConsistency, RangesOfArmsAreRanges) {
  for (const double lower : {3.5, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_EQ(ErrorAfter([&](model_info_t* m) { m->arm[1].joint_lower_rad[0] = lower; }),
              "MODEL: arm 'right': the range of joint 0 is none");
  }
}

}  // namespace evalbus::model_consistency_test
