#include "runner/job_pool.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <thread>
#include <utility>

#include "base/errors.h"
#include "runner/workers.h"
#include "tests/deadline.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::runner::job_pool_test {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class JobPoolTest : public testing::Test {
 protected:
  // Returns a job that executes these shell commands in the test's folder.
  Job Shell(const std::string& name, const std::string& words) {
    return {name,
            {"/bin/sh", "-c", "cd " + folder_.path().string() + "; " + words},
            folder_.path() / (name + ".log")};
  }
  // Polls until all jobs are done; returns them in the order in which they ended.
  std::vector<std::string> Run(std::vector<Job> jobs, int at_once,
                               std::chrono::milliseconds timeout = std::chrono::seconds(60)) {
    JobPool pool(
        std::move(jobs), at_once, [this](const std::string& why) { restarts_.push_back(why); }, timeout);
    std::vector<std::string> ended;
    const auto give_up = std::chrono::steady_clock::now() + kDeadline;
    while (!pool.done() && std::chrono::steady_clock::now() < give_up) {
      if (const auto name = pool.Poll()) {
        ended.push_back(*name);
      } else {
        std::this_thread::yield();
      }
    }
    EXPECT_TRUE(pool.done());
    return ended;
  }
  bool Exists(const std::string& name) { return std::filesystem::exists(folder_.path() / name); }

  TemporaryFolder folder_;
  std::vector<std::string> restarts_;
};

TEST_F(JobPoolTest, OneAtATimeRunsInOrder) {
  // Each job tests for a file that the previous one wrote.
  EXPECT_THAT(Run({Shell("a", "touch a"), Shell("b", "test -e a && touch b"), Shell("c", "test -e b")}, 1),
              ElementsAre("a", "b", "c"));
}

TEST_F(JobPoolTest, AsManyAsWantedRunAtTheSameTime) {
  // Each job ends only after the other has started.
  const auto wait_for = [](const std::string& name) { return "until test -e " + name + "; do :; done"; };
  EXPECT_EQ(Run({Shell("a", "touch a; " + wait_for("b")), Shell("b", "touch b; " + wait_for("a"))}, 2).size(),
            2u);
}

TEST_F(JobPoolTest, LinesThatAJobPrintsAreReadBeforeItsEnd) {
  // The first line is printed in two parts. The rest exceeds a pipe's capacity. An unterminated last line is
  // ignored.
  JobPool pool({Shell("a",
                      "printf be; touch half; until test -e go; do :; done; echo gin; seq 20000; "
                      "printf end; echo log >&2"),
                Shell("b", "echo of b")},
               1, [](const std::string&) {});
  std::map<std::string, std::vector<std::string>> lines_at_end;
  std::vector<std::string> lines;
  pool.ReadOutput([&](const std::string& line) { lines.push_back(line); });
  const auto give_up = std::chrono::steady_clock::now() + kDeadline;
  while (!pool.done() && std::chrono::steady_clock::now() < give_up) {
    const bool is_half = Exists("half");
    if (const auto name = pool.Poll()) lines_at_end[*name] = std::exchange(lines, {});
    if (is_half) std::ofstream(folder_.path() / "go");
  }
  ASSERT_EQ(lines_at_end["a"].size(), 20001u);
  EXPECT_EQ(lines_at_end["a"].front(), "begin");
  EXPECT_EQ(lines_at_end["a"].back(), "20000");
  EXPECT_THAT(lines_at_end["b"], ElementsAre("of b"));
  std::ifstream log(folder_.path() / "a.log");
  std::string text;
  std::getline(log, text, '\0');
  EXPECT_EQ(text, "log\n");
}

TEST_F(JobPoolTest, OneThatIsKilledIsStartedAgain) {
  EXPECT_THAT(Run({Shell("a", "test -e a && exit 0; touch a; kill -9 $$")}, 1), ElementsAre("a"));
  EXPECT_THAT(restarts_, ElementsAre("a was ended by signal Killed"));
}

// Job b polls for a file that job a creates when it is retried. A job that polls is not considered hung.
TEST_F(JobPoolTest, OneThatHangsIsNamedAndStartedAgain) {
  EXPECT_THAT(Run({Shell("a", "test -e a && touch b && exit 0; touch a; kill -STOP $$"),
                   Shell("b", "until test -e b; do sleep 0.1; done")},
                  2, std::chrono::seconds(2)),
              testing::UnorderedElementsAre("a", "b"));
  EXPECT_THAT(restarts_, ElementsAre("a hung: no progress for 2 s"));
}

TEST_F(JobPoolTest, OutputBeforeAFailureIsNotTheReason) {
  try {
    Run({Shell("a", "echo 'bus udpm://239.255.76.67:7667'; exit 2")}, 1);
    FAIL();
  } catch (const EnvironmentError& error) {
    EXPECT_STREQ(error.what(), "a exited with code 2");
  }
}

TEST_F(JobPoolTest, ThreeStartsAreEnough) {
  EXPECT_THROW(Run({Shell("a", "echo x >> starts; kill -9 $$")}, 1), EnvironmentError);
  std::ifstream stream(folder_.path() / "starts");
  EXPECT_EQ(std::count(std::istreambuf_iterator<char>(stream), {}, '\n'), 3);
}

TEST_F(JobPoolTest, FailuresHaveTheWordsAndTheKindOfTheJob) {
  try {
    Run({Shell("a", "echo 'error: no such task' >&2; exit 1")}, 1);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(), "a: no such task");
  }
  try {
    Run({Shell("b", "echo 'error: the disk' >&2; exit 2")}, 1);
    FAIL();
  } catch (const EnvironmentError& error) {
    EXPECT_STREQ(error.what(), "b: the disk");
  }
}

TEST_F(JobPoolTest, RoutineLogLinesAreNotTheReason) {
  Run({Shell(
           "a",
           "test -e a && exit 0; touch a; echo '2026-11-22 05:41:09.521 [info] sim  e0  begins'; kill -9 $$"),
       Shell("b",
             "test -e b && exit 0; touch b; echo '2026-11-22 05:41:09.521 [error] sim  e0 t3  falls'; kill "
             "-9 $$"),
       Shell("c", "test -e c && exit 0; touch c; echo '6  success'; kill -9 $$")},
      1);
  EXPECT_THAT(restarts_,
              ElementsAre("a was ended by signal Killed", "b was ended by signal Killed: sim  e0 t3  falls",
                          "c was ended by signal Killed; its last line: 6  success"));
}

TEST(Workers, ShareTheEpisodes) {
  const std::vector<int> episodes = {0, 1, 2, 4, 5, 9};
  std::vector<int> all;
  for (int worker = 0; worker < 3; ++worker) {
    for (const int episode : EpisodesOfWorker(episodes, worker, 3)) {
      EXPECT_EQ(episode % 3, worker);  // an episode stays with its worker, whichever episodes are missing
      all.push_back(episode);
    }
  }
  EXPECT_THAT(all, testing::UnorderedElementsAreArray(episodes));
  EXPECT_THAT(EpisodesOfWorker({0, 3}, 1, 3), IsEmpty());
}

}  // namespace evalbus::runner::job_pool_test
