// Tests which runs are found in folders of runs, suites and plans.
#include "results/found_runs.h"

#include <gmock/gmock.h>

#include "base/errors.h"
#include "tests/unit/results/run_folders.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::results::found_runs_test {

namespace fs = std::filesystem;
using nlohmann::ordered_json;
using testing::ElementsAre;
using testing::HasSubstr;

class FoundRunsTest : public testing::Test {
 protected:
  static std::vector<std::string> Names(const FoundRuns& found) {
    std::vector<std::string> names;
    for (const FoundRun& run : found.runs) names.push_back(run.name);
    return names;
  }
  void WritePlan(const std::vector<std::string>& policies, const ordered_json& until = nullptr) {
    ordered_json plan = {{"policies", ordered_json::array()},
                         {"tasks", {"lift_pot/position", "lift_tray/base"}},
                         {"baseline", policies.front()},
                         {"until", until},
                         {"options", {{"episodes", 40}}}};
    for (const std::string& policy : policies) plan["policies"].push_back({{"name", policy}});
    WriteFile(plan_ / "plan.json", plan.dump());
  }
  void Begin(const fs::path& run) { WriteFile(plan_ / run / "run.json", "{}"); }

  TemporaryFolder folder_;
  const fs::path plan_ = folder_.path() / "plan";
};

TEST_F(FoundRunsTest, OfARunAndASuite) {
  WriteFile(plan_ / "run.json", "{}");
  EXPECT_THAT(Names(FindRuns(plan_)), ElementsAre("plan"));
  EXPECT_TRUE(IsEvaluation(plan_));
  EXPECT_FALSE(IsEvaluation(folder_.path()));
  const fs::path suite = folder_.path() / "suite";
  WriteFile(suite / "suite.json", R"({"runs": ["lift_pot-position", "lift_tray-base"]})");
  const FoundRuns found = FindRuns(suite);
  EXPECT_THAT(Names(found), ElementsAre("suite/lift_pot-position", "suite/lift_tray-base"));
  EXPECT_EQ(found.runs[1].folder, suite / "lift_tray-base");
  EXPECT_EQ(found.runs[1].policy, "");
  EXPECT_EQ(found.baseline, "");
}

// Until a run is merged, its finished shards are listed instead.
TEST_F(FoundRunsTest, OfAPlanWhoseShardsArriveAndAreMerged) {
  WritePlan({"a", "b"});
  EXPECT_TRUE(IsEvaluation(plan_));
  EXPECT_THAT(Names(FindRuns(plan_)), ElementsAre("a/lift_pot-position", "a/lift_tray-base",
                                                  "b/lift_pot-position", "b/lift_tray-base"));
  Begin("parts/b+lift_pot-position+0020-0039");
  Begin("parts/b+lift_pot-position+0000-0019");
  // A shard that is being copied and a shard of another policy are ignored.
  Begin("parts/.b+lift_pot-position+0040-0059.node7-1.coming");
  Begin("parts/bb+lift_pot-position+0040-0059");
  FoundRuns found = FindRuns(plan_);
  EXPECT_THAT(Names(found),
              ElementsAre("a/lift_pot-position", "a/lift_tray-base", "b+lift_pot-position+0000-0019",
                          "b+lift_pot-position+0020-0039", "b/lift_tray-base"));
  EXPECT_EQ(found.runs[2].policy, "b");
  EXPECT_EQ(found.runs[2].planned, 40);  // of the whole run, not only of the shard
  EXPECT_EQ(found.runs[2].folder, plan_ / "parts" / "b+lift_pot-position+0000-0019");
  EXPECT_EQ(found.baseline, "a");
  EXPECT_FALSE(found.is_sequential);
  Begin("b/lift_pot-position");
  EXPECT_THAT(Names(FindRuns(plan_)), ElementsAre("a/lift_pot-position", "a/lift_tray-base",
                                                  "b/lift_pot-position", "b/lift_tray-base"));
}

TEST_F(FoundRunsTest, APlanThatTestsWhileItRunsIsKnown) {
  WritePlan({"a", "b"}, {{"alpha", 0.05}, {"max", 200}});
  EXPECT_TRUE(FindRuns(plan_).is_sequential);
}

TEST_F(FoundRunsTest, APlanCannotLeadOutOfItsFolder) {
  for (const char* policy : {"..", "../elsewhere", "a/b", "", ".hidden"}) {
    WritePlan({policy});
    EXPECT_THROW(FindRuns(plan_), InputError) << policy;
  }
  WriteFile(plan_ / "plan.json", R"({"policies": [1]})");
  try {
    FindRuns(plan_);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("plan.json: not a plan"));
  }
}

}  // namespace evalbus::results::found_runs_test
