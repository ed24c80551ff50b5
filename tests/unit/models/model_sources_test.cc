// Tests files of assets and the tasks whose scenes need them.
#include "models/model_sources.h"

#include <gmock/gmock.h>

#include "models/task_description.h"
#include "models/task_family.h"
#include "tests/unit/models/models_test_util.h"

namespace evalbus::model_sources_test {

const SourceLocation kWhere{"t.yaml", 7};

TEST(AssetFiles, HaveAName) {
  EXPECT_TRUE(IsAssetFile("roboeval:props/cube.xml"));
  EXPECT_FALSE(IsAssetFile("../props/cube.xml"));
  EXPECT_FALSE(IsAssetFile("../props/a:b.xml"));
  EXPECT_FALSE(IsAssetFile(":cube.xml"));
}

TEST(AssetFiles, AreInTheFolderOfTheirName) {
  TempFolder folder;
  const auto file = folder.Write("cube.xml", "<mujoco/>");
  const ModelSources sources{.assets = {"other=/nowhere", "mine=" + folder.path().string()}};
  EXPECT_EQ(AssetFile("mine:cube.xml", kWhere, sources), file);
  EXPECT_EQ(ErrorOf([&] { AssetFile("mine:ball.xml", kWhere, sources); }),
            "t.yaml:7: --assets mine: file " + (folder.path() / "ball.xml").string() + " does not exist");
  EXPECT_EQ(ErrorOf([&] { AssetFile("yours:cube.xml", kWhere, sources); }),
            "t.yaml:7: 'yours:cube.xml' is not part of evalbus; pass the folder that contains it, with "
            "--assets yours=FOLDER");
  EXPECT_EQ(ErrorOf([&] { AssetFile("mine:cube.xml", kWhere, {.assets = {"mine"}}); }),
            "--assets: expected NAME=FOLDER, got 'mine'");
}

TEST(AssetFiles, FoldersBecomeAbsolute) {
  EXPECT_EQ(AbsoluteAssets({"a=."}),
            std::vector<std::string>{"a=" + (std::filesystem::current_path() / "").string()});
  EXPECT_EQ(ErrorOf([] { AbsoluteAssets({"a=/nowhere"}); }), "--assets a: /nowhere is not a folder");
  EXPECT_EQ(ErrorOf([] { AbsoluteAssets({"a="}); }), "--assets: expected NAME=FOLDER, got 'a='");
}

TEST(AssetTasks, HaveNamesOfTheirOwn) {
  const TaskSelection found = FindTask("roboeval/lift_pot/position");
  EXPECT_EQ(found.task.name, "roboeval_lift_pot");
  EXPECT_EQ(found.variation, "position");
  EXPECT_EQ(FindTask("roboeval_lift_pot/position").task.file, found.task.file);
  EXPECT_EQ(FindTask("roboeval/LiftPotPosition").variation, "position");
  EXPECT_EQ(FindTask("LiftPotPosition").task.name, "lift_pot");
  EXPECT_EQ(ErrorOf([] { FindTask("roboeval/lift_pt"); }),
            "unknown task 'roboeval/lift_pt'; did you mean 'roboeval_lift_pot'?");
  EXPECT_EQ(FamilyOf("roboeval_lift_pot"), "lift_pot");
  EXPECT_EQ(FamilyOf("lift_pot"), "lift_pot");
}

TEST(AssetTasks, NeedTheirAssets) {
  TaskDescription task = FindTask("roboeval/stack_two_blocks").task;
  EXPECT_THAT(ErrorOf([&] { task.FindAssets({}); }),
              testing::HasSubstr(
                  "stack_two_blocks.yaml:16: 'roboeval:roboeval/envs/xmls/props/table/table.xml' is "
                  "not part of evalbus; pass the folder that contains it, with --assets roboeval=FOLDER"));
}

// In both scenes, a task of one family has the same variations with ranges of the same size, and stages and
// distances with the same names.
TEST(AssetTasks, DifferInTheirScenesOnly) {
  const std::vector<TaskDescription> ours = AllTasks(), theirs = TasksOfAssets("roboeval");
  ASSERT_EQ(ours.size(), theirs.size());
  for (size_t i = 0; i < ours.size(); ++i) {
    SCOPED_TRACE(theirs[i].name);
    EXPECT_EQ(FamilyOf(theirs[i].name), ours[i].name);
    EXPECT_EQ(theirs[i].objects, ours[i].objects);
    EXPECT_EQ(theirs[i].time_limit, ours[i].time_limit);
    EXPECT_EQ(theirs[i].robot_base.position, ours[i].robot_base.position);
    ASSERT_EQ(theirs[i].variations.size(), ours[i].variations.size());
    for (size_t k = 0; k < ours[i].variations.size(); ++k) {
      const Variation &a = ours[i].variations[k], &b = theirs[i].variations[k];
      EXPECT_EQ(b.name, a.name);
      EXPECT_EQ(b.alias, a.alias);
      ASSERT_EQ(b.randomizations.size(), a.randomizations.size());
      for (size_t j = 0; j < a.randomizations.size(); ++j) {
        EXPECT_EQ(b.randomizations[j].index(), a.randomizations[j].index());
        if (const auto* box = std::get_if<SpawnBox>(&a.randomizations[j])) {
          EXPECT_EQ(std::get<SpawnBox>(b.randomizations[j]).half_extents, box->half_extents);
        } else if (const auto* plane = std::get_if<SpawnPlane>(&a.randomizations[j])) {
          EXPECT_EQ(std::get<SpawnPlane>(b.randomizations[j]).origin, plane->origin);
          EXPECT_EQ(std::get<SpawnPlane>(b.randomizations[j]).jitter, plane->jitter);
        } else if (const auto* yaw = std::get_if<SpawnYaw>(&a.randomizations[j])) {
          EXPECT_EQ(std::get<SpawnYaw>(b.randomizations[j]).bound, yaw->bound);
        }
      }
    }
    ASSERT_EQ(theirs[i].stages.size(), ours[i].stages.size());
    for (size_t k = 0; k < ours[i].stages.size(); ++k)
      EXPECT_EQ(theirs[i].stages[k].name, ours[i].stages[k].name);
    ASSERT_EQ(theirs[i].target_distance.size(), ours[i].target_distance.size());
    for (size_t k = 0; k < ours[i].target_distance.size(); ++k)
      EXPECT_EQ(theirs[i].target_distance[k].name, ours[i].target_distance[k].name);
  }
}

}  // namespace evalbus::model_sources_test
