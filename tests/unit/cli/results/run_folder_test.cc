// What other processes say goes into results as it is, whatever its bytes are.
#include "cli/results/run_folder.h"

#include <gtest/gtest.h>

#include <fstream>

#include "base/errors.h"
#include "cli/results/episode_json.h"
#include "cli/results/rescorer.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::results {
namespace {

// "Stöße" in Latin-1.
constexpr char kLatin1[] =
    "St\xF6\xDF"
    "e";

TEST(RunFolder, WordsThatAreNoUtf8AreWrittenWithReplacements) {
  TemporaryFolder folder;
  const RunFolder run = RunFolder::OfWorker(folder.path());
  episode_summary_t summary{};
  summary.end_reason = "policy_error";
  summary.end_detail = kLatin1;
  run.AddEpisode(0, EpisodeJson("task", "base", summary));
  const auto episodes = run.SortEpisodes();
  ASSERT_EQ(episodes.size(), 1u);
  EXPECT_EQ(episodes[0]["end_detail"],
            "St\uFFFD\uFFFD"
            "e");
}

TEST(RunFolder, EpisodesAreNumberedByIntegers) {
  TemporaryFolder folder;
  std::ofstream(folder.path() / "episodes.jsonl") << "{\"episode\": -1e308}\n";
  EXPECT_THROW(RunFolder::OfWorker(folder.path()).SortEpisodes(), InputError);
}

TEST(Rescore, WordsThatAreNoUtf8AreCompared) {
  episode_summary_t before{}, after{};
  after.end_detail = kLatin1;
  const auto differences = Differences(before, after);
  ASSERT_EQ(differences.size(), 1u);
  EXPECT_EQ(differences[0].after,
            "\"St\uFFFD\uFFFD"
            "e\"");
}

}  // namespace
}  // namespace evalbus::results
