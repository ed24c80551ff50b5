// What other processes say goes into results as it is, whatever its bytes are.
#include "cli/run_folder.h"

#include <gtest/gtest.h>

#include <fstream>

#include "bus/channels.h"
#include "bus/errors.h"
#include "cli/rescore.h"
#include "cli/run_controller.h"
#include "sim/episode_seed.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus {
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

TEST(RunController, MissedDeadlinesAreInTheEpisodesLine) {
  TemporaryFolder folder;
  const RunFolder run = RunFolder::OfWorker(folder.path());
  RunPlan plan;
  plan.episodes = {0};
  plan.realtime = true;
  Bus bus("memq://");
  RunListener nobody;
  RunController controller(&bus, plan, run, &nobody);
  model_info_t model{};
  model.physics_file = run.path() / "model/physics.mjb";
  bus.Publish(channels::kModel, model);
  episode_begin_t begin{};
  begin.seed = EpisodeSeed(plan.seed, 0);
  bus.Publish(channels::kEpisodeBegin, begin);
  episode_end_t end{};
  end.end_reason = "time_limit";
  bus.Publish(channels::kEpisodeEnd, end);
  episode_summary_t summary{};
  summary.seed = begin.seed;
  summary.end_reason = end.end_reason;
  summary.extended.deadline_misses = 3;
  bus.Publish(channels::kEpisodeSummary, summary);
  component_status_t recorder{};
  recorder.component = "recorder";
  recorder.last_finished_episode = 0;
  bus.Publish(channels::kStatus, recorder);
  while (bus.Handle()) {
  }
  ASSERT_TRUE(controller.done());
  EXPECT_EQ(run.SortEpisodes()[0]["pacing"]["deadline_misses"], 3);
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
}  // namespace evalbus
