#include "report/web/reader_threads.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <string>

namespace evalbus::report::reader_threads_test {

using namespace std::chrono_literals;

// Work that lasts until it is released, and the result that it reports.
class Work {
 public:
  bool AddTo(ReaderThreads* threads) {
    return threads->Add(
        [state = state_]() -> ReaderThreads::Report {
          state->started.set_value();
          state->go.get_future().wait();
          return [state](bool is_late) { state->told.set_value(is_late ? "late" : "done"); };
        },
        [state = state_] { state->given_up = true; });
  }
  void WaitUntilStarted() const { state_->started.get_future().wait(); }
  void LetGo() const { state_->go.set_value(); }
  std::string WaitUntilReported() const { return state_->told.get_future().get(); }
  bool is_given_up() const { return state_->given_up; }

 private:
  struct State {
    std::promise<void> started, go;
    std::promise<std::string> told;
    std::atomic<bool> given_up{false};
  };
  std::shared_ptr<State> state_ = std::make_shared<State>();
};

TEST(ReaderThreads, WorkThatHangsHoldsUpNoOther) {
  ReaderThreads threads({.at_once = 2});
  Work hanging;
  ASSERT_TRUE(hanging.AddTo(&threads));
  hanging.WaitUntilStarted();
  for (int i = 0; i < 5; ++i) {
    Work other;
    ASSERT_TRUE(other.AddTo(&threads));
    other.LetGo();
    EXPECT_EQ(other.WaitUntilReported(), "done");
  }
  EXPECT_FALSE(threads.Stop(0ms));
  hanging.LetGo();
  EXPECT_EQ(hanging.WaitUntilReported(), "done");
}

TEST(ReaderThreads, WorkThatTakesTooLongMakesRoom) {
  ReaderThreads threads({.at_once = 1, .timeout = 10s});
  Work hanging, next;
  ASSERT_TRUE(hanging.AddTo(&threads));
  hanging.WaitUntilStarted();
  ASSERT_TRUE(next.AddTo(&threads));
  const auto now = std::chrono::steady_clock::now();
  threads.Poll(now);
  EXPECT_FALSE(hanging.is_given_up());
  threads.Poll(now + 11s);
  EXPECT_TRUE(hanging.is_given_up());
  next.WaitUntilStarted();
  next.LetGo();
  EXPECT_EQ(next.WaitUntilReported(), "done");
  EXPECT_FALSE(next.is_given_up());
  hanging.LetGo();
  EXPECT_EQ(hanging.WaitUntilReported(), "late");
}

TEST(ReaderThreads, NothingIsStartedWhileTooManyAreStuck) {
  ReaderThreads threads({.at_once = 1, .waiting = 2, .timeout = 10s, .stuck = 1});
  Work hanging, waiting;
  ASSERT_TRUE(hanging.AddTo(&threads));
  hanging.WaitUntilStarted();
  const auto later = std::chrono::steady_clock::now() + 11s;
  threads.Poll(later);
  ASSERT_TRUE(waiting.AddTo(&threads));
  EXPECT_TRUE(Work().AddTo(&threads));
  EXPECT_FALSE(Work().AddTo(&threads)) << "too many wait";
  threads.Poll(later);
  EXPECT_TRUE(waiting.is_given_up());
  hanging.LetGo();
  EXPECT_EQ(hanging.WaitUntilReported(), "late");
  Work next;
  ASSERT_TRUE(next.AddTo(&threads));
  next.LetGo();
  EXPECT_EQ(next.WaitUntilReported(), "done");
}

TEST(ReaderThreads, StopsWhatPausesAndDropsWhatWaits) {
  ReaderThreads threads({.at_once = 1});
  std::promise<void> started;
  threads.Add(
      [&]() -> ReaderThreads::Report {
        started.set_value();
        while (threads.Pause(24h)) {
        }
        return [](bool) {};
      },
      [] {});
  Work waiting;
  ASSERT_TRUE(waiting.AddTo(&threads));
  started.get_future().wait();
  EXPECT_TRUE(threads.Stop(1h));
  EXPECT_FALSE(Work().AddTo(&threads));
}

}  // namespace evalbus::report::reader_threads_test
