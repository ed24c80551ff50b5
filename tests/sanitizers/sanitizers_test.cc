// These tests check that a sanitizer finding ends the program, so that no test that causes one can pass.
#include <gtest/gtest.h>

#include <climits>
#include <cstdlib>
#include <memory>
#include <thread>
#include <vector>

namespace evalbus {
namespace {

class Sanitizers : public testing::Test {
 protected:
  void SetUp() override {
    // The program is restarted for each fault and reports findings to stderr instead of the folder of
    // scripts/check.
    GTEST_FLAG_SET(death_test_style, "threadsafe");
    for (const char* name : {"ASAN_OPTIONS", "LSAN_OPTIONS", "TSAN_OPTIONS", "UBSAN_OPTIONS"}) unsetenv(name);
  }
};

#ifdef __SANITIZE_THREAD__

TEST_F(Sanitizers, ARaceIsFound) {
  const auto race = [] {
    int shared = 0;
    std::thread other([&] { ++shared; });
    ++shared;
    other.join();
    std::exit(0);
  };
  EXPECT_EXIT(race(), testing::ExitedWithCode(66), "data race");
}

#else

TEST_F(Sanitizers, MemoryThatWasFreedIsFound) {
  const auto use = [] {
    auto number = std::make_unique<int>(1);
    const volatile int* const freed = number.get();
    number.reset();
    return *freed;
  };
  EXPECT_DEATH(use(), "heap-use-after-free");
}

TEST_F(Sanitizers, UndefinedBehaviorIsFound) {
  const auto overflow = [] {
    volatile int number = INT_MAX;
    number = number + 1;
    std::exit(0);
  };
  EXPECT_DEATH(overflow(), "signed integer overflow");
}

TEST_F(Sanitizers, ALeakIsFound) {
  const auto leak = [] {
    for (int i = 0; i < 100; ++i) *static_cast<volatile char*>(std::malloc(1000)) = 1;
    std::exit(0);
  };
  EXPECT_DEATH(leak(), "detected memory leaks");
}

TEST_F(Sanitizers, AnIndexPastAVectorsSizeIsFound) {
  const auto index = [] {
    std::vector<int> numbers(1);
    numbers.reserve(2);
    numbers[1] = 1;
  };
  EXPECT_DEATH(index(), "__n < this->size()");
}

#endif

}  // namespace
}  // namespace evalbus
