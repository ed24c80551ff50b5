// Tests work in forked processes: the data that they see, what remains of them, and how they end.
#include "base/forked_work.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <stdexcept>

#include "base/errors.h"

namespace evalbus::forked_work_test {

// Returns the message of the error that CheckEnd() throws, which must be an Error.
template <class Error>
std::string EndOf(const std::function<void()>& work) {
  ForkedWork forked("work", work);
  while (!forked.HasEnded()) usleep(1000);
  try {
    forked.CheckEnd();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(ForkedWork, ReadsEarlierDataAndChangesOnlySharedMemory) {
  const SharedMemory memory(2 * sizeof(int));
  int* const shared = static_cast<int*>(memory.get());
  EXPECT_EQ(shared[0], 0);
  int own = 5;
  EXPECT_EQ(EndOf<std::exception>([&] { shared[1] = ++own; }), "");
  EXPECT_EQ(shared[1], 6);
  EXPECT_EQ(own, 5);
}

TEST(ForkedWork, WhatItThrowsIsThrownHere) {
  EXPECT_EQ(EndOf<InputError>([] { throw InputError("no such file"); }), "no such file");
  EXPECT_EQ(EndOf<EnvironmentError>([] { throw EnvironmentError("disk full"); }), "disk full");
  EXPECT_EQ(EndOf<std::runtime_error>([] { throw std::logic_error("bug"); }), "bug");
  // An error text that is longer than the shared memory is truncated.
  EXPECT_EQ(EndOf<InputError>([] { throw InputError(std::string(5000, 'x')); }), std::string(999, 'x'));
}

TEST(ForkedWork, ProcessThatDiesIsReported) {
  EXPECT_EQ(EndOf<EnvironmentError>([] { raise(SIGKILL); }), "work was ended by a signal: Killed");
  EXPECT_EQ(EndOf<EnvironmentError>([] { _exit(3); }), "work ended with exit code 3");
}

TEST(ForkedWork, IsKilledWithItsObject) {
  const SharedMemory memory(sizeof(pid_t));
  volatile pid_t* const process = static_cast<pid_t*>(memory.get());
  {
    ForkedWork forked("work", [&] {
      *process = getpid();
      while (true) pause();
    });
    while (*process == 0) usleep(1000);
    EXPECT_FALSE(forked.HasEnded());
    EXPECT_EQ(kill(*process, 0), 0);
  }
  EXPECT_EQ(kill(*process, 0), -1);
}

}  // namespace evalbus::forked_work_test
