#include "export/episode_table.h"

#include <gtest/gtest.h>

#include "base/run_layout.h"
#include "results/verdicts.h"
#include "tests/unit/results/compare_fixture.h"

namespace evalbus::exports::episode_table_test {

using nlohmann::ordered_json;
using results::EpisodeSeed;
using results::Info;
using results::RecordedRuns;

class EpisodeTableTest : public results::CompareTest {};

TEST_F(EpisodeTableTest, HasOneLinePerEpisode) {
  ordered_json info = Info(2);
  info["policy"] = "ws://127.0.0.1:8000";
  info["policy_name"] = "ckpt-8000";
  info["robot"] = "/models/robots/single_panda.yaml";
  info["control_hz"] = 29.41176470588235;
  info["evalbus_version"] = "0.1.0";
  RecordedRuns run = Run("a,b", info, {true, false}, 0.1);
  ordered_json changed = run.runs[0].episodes[1].Json();
  changed["metrics"]["slip_count"] = 0.1 + 0.2;
  run.runs[0].episodes[1].text = changed.dump();
  changed = run.runs[0].episodes[0].Json();
  changed["metrics"].erase("subtask_progress");
  run.runs[0].episodes[0].text = changed.dump();
  EXPECT_EQ(
      EpisodeTable(run.runs),
      "run,policy,policy_name,task,variation,robot,control_hz,evalbus_version,episode,seed,end_reason,"
      "failure_reason,complete,completion_time,slip_count,success,"
      "extended.missing_ticks,subtask_progress\n"
      "\"a,b\",ws://127.0.0.1:8000,ckpt-8000,lift_pot,position,single_panda,29.41176470588235,0.1.0,0," +
          std::to_string(EpisodeSeed(7, 0)) +
          ",success,,1,0.1,0,1,0,\n"
          "\"a,b\",ws://127.0.0.1:8000,ckpt-8000,lift_pot,position,single_panda,29.41176470588235,0.1.0,1," +
          std::to_string(EpisodeSeed(7, 1)) + ",time_limit,timeout,1,0.11,0.30000000000000004,0,0,1\n");
}

TEST_F(EpisodeTableTest, StatesWhetherAStartWasSeenInTraining) {
  RecordedRuns run = Run("a", Info(2), {true, false}, 0.1);
  run.runs[0].episodes[0].seen_in_training = true;
  run.runs[0].episodes[1].seen_in_training = false;
  const std::string table = EpisodeTable(run.runs);
  EXPECT_NE(table.find(",complete,seen_in_training,completion_time,"), std::string::npos) << table;
  EXPECT_NE(table.find(",success,,1,1,0.1,"), std::string::npos) << table;
  EXPECT_NE(table.find(",timeout,1,0,0.11,"), std::string::npos) << table;
}

TEST_F(EpisodeTableTest, HasTheVerdictsOfOperators) {
  const RecordedRuns run = Run("a", Info(2), {true, false}, 0.1);
  std::filesystem::create_directory(run.runs[0].folder / kEpisodesFolder);
  results::WriteVerdict(run.runs[0].folder, {.episode = 1,
                                             .operator_name = "ann",
                                             .outcome = results::Outcome::kAbstain,
                                             .stages = 2,
                                             .rubric = 7.5});
  const std::string table = EpisodeTable(run.runs);
  EXPECT_NE(table.find(",verdict.ann,stages_reached.ann,rubric.ann\n"), std::string::npos) << table;
  EXPECT_NE(table.find(",,,\n"), std::string::npos) << table;
  EXPECT_TRUE(table.ends_with(",abstain,2,7.5\n")) << table;
}

}  // namespace evalbus::exports::episode_table_test
