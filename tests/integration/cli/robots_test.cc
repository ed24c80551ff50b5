// Tests robots that users define, and copies of tasks.
#include "tests/integration/harness.h"

namespace evalbus::robots_test {

namespace fs = std::filesystem;

// Returns bimanual_panda's YAML with one text replaced, as a file that finds its models from any folder.
std::string Robot(const fs::path& folder, const std::string& what = "", const std::string& with = "") {
  std::string text = ReadText(EVALBUS_SOURCE_DIR "/models/robots/bimanual_panda.yaml");
  const size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  WriteText(folder / "robot.yaml", text.replace(at, what.size(), with));
  return folder / "robot.yaml";
}

TEST(Robots, ListAndShow) {
  const Result list = RunProgram({"evalbus", "robots", "list"});
  EXPECT_EQ(list.code, 0) << list.err;
  EXPECT_NE(list.out.find("single_panda"), std::string::npos) << list.out;
  EXPECT_NE(list.out.find("left, right"), std::string::npos) << list.out;
  EXPECT_NE(list.out.find("unusable, 'evalbus robots check bimanual_panda_menagerie' prints the reason\n"),
            std::string::npos)
      << list.out;

  TemporaryFolder folder;
  const fs::path image = folder.path() / "robot.png";
  const Result show = RunProgram({"evalbus", "robots", "show", "single_panda", "--image", image});
  EXPECT_EQ(show.code, 0) << show.err;
  EXPECT_NE(show.out.find("joint4  -176 to -4 degrees, home -90"), std::string::npos) << show.out;
  EXPECT_NE(show.out.find("arm/hand/wrist"), std::string::npos) << show.out;
  EXPECT_EQ(ReadText(image).substr(1, 3), "PNG");
}

TEST(Robots, CheckHoldsThemAtHomeAndUsesTheirGrippers) {
  TemporaryFolder folder;
  const Result right = RunProgram({"evalbus", "robots", "check", Robot(folder.path())});
  EXPECT_EQ(right.code, 0) << right.err;
  EXPECT_NE(right.out.find("robot bimanual_panda is valid"), std::string::npos) << right.out;

  const auto error = [&](const std::string& what, const std::string& with) {
    const Result wrong = RunProgram({"evalbus", "robots", "check", Robot(folder.path(), what, with)});
    EXPECT_EQ(wrong.code, 1) << wrong.out;
    EXPECT_TRUE(wrong.err.starts_with("error: ")) << wrong.err;
    return wrong.err;
  };
  // First, the fingers press with 0.25 N/m x 20^2 (the gear) x 0.02 m / 2. Then, the arms overlap.
  EXPECT_NE(error("command_closed: 0", "position_gain_N_per_m: 0.25\n      command_closed: 0")
                .find("presses with 1 N per finger"),
            std::string::npos);
  EXPECT_NE(error("[0, -0.3, 0.6]", "[0, 0.2, 0.6]").find(" overlap by "), std::string::npos);
}

TEST(Robots, InATaskThatWasNotMadeForThem) {
  TemporaryFolder folder;
  std::string text = ReadText(EVALBUS_SOURCE_DIR "/models/robots/single_panda.yaml");
  const std::string name = "name: single_panda";
  WriteText(folder.path() / "mine.yaml", text.replace(text.find(name), name.size(), "name: mine"));
  const fs::path image = folder.path() / "scene.png";
  const Result shown = RunProgram({"evalbus", "tasks", "show", "stack_two_blocks", "--robot",
                                   folder.path() / "mine.yaml", "--image", image});
  EXPECT_EQ(shown.code, 0) << shown.err;
  EXPECT_NE(shown.out.find("mine (arm) at"), std::string::npos) << shown.out;
  EXPECT_NE(shown.out.find("red_cube_to_gripper"), std::string::npos) << shown.out;
  EXPECT_EQ(ReadText(image).substr(1, 3), "PNG");
}

// MuJoCo would clip such a command, for example one in millimeters.
TEST(Robots, ACommandBeyondTheActuatorsRangeIsRefused) {
  TemporaryFolder folder;
  const Result result = RunProgram(
      {"evalbus", "robots", "check", Robot(folder.path(), "command_open: 0.04", "command_open: 40")});
  EXPECT_EQ(result.code, 1) << result.out;
  EXPECT_NE(result.err.find("command_open is 40, expected 0 to 0.04, the range of its actuator\n"),
            std::string::npos)
      << result.err;
}

TEST(TasksNew, ACopyUnderANewNameRuns) {
  TemporaryFolder folder;
  const Program::Setting here{folder.path(), nullptr};
  const Result made = RunProgram({"evalbus", "tasks", "new", "my_pot", "--from", "lift_pot"}, here);
  EXPECT_EQ(made.code, 0) << made.err;
  std::string expected = ReadText(EVALBUS_SOURCE_DIR "/models/tasks/lift_pot.yaml");
  expected.replace(expected.find("name: lift_pot"), 14, "name: my_pot");
  EXPECT_EQ(ReadText(folder.path() / "my_pot.yaml"), expected);

  const Result run = RunProgram({"evalbus", "run", "my_pot.yaml", "--policy", "expert:lift_pot", "--episodes",
                                 "1", "--in-process", "--out", "run"},
                                here);
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_EQ(Episodes(folder.path() / "run").at(0)["end_reason"], "success");

  const Result again = RunProgram({"evalbus", "tasks", "new", "my_pot", "--from", "lift_pot"}, here);
  EXPECT_EQ(again.code, 1);
  EXPECT_EQ(again.err, "error: my_pot.yaml: exists; choose another name\n");
}

// If the expert finds no plan, the episode ends with policy_error, and its detail names the cause.
TEST(Robots, AnExpertWithoutAPlanReportsTheReason) {
  TemporaryFolder folder;
  const fs::path run = folder.path() / "run";
  std::string text = ReadText(EVALBUS_SOURCE_DIR "/models/tasks/lift_pot.yaml");
  const std::string base = "base: {position_m: [0.1, 0, 0]}";
  WriteText(folder.path() / "far.yaml",
            text.replace(text.find(base), base.size(), "base: {position_m: [-2, 0, 0]}"));
  Evaluate({folder.path() / "far.yaml", "--episodes", "1", "--in-process"}, run);
  const auto episode = Episodes(run).at(0);
  EXPECT_EQ(episode["end_reason"], "policy_error");
  EXPECT_NE(episode["end_detail"].get<std::string>().find("no plan: arm 'left' does not reach ("),
            std::string::npos)
      << episode["end_detail"];
  ExpectLogged(run, "policy", "warning", "no plan: arm 'left' does not reach (");
}

}  // namespace evalbus::robots_test
