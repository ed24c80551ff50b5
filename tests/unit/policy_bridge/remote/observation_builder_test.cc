#include "policy_bridge/remote/observation_builder.h"

#include <gtest/gtest.h>

#include "tests/unit/policy_bridge/policy_scene.h"

namespace evalbus::policy::observation_builder_test {

constexpr char kContract[] = R"(wire: openpi
url: ws://127.0.0.1:1
rate_hz: 20
observation:
  - {key: state, state: {signal: left.joint_position_rad, indices: [0]}, history_ticks: [-4, -1, 0]}
action:
  kind: joint_position
  values: 7
  execute_steps: 1
  arms: [{arm: left, indices: 0-6}]
)";

// With a realtime clock, ticks that pass during an inference are not added.
TEST(ObservationBuilder, HistoryCountsTicks) {
  const PolicyScene& scene = GetPolicyScene();
  const Contract contract = ParseContract(kContract, "mine.yaml");
  ObservationBuilder builder(contract, scene.model(), scene.info());
  // Adds the state of `tick`, builds the observation, and returns the ticks in the observation's history.
  const auto add = [&](int64_t tick) {
    state_t state{};
    state.header.tick = tick;
    state.arm.resize(scene.info().arm.size());
    for (arm_state_t& arm : state.arm) arm.joint_position_rad.assign(7, static_cast<double>(tick));
    builder.Add(state, {});
    observation_t record;
    builder.Build({}, &record);
    return record.array.at(0).value_mixed;
  };
  using Ticks = std::vector<double>;
  builder.Begin();
  EXPECT_EQ(add(0), (Ticks{0, 0, 0}));
  EXPECT_EQ(add(1), (Ticks{0, 0, 1}));
  EXPECT_EQ(add(5), (Ticks{1, 1, 5}));
  EXPECT_EQ(add(6), (Ticks{1, 5, 6}));
  for (int64_t tick = 7; tick < 12; ++tick)
    EXPECT_EQ(add(tick), (Ticks{tick < 9 ? 1.0 : tick - 4.0, tick - 1.0, static_cast<double>(tick)})) << tick;
}

}  // namespace evalbus::policy::observation_builder_test
