// Any wrong input makes a command fail with one line that names the culprit, and with the right exit code.
// The command leaves no files.
#include <algorithm>

#include "tests/integration/harness.h"

namespace evalbus::bad_input_test {

namespace fs = std::filesystem;

class BadInput : public testing::Test {
 protected:
  BadInput() { fs::create_directory(work_); }

  // Runs the command in an empty folder. The error must contain each of `words`.
  void Expect(int code, const std::vector<std::string>& command, const std::vector<std::string>& words) {
    SCOPED_TRACE(testing::PrintToString(command));
    const Result result = RunProgram(command, {work_, nullptr});
    EXPECT_EQ(result.code, code) << result.out << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_TRUE(result.err.starts_with("error: ")) << result.err;
    for (const std::string& word : words) EXPECT_NE(result.err.find(word), std::string::npos) << result.err;
    EXPECT_TRUE(fs::is_empty(work_)) << fs::directory_iterator(work_)->path();
  }
  // Runs `evalbus run` in several processes, if there is a bus for tests, and in one process. Only the run in
  // one process is repeated with --out.
  void ExpectRun(int code, std::vector<std::string> arguments, const std::vector<std::string>& words) {
    arguments.insert(arguments.begin(), {"evalbus", "run"});
    if (WhyNoBus().empty()) Expect(code, arguments, words);
    arguments.push_back("--in-process");
    Expect(code, arguments, words);
    arguments.insert(arguments.end(), {"--out", "mine"});
    Expect(code, arguments, words);
  }
  // Returns lift_pot's YAML with one text replaced.
  std::string Task(const std::string& what, const std::string& with) {
    const std::string file = ShortTask(folder_.path(), 1);
    std::string text = ReadText(file);
    const size_t at = text.find(what);
    EXPECT_NE(at, std::string::npos) << what;
    WriteText(file, text.replace(at, what.size(), with));
    return file;
  }
  std::string File(const std::string& name, const std::string& text) {
    WriteText(folder_.path() / name, text);
    return folder_.path() / name;
  }

