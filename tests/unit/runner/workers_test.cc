#include "runner/workers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numeric>

#include "base/errors.h"
#include "base/run_layout.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::runner::workers_test {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::UnorderedElementsAre;

TEST(EpisodesOfWorker, AreSharedOutOnceEach) {
  const std::vector<int> episodes = {0, 1, 2, 3, 5, 8};
  EXPECT_THAT(EpisodesOfWorker(episodes, 0, 3), ElementsAre(0, 3));
  EXPECT_THAT(EpisodesOfWorker(episodes, 1, 3), ElementsAre(1));
  EXPECT_THAT(EpisodesOfWorker(episodes, 2, 3), ElementsAre(2, 5, 8));
  EXPECT_THAT(EpisodesOfWorker(episodes, 0, 1), episodes);
  EXPECT_THAT(EpisodesOfWorker({}, 0, 2), IsEmpty());
  EXPECT_THAT(EpisodesOfWorker({1}, 0, 2), IsEmpty());
}

TEST(OnlyOptions, HaveNoArgumentThatIsTooLong) {
  EXPECT_THAT(OnlyOptions({}), IsEmpty());
  EXPECT_THAT(OnlyOptions({3, 5}), ElementsAre("--only", "3,5"));
  std::vector<int> many(10'001);
  std::iota(many.begin(), many.end(), 1'000'000);
  const std::vector<std::string> options = OnlyOptions(many);
  ASSERT_EQ(options.size(), 4u);
  // 10,000 numbers of seven digits, and the commas between them.
  EXPECT_EQ(options[1].size(), 79'999u);
  EXPECT_TRUE(options[1].starts_with("1000000,1000001,")) << options[1].substr(0, 20);
  EXPECT_EQ(options[3], "1010000");
}

class WorkersListener : public RunListener {
 public:
  void OnEpisodeDone(const nlohmann::ordered_json& episode) override {
    done.push_back(episode["episode"].get<int>());
  }
  void OnRemark(const std::string& text) override { remarks.push_back(text); }

  std::vector<int> done;
  std::vector<std::string> remarks;
};

class EvaluateJobsTest : public testing::Test {
 protected:
  EvaluateJobsTest() { std::filesystem::create_directories(folder_.path() / kLogsFolder); }
  Job Shell(const std::string& name, const std::string& words) {
    return {name, {"/bin/sh", "-c", "cd " + folder_.path().string() + "; " + words}, run_.log_file(name)};
  }
  static std::string Finish(int episode) {
    return "echo '{\"episode\": " + std::to_string(episode) + "}' >> episodes.jsonl; ";
  }

  TemporaryFolder folder_;
  const results::RunFolder run_ = results::RunFolder::OfWorker(folder_.path());
  WorkersListener listener_;
};

TEST_F(EvaluateJobsTest, EpisodesAndRemarksArePassedOnOnce) {
  EvaluateJobs(
      {Shell("a", "echo noise; echo 'remark: odd'; " + Finish(0) + Finish(2)), Shell("b", Finish(1))}, 2,
      run_, &listener_);
  EXPECT_THAT(listener_.done, UnorderedElementsAre(0, 1, 2));
  EXPECT_THAT(listener_.remarks, ElementsAre("odd"));
}

TEST_F(EvaluateJobsTest, EarlierFilesAreNotReportedAgain) {
  EvaluateJobs({Shell("a", "echo 'remark: before'; " + Finish(0))}, 1, run_, &listener_);
  listener_ = {};
  EvaluateJobs({Shell("a", "echo 'remark: now'; " + Finish(1))}, 1, run_, &listener_);
  EXPECT_THAT(listener_.done, ElementsAre(1));
  EXPECT_THAT(listener_.remarks, ElementsAre("now"));
}

TEST_F(EvaluateJobsTest, AKilledWorkerIsRestartedWithARemark) {
  EvaluateJobs({Shell("a", "test -e again || { touch again; " + Finish(0) + "kill -9 $$; }; " + Finish(1))},
               1, run_, &listener_);
  EXPECT_THAT(listener_.done, ElementsAre(0, 1));
  ASSERT_EQ(listener_.remarks.size(), 1u);
  EXPECT_THAT(listener_.remarks[0], HasSubstr("retrying: "));
}

TEST_F(EvaluateJobsTest, AWorkerThatFailsEndsTheRunWithItsLastLine) {
  try {
    EvaluateJobs({Shell("a", "echo 'error: no space' >&2; exit 2")}, 1, run_, &listener_);
    FAIL();
  } catch (const EnvironmentError& error) {
    EXPECT_THAT(error.what(), HasSubstr("no space"));
  }
}

}  // namespace evalbus::runner::workers_test
