#include "cli/launch/run_controller.h"

#include <gtest/gtest.h>

#include "base/random.h"
#include "bus/channels.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::launch {
namespace {

TEST(RunController, MissedDeadlinesAreInTheEpisodesLine) {
  TemporaryFolder folder;
  const results::RunFolder run = results::RunFolder::OfWorker(folder.path());
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

}  // namespace
}  // namespace evalbus::launch
