// Counts the memory allocations per tick of all components of a run.
#include <gtest/gtest.h>

#include <chrono>

#include "bus/channels.h"
#include "collision/clearance_watch.h"
#include "collision/collision_component.h"
#include "lcmtypes/clock.h"
#include "tests/deadline.h"
#include "tests/unit/allocation_count.h"
#include "tests/unit/runner/in_process_run.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::runner::tick_path_test {

constexpr int64_t kFirst = 60, kLast = 160;

// Returns the allocations of the checker alone, including FCL, for the STATEs of these ticks.
int64_t AllocationsOfChecking(const model_info_t& info, const std::vector<state_t>& states) {
  const auto checker = collision::LoadChecker(info);
  collision::ClearanceWatch watch(checker.get(), ControlPeriodUs(info));
  int64_t before = 0;
  for (const state_t& state : states) {
    if (state.header.tick == kFirst) before = AllocationCount();
    for (int body = 0; body < state.num_bodies; ++body) {
      checker->SetBodyPose(body, state.body[body].position_m, state.body[body].quat_wxyz);
    }
    watch.At(state.header.tick, checker->FindContacts());
  }
  return AllocationCount() - before;
}

TEST(TickPath, OnlyFclAllocates) {
  TemporaryFolder folder;
  InProcessRun run("lift_pot", folder.path() / "run");
  Bus& bus = run.bus();

  model_info_t model{};
  std::vector<state_t> states(kLast + 1);
  int64_t tick = -1, before = 0, after = 0;
  bus.Subscribe(channels::kModel, [&](const model_info_t& m) { model = m; });
  // The storage of `states` is allocated before counting starts.
  const auto keep = [&](const state_t& state) { states[static_cast<size_t>(state.header.tick)] = state; };
  bus.Subscribe(channels::kState, [&](const state_t& state) {
    tick = state.header.tick;
    // Tick 0 has no contact forces, so tick 1 is used as well.
    if (tick <= 1) states.assign(states.size(), state);
    if (tick == kFirst) before = AllocationCount();
    if (tick <= kLast) keep(state);
    if (tick == kLast) after = AllocationCount();
  });
  run.Start();
  const auto deadline = std::chrono::steady_clock::now() + kDeadline;
  while (tick < kLast && std::chrono::steady_clock::now() < deadline) bus.Handle(deadline);
  ASSERT_EQ(tick, kLast);
  const int64_t of_checking = AllocationsOfChecking(model, states);
  EXPECT_GT(of_checking, 0);
  // Storage that grows with the episode is enlarged occasionally.
  EXPECT_LE(after - before - of_checking, (kLast - kFirst) / 10);
}

}  // namespace evalbus::runner::tick_path_test
