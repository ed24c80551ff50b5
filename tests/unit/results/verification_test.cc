#include "results/verification.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/results/run_folders.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::results::verification_test {

using testing::Contains;
using testing::HasSubstr;
using testing::Not;

// Returns the result for a suite of one run, in which one of two episodes has finished.
Verification Verified(const std::string& summary) {
  const TemporaryFolder folder;
  const auto suite = folder.path() / "suite";
  WriteRun(suite / "run", RunInfo(2), {EpisodeLine(0)});
  WriteFile(suite / "suite.json", R"({"runs": ["run"]})");
  WriteFile(suite / "summary.json", summary);
  Verification result;
  VerifyNumbers(suite, &result);
  return result;
}

TEST(Verification, ASummaryOfAnInterruptedSuiteIsANote) {
  const Verification some = Verified("{}");
  EXPECT_THAT(some.findings, Not(Contains(HasSubstr("by_variation"))));
  EXPECT_THAT(some.notes, Contains(HasSubstr("0 of 1 tasks: the suite was interrupted")));
}

TEST(Verification, MissingManifestsAreOneNote) {
  const TemporaryFolder folder;
  const auto suite = folder.path() / "suite";
  WriteRun(suite / "run", RunInfo(1), {EpisodeLine(0)});
  WriteFile(suite / "suite.json", R"({"runs": ["run"]})");
  Verification result;
  VerifyHashes(suite, &result);
  EXPECT_THAT(result.notes,
              testing::ElementsAre(testing::StartsWith((suite / "manifest.json").string() + ": missing")));
}

TEST(Verification, AChangedSummaryIsAFinding) {
  EXPECT_THAT(Verified(R"({"by_variation": {"a": {}, "b": {}}})").findings,
              Contains(HasSubstr("2 tasks in by_variation, the suite has 1")));
}

}  // namespace evalbus::results::verification_test
