// Tests which obstacles prevent a plan and which do not.
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "policy_bridge/planning/robot.h"
#include "tests/unit/policy_bridge/expert_play.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::policy::no_plan_test {

namespace fs = std::filesystem;

std::string ReadText(const fs::path& file) {
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), {}};
}

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

// A copy of lift_pot with one change, in its own folder.
struct ChangedTask {
  ChangedTask(const std::string& from, const std::string& to) {
    std::ofstream(file) << Replaced(ReadText(TasksFolder() / "lift_pot.yaml"), from, to);
  }
  TemporaryFolder folder;
  fs::path file = folder.path() / "changed.yaml";
};

// Plays an episode with the expert. Returns its planning error, or "played N s" if there was none.
std::string ErrorOfExpert(const std::string& task) {
  ExpertStage stage(task);
  try {
    const PlayedEpisode played = stage.Play(0);
    return "played " + std::to_string(played.time) + " s";
  } catch (const std::runtime_error& error) {
    return error.what();
  }
}

TEST(NoPlan, ReportsUnreachablePoses) {
  const ChangedTask task("base: {position_m: [0.1, 0, 0]}", "base: {position_m: [-1.9, 0, 0]}");
  // The hand moves to 9 cm above the left handle's bar, which is at (0, 0.234, 0.041) m in the pot's frame.
  // The pot is at (0.7, 0, 0.996).
  EXPECT_EQ(ErrorOfExpert(task.file),
            "no plan: arm 'left' does not reach (0.700, 0.234, 1.127) m, on the path that got farthest");
}

TEST(NoPlan, ReportsWhatTouchesTheRobotAtHome) {
  // The counter begins at x = 0.5 m. The first links, of radius 63 mm, end 1 mm before it.
  const ChangedTask task("base: {position_m: [0.1, 0, 0]}", "base: {position_m: [0.436, 0, 0]}");
  const std::string error = ErrorOfExpert(task.file);
  EXPECT_EQ(error,
            "no plan: left/link1 is 1 mm from left_cabinet/counter, expected a distance of 3 mm, in the "
            "robot's current pose");
}

// In Menagerie's Panda, the base is 1 mm from the first link, and no <exclude> lists this pair.
TEST(NoPlan, NeighborsThatNearlyTouchAtHomeAreNoObstacles) {
  TemporaryFolder folder;
  fs::copy(ModelsFolder() / "robots", folder.path(), fs::copy_options::recursive);
  std::string arm = ReadText(folder.path() / "panda/panda.xml");
  arm = Replaced(arm, "<exclude body1=\"link0\" body2=\"link1\"/>", "");
  // With this change, the capsule ends 1 mm above the base's box.
  arm = Replaced(arm, "fromto=\"0 0 -0.19 0 -0.018 -0.06\"", "fromto=\"0 0 -0.189 0 -0.018 -0.06\"");
  std::ofstream(folder.path() / "panda/panda.xml") << arm;
  ExpertStage stage("lift_pot", folder.path() / "bimanual_panda.yaml");
  stage.ExpectSuccess(0);
}

TEST(NoPlan, TouchesAreInMillimeters) {
  const TaskSelection selection = FindTask("lift_pot");
  const RobotDescription robot = LoadRobot(selection.task.robot_file);
  const Scene scene = BuildScene(selection.task, robot);
  const ContactProbe probe(*scene.physics, scene.info, 0.003);
  const auto geom = [&](const char* name) { return mj_name2id(scene.physics.get(), mjOBJ_GEOM, name); };
  const int base = geom("left/link0"), hand = geom("right/hand/hand");
  ASSERT_GE(std::min(base, hand), 0);
  EXPECT_EQ(probe.InWords({base, hand, 0.00099}),
            "left/link0 is 0.99 mm from right/hand/hand, expected a distance of 3 mm");
  EXPECT_EQ(probe.InWords({base, hand, -0.0125}),
            "left/link0 is 12.5 mm inside right/hand/hand, expected a distance of 3 mm");
}

}  // namespace evalbus::policy::no_plan_test
