#include "metrics/episode/tick_merger.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "tests/unit/allocation_count.h"
#include "tests/unit/small_world.h"

namespace evalbus::metrics::tick_merger_test {

using small_world::Contacts;
using small_world::State;

// Returns the ticks of all complete pairs. Both messages of a pair must belong to the same tick.
std::vector<int64_t> Drain(TickMerger* dut) {
  std::vector<int64_t> ticks;
  TickMerger::Pair pair;
  while (dut->Next(&pair)) {
    EXPECT_EQ(pair.state->header.tick, pair.contacts->header.tick);
    ticks.push_back(pair.state->header.tick);
  }
  return ticks;
}

using Ticks = std::vector<int64_t>;

TEST(TickMerger, WaitsForBothMessages) {
  TickMerger dut;
  dut.Start();
  EXPECT_TRUE(dut.Add(State(0)));
  EXPECT_EQ(Drain(&dut), Ticks{});
  EXPECT_TRUE(dut.Add(Contacts(0)));
  EXPECT_EQ(Drain(&dut), Ticks{0});
  EXPECT_EQ(Drain(&dut), Ticks{});
}

TEST(TickMerger, GivesTickOrderWhateverTheArrivalOrder) {
  struct Arrival {
    int64_t tick;
    bool is_state;
  };
  std::vector<Arrival> arrivals;
  Ticks all;
  for (int64_t tick = 0; tick < 60; ++tick) {
    arrivals.push_back({tick, true});
    arrivals.push_back({tick, false});
    all.push_back(tick);
  }
  std::mt19937 random(7);
  for (int round = 0; round < 20; ++round) {
    std::shuffle(arrivals.begin(), arrivals.end(), random);
    TickMerger dut;
    dut.Start();
    Ticks got;
    for (const Arrival& arrival : arrivals) {
      ASSERT_TRUE(arrival.is_state ? dut.Add(State(arrival.tick)) : dut.Add(Contacts(arrival.tick)));
      const Ticks now = Drain(&dut);
      got.insert(got.end(), now.begin(), now.end());
    }
    EXPECT_EQ(got, all);
    EXPECT_EQ(dut.missing(), 0);
    EXPECT_EQ(dut.duplicates(), 0);
  }
}

TEST(TickMerger, RefusesDuplicatesAndTheOld) {
  TickMerger dut;
  dut.Start();
  dut.Add(State(0));
  EXPECT_FALSE(dut.Add(State(0)));
  dut.Add(Contacts(0));
  EXPECT_EQ(Drain(&dut), Ticks{0});
  EXPECT_FALSE(dut.Add(Contacts(0)));
  EXPECT_FALSE(dut.Add(State(-1)));
  EXPECT_EQ(dut.duplicates(), 3);
}

TEST(TickMerger, GivesUpOnAGapAfterAHundredCompleteTicks) {
  TickMerger dut;
  dut.Start();
  dut.Add(State(0));  // its CONTACTS never arrive
  for (int64_t tick = 2; tick < 101; ++tick) {
    dut.Add(State(tick));
    dut.Add(Contacts(tick));
    EXPECT_EQ(Drain(&dut), Ticks{}) << tick;
  }
  dut.Add(State(101));
  dut.Add(Contacts(101));
  const Ticks got = Drain(&dut);
  ASSERT_EQ(got.size(), 100);
  EXPECT_EQ(got.front(), 2);
  EXPECT_EQ(got.back(), 101);
  EXPECT_EQ(dut.missing(), 2);
  EXPECT_FALSE(dut.Add(Contacts(0))) << "too late";
}

TEST(TickMerger, WaitsForTheLastTicksUntilItGivesUp) {
  TickMerger dut;
  dut.Start();
  for (int64_t tick : {0, 1, 4, 7}) {
    dut.Add(State(tick));
    dut.Add(Contacts(tick));
  }
  dut.Add(State(9));
  EXPECT_EQ(Drain(&dut), (Ticks{0, 1}));
  EXPECT_FALSE(dut.finished());
  dut.EndAt(6);
  EXPECT_EQ(Drain(&dut), Ticks{});
  EXPECT_FALSE(dut.finished());
  EXPECT_FALSE(dut.Add(State(7))) << "beyond the end";
  EXPECT_TRUE(dut.Add(State(2)));
  EXPECT_TRUE(dut.Add(Contacts(2)));
  EXPECT_EQ(Drain(&dut), Ticks{2});
  dut.GiveUp();
  EXPECT_EQ(Drain(&dut), Ticks{4});
  EXPECT_TRUE(dut.finished());
  EXPECT_EQ(dut.missing(), 3);  // ticks 3, 5 and 6
}

TEST(TickMerger, IsFinishedWhenTheEndComesLast) {
  TickMerger dut;
  dut.Start();
  dut.Add(State(0));
  dut.Add(Contacts(0));
  TickMerger::Pair pair;
  EXPECT_TRUE(dut.Next(&pair));
  dut.EndAt(0);
  EXPECT_TRUE(dut.finished());
  EXPECT_FALSE(dut.Next(&pair));
  EXPECT_EQ(dut.missing(), 0);
}

TEST(TickMerger, NothingSurvivesStart) {
  TickMerger dut;
  dut.Start();
  for (int64_t tick : {0, 1, 5, 6}) {
    dut.Add(State(tick));
    dut.Add(Contacts(tick));
  }
  TickMerger::Pair pair;
  dut.Next(&pair);
  dut.EndAt(8);
  dut.GiveUp();
  Drain(&dut);
  dut.Start();
  EXPECT_FALSE(dut.finished());
  EXPECT_EQ(dut.missing(), 0);
  dut.Add(Contacts(0));
  dut.Add(State(1));
  EXPECT_EQ(Drain(&dut), Ticks{}) << "a slot of the episode before counts as complete";
  dut.Add(State(0));
  EXPECT_EQ(Drain(&dut), Ticks{0});
}

TEST(TickMerger, ASteadyStreamAllocatesNothing) {
  TickMerger dut;
  dut.Start();
  state_t state = State(0);
  contacts_t contacts = Contacts(0);
  TickMerger::Pair pair;
  int64_t before = 0;
  for (int64_t tick = 0; tick < 100; ++tick) {
    if (tick == 10) before = AllocationCount();
    state.header.tick = contacts.header.tick = tick;
    dut.Add(state);
    dut.Add(contacts);
    ASSERT_TRUE(dut.Next(&pair));
  }
  EXPECT_EQ(AllocationCount() - before, 0);
}

}  // namespace evalbus::metrics::tick_merger_test
