#include "bus/recorder/tick_set.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

namespace evalbus::tick_set_test {

TEST(TickSet, AgreesWithASetOfNumbersInAnyOrder) {
  std::mt19937 random(1);
  for (int round = 0; round < 200; ++round) {
    TickSet dut;
    std::set<int64_t> reference;
    for (int i = 0; i < 60; ++i) {
      const int64_t tick = random() % 40;
      dut.Add(tick);
      reference.insert(tick);
      const int64_t end = random() % 50;
      const auto there = std::distance(reference.begin(), reference.lower_bound(end));
      ASSERT_EQ(dut.MissingBefore(end), end - there) << "round " << round << ", tick " << tick;
    }
  }
}

}  // namespace evalbus::tick_set_test