  TemporaryFolder folder_;
  const fs::path work_ = folder_.path() / "work";
};

TEST_F(BadInput, ImagesThatWouldBeSomethingElse) {
  Expect(1, {"evalbus", "tasks", "show", "lift_pot", "--image", "x.jpg"}, {"--image x.jpg", ".png"});
}

TEST_F(BadInput, OptionsWithoutTheOneThatTheyBelongTo) {
  for (const char* const option : {"--camera", "--size", "--seed"}) {
    Expect(1, {"evalbus", "tasks", "show", "lift_pot", option, "1"},
           {std::string(option) + " requires --image"});
  }
  Expect(1, {"evalbus", "robots", "show", "single_panda", "--camera", "front"},
         {"--camera requires --image"});
  Expect(1, {"evalbus", "score", "map.yaml", "data.csv", "--collision-sample-window", "20"},
         {"map.yaml: --collision-sample-window requires a trajectory"});
}

TEST_F(BadInput, UnknownNames) {
  ExpectRun(1, {"lift_pt"}, {"lift_pt", "lift_pot"});
  ExpectRun(1, {"lift_pot/postion"}, {"postion", "position"});
  ExpectRun(1, {"lift_pot", "--policy", "exprt"}, {"exprt", "did you mean 'expert'"});
  // The error is reported before the line that announces the run.
  EXPECT_EQ(RunProgram({"evalbus", "run", "lift_pot", "--policy", "exprt"}).out, "");
  ExpectRun(1, {"lift_pot", "--robot", "none.yaml"}, {"none.yaml"});
  ExpectRun(1, {"none.yaml"}, {"none.yaml"});
}

TEST_F(BadInput, CommandLine) {
  Expect(1, {"evalbus", "fly"}, {"fly"});
  Expect(1, {"evalbus", "run"}, {"task"});
  ExpectRun(1, {"lift_pot", "--color", "red"}, {"--color"});
  ExpectRun(1, {"lift_pot", "--control-hz", "4"}, {"--control-hz", "5", "500"});
  ExpectRun(1, {"lift_pot", "--control-hz", "nan"}, {"--control-hz"});
  ExpectRun(1, {"lift_pot", "--episodes", "0"}, {"--episodes: expected 1 to 10000000, got 0"});
  ExpectRun(1, {"lift_pot", "--episodes", "many"}, {"--episodes", "many"});
  ExpectRun(1, {"lift_pot", "--episodes", "2147483647"}, {"--episodes: expected 1 to 10000000"});
  ExpectRun(1, {"lift_pot", "--workers", "1000000000"}, {"--workers: expected 1 to 1024"});
  ExpectRun(1, {"lift_pot", "--seed", "x"}, {"--seed"});
  ExpectRun(1, {"lift_pot", "--seed", "3", "--seed", "4"}, {"--seed: expected at most 1, got 2 (see "});
  ExpectRun(1, {"lift_pot", "--realtime", "--rtf", "fast"}, {"--rtf: expected a number, not 'fast' (see "});
  for (const char* wrong : {"9223372036854775808", "-9223372036854775809", "", "0x10", "010"}) {
    ExpectRun(1, {"lift_pot", "--seed", wrong},
              {"--seed: expected a whole number of at most 64 bits, not '"});
    Expect(1, {"evalbus-sim", "lift_pot", "--seed", wrong}, {"--seed: expected a whole number"});
  }
  ExpectRun(1, {"lift_pot", "--only", ""}, {"--only"});
  Expect(1, {"evalbus", "verify", "run", "--write", "--hashes"}, {" cannot be combined with --"});
  Expect(1, {"evalbus", "run", "lift_pot", "--in-process", "--resume"}, {"--resume requires --out"});
  Expect(1, {"evalbus", "run", "lift_pot/all", "--resume"}, {"--resume requires --out"});
  ExpectRun(1, {"lift_pot", "--realtime", "--rtf", "0"}, {"--rtf"});
  ExpectRun(1, {"lift_pot", "--rtf", "2"}, {"--rtf", "--realtime"});
  ExpectRun(1, {"lift_pot", "--policy-timeout-s", "0"}, {"--policy-timeout-s"});
}

TEST_F(BadInput, Url) {
  Expect(1, {"evalbus", "run", "lift_pot", "--url", "garbage"}, {"garbage", "udpm://"});
  Expect(1, {"evalbus", "run", "lift_pot", "--url", "memq://"}, {"memq://", "udpm://"});
  Expect(1, {"evalbus", "run", "lift_pot", "--url", "udpm://239.255.76.67:7667", "--in-process"}, {"--url"});
  Expect(1, {"evalbus", "run", "lift_pot/base", "lift_pot/position", "--url", "udpm://239.255.76.67:7667"},
         {"--url: expected one task; each run of a suite has its own bus"});
  Expect(2, {"evalbus", "run", "lift_pot", "--url", "udpm://10.0.0.1:99"}, {"udpm://10.0.0.1:99"});
  for (const char* program : {"evalbus-metrics", "evalbus-collision", "evalbus-policy"}) {
    Expect(1, {program, "--url", "garbage"}, {"garbage", "udpm://"});
    Expect(1, {program}, {"--url"});
  }
}

TEST_F(BadInput, Out) {
  fs::create_directory(folder_.path() / "taken");
  const std::string file = File("taken/file", "mine");
  Expect(1, {"evalbus", "run", "lift_pot", "--in-process", "--out", folder_.path() / "taken"}, {"taken"});
  EXPECT_EQ(ReadText(file), "mine");
  Expect(1, {"evalbus", "run", "lift_pot", "--in-process", "--out", file}, {"taken/file"});
  Expect(1, {"evalbus", "run", "lift_pot", "--in-process", "--out", file + "/below"}, {"taken/file/below"});
  EXPECT_EQ(ReadText(file), "mine");
}

TEST_F(BadInput, FailureInAnEmptyFolderOfTheUsersLeavesItEmpty) {
  const fs::path empty = folder_.path() / "empty";
  fs::create_directory(empty);
  Expect(1, {"evalbus", "run", "lift_pot", "--in-process", "--policy", "none", "--out", empty}, {"none"});
  EXPECT_TRUE(fs::is_empty(empty));
}

TEST_F(BadInput, TaskFiles) {
  ExpectRun(1, {Task("time_limit_s", "time_limit")}, {"short_pot.yaml", "time_limit", "time_limit_s"});
  ExpectRun(1, {Task("time_limit_s: 1", "time_limit_s: soon")}, {"short_pot.yaml", "time_limit_s", "soon"});
  ExpectRun(1, {Task("objects: [pot]", "objects: [pan]")}, {"short_pot.yaml", "pan"});
  ExpectRun(1, {Task("holding: {gripper: left", "grasping: {gripper: left")}, {"grasping"});
  ExpectRun(1, {Task("props/pot/pot.xml", "props/pot/pan.xml")}, {"pan.xml"});
  ExpectRun(1, {Task("scene:", "scene: [")}, {"short_pot.yaml"});
  ExpectRun(1, {File("empty.yaml", "")}, {"empty.yaml"});
}

TEST_F(BadInput, TaskFilesThatNoMessageCanCarry) {
  using namespace std::string_literals;
  const std::string nul = Task("scene:", "# what PowerShell wrote: \0\nscene:"s);
  ExpectRun(1, {nul}, {"short_pot.yaml:", "a NUL byte; expected text in UTF-8"});
  Expect(1, {"evalbus", "tasks", "check", nul}, {"short_pot.yaml:", "a NUL byte; expected text in UTF-8"});
  const std::string utf16 = File("utf16.yaml", "\xFF\xFEn\0a\0m\0e\0:\0 \0x\0"s);
  ExpectRun(1, {utf16}, {"utf16.yaml:1: this is UTF-16"});
  Expect(1, {"evalbus", "tasks", "check", utf16}, {"utf16.yaml:1: this is UTF-16"});
}

TEST_F(BadInput, TaskCheckTestsStartsAndLimits) {
  const auto expect = [&](const std::string& what, const std::string& with, const std::string& line_of,
                          const std::string& message) {
    const std::string file = Task(what, with);
    const std::string text = ReadText(file);
    const auto line =
        1 + std::count(text.begin(), text.begin() + static_cast<long>(text.find(line_of)), '\n');
    Expect(1, {"evalbus", "tasks", "check", file}, {file + ":" + std::to_string(line) + ": " + message});
  };
  const std::string base = "base: {position_m: [0.1, 0, 0]}", pot = "pose: {position_m: [0.7, 0, 0.996]}";
  // The counter's top is at 0.859 m. The pot's bottom is 0.137 m below its origin, so it is 9 mm too low
  // here.
  expect(pot, "pose: {position_m: [0.7, 0, 0.987]}", "  base:\n    alias",
         "variation 'base': after a reset with seed 0, pot is ");
  expect("center_m: [0.735, 0], half_extents_m: [0.02, 0.15]",
         "center_m: [0.1, 0.3], half_extents_m: [0.01, 0.01]", "  position:\n",
         "variation 'position': none of 1000 draws keeps all parts apart; in the last one, pot is ");
  expect("min_m: 1.096", "min_m: 0.5", "  base:\n    alias",
         "variation 'base': success is already true after a reset with seed 0");
  expect("      - spawn_yaw: &yaw {object: pot, bound_deg: 30}",
         "      - mass: {of: [pot], min_factor: 1, max_factor: 2}\n"
         "      - mass: {of: [pot], min_factor: 1, max_factor: 2}\n"
         "      - spawn_yaw: &yaw {object: pot, bound_deg: 30}",
         "  orientation:\n", "variation 'orientation': two entries of 'randomize' draw 'pot_mass_factor'");
  // This position is inside the left cabinet.
  expect(base, "base: {position_m: [0.8, 0, 0]}", "  base:\n    alias",
         "variation 'base': after a reset with seed 0, ");
  expect("max_deg: 20", "max_deg: 120", "max_deg: 120",
         "key 'max_deg': expected a number in [0, 90], got '120'");
  expect("{gripper: left, object: pot}", "{gripper: left, object: pott}", "object: pott",
         "nothing has the name 'pott'; did you mean 'pot'?");
}

TEST_F(BadInput, TaskCheckWarnsOfUnknownRobots) {
  const std::string file =
      Task("success:", "other_robots: {singel_panda: {target_distance: {lift: {object: pot}}}}\nsuccess:");
  const Result result = RunProgram({"evalbus", "tasks", "check", file});
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(result.err,
            "warning: other_robots: no robot of evalbus has the name 'singel_panda'; did you mean "
            "'single_panda'?\n");
}

TEST_F(BadInput, FilesAndFoldersThatAreNoRun) {
  for (const char* runs : {"runs/nope", "nope"}) {
    Expect(1, {"evalbus", "judge", runs}, {std::string(runs) + ": no such run folder"});
    Expect(1, {"evalbus", "judge", runs, "--operator", "anna"}, {": no such run folder"});
  }
  Expect(1, {"evalbus", "web", File("plan.yaml", "policies: [expert]\n")},
         {"plan.yaml: not the folder of a run, a suite or a plan"});
}

TEST_F(BadInput, ExecutionsOfLatency) {
  Expect(1, {"evalbus", "latency", "lift_pot", "--execution", "foo"},
         {"--execution: expected synchronous, asynchronous, rtc, or all, got 'foo'"});
}

// The options are read before the heading of the table is printed.
TEST_F(BadInput, OptionsOfASource) {
  Expect(1, {"evalbus", "watch", "lift_pot", "--gripper", "left=ajar"},
         {"--gripper left=ajar: expected left=open or left=closed"});
  Expect(1,
         {"evalbus", "watch", "lift_pot", "--map",
          File("map.yaml", "joints: {unit: rad, columns: {left/joint9: a}}\n")},
         {"there is no joint 'left/joint9'"});
  EXPECT_EQ(RunProgram({"evalbus", "watch", "lift_pot", "--gripper", "left=ajar"}, {work_, nullptr}).out, "");
}

TEST_F(BadInput, ModelFiles) {
  const std::string pot = std::string(EVALBUS_SOURCE_DIR) + "/models/props/pot/pot.xml";
  const std::string text = ReadText(pot);
  const auto task = [&] { return Task(pot, folder_.path() / "bad.xml"); };
  File("bad.xml", text.substr(0, text.size() / 2));
  ExpectRun(1, {task()}, {"bad.xml"});
  File("bad.xml", "<mujoco><worldbody><body><geom type=\"blob\"/></body></worldbody></mujoco>");
  ExpectRun(1, {task()}, {"blob"});
  File("bad.xml", "");
  ExpectRun(1, {task()}, {"bad.xml"});
}

TEST_F(BadInput, Replay) {
  ExpectRun(1, {"lift_pot", "--policy", "replay:/nowhere"}, {"/nowhere"});
  ExpectRun(1, {"lift_pot", "--policy", "replay"}, {"replay"});
  ExpectRun(1, {"lift_pot", "--policy", "replay:" + File("damaged.lcmlog", std::string(5000, 'x'))},
            {"replay", "damaged.lcmlog: damaged: 5000 bytes"});
}

TEST_F(BadInput, Score) {
  Expect(1, {"evalbus", "score", "nowhere.json"}, {"nowhere.json"});
  Expect(1, {"evalbus", "score", File("broken.json", "{\"name\": ")}, {"broken.json"});
  Expect(1, {"evalbus", "score", File("list.json", "[]")}, {"list.json"});
  const std::string good = ReadText(EVALBUS_SOURCE_DIR "/tests/data/vectors/stationary.json");
  std::string wrong = good;
  wrong.replace(wrong.find("\"control_frequency\""), 19, "\"control_freqency\"");
  Expect(1, {"evalbus", "score", File("key.json", wrong)}, {"key.json", "control_freq"});
  Expect(1, {"evalbus", "score", folder_.path()}, {folder_.path()});
}

}  // namespace evalbus::bad_input_test
