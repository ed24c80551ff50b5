// Tests `evalbus score`: scores of a small episode, files that are read step by step, and errors for invalid
// files.
#include "metrics/episode/score_file.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <string>

#include "base/errors.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::metrics::score_file_test {

using nlohmann::json;

json SmallEpisode() {
  return json::parse(R"({
    "robot": {"arms": ["left"], "dof": 2}, "control_frequency": 50, "control_dt": 0.02,
    "config": {"track_vel_sync": true, "track_vertical_sync": true, "track_slippage": true,
      "track_collisions": true, "track_cartesian_jerk": true, "track_joint_jerk": true,
      "track_cartesian_path_length": true, "track_joint_path_length": true,
      "track_orientation_path_length": true, "slip_sample_window": 1, "slip_objects": ["pot"]},
    "geoms": {"count": 3, "robot": [0], "scene": [1], "ignored": [2]},
    "initial": {"left": {"gripper_opening": 0.5, "holding": {"pot": true}}},
    "steps": [
      {"t": 0.02, "left": {"joint_position": [0, 0], "joint_velocity": [0, 0], "wrist_position": [0, 0, 0],
        "wrist_quaternion": [1, 0, 0, 0], "gripper_opening": 0.5, "holding": {"pot": false}}, "contacts": [[0, 1, 0]]},
      {"t": 0.04, "left": {"joint_position": [3, 4], "joint_velocity": [0, 0], "wrist_position": [0, 0, 2],
        "wrist_quaternion": [0, 1, 0, 0], "gripper_opening": 0.5, "holding": {"pot": false}}, "contacts": []}],
    "stages": [{"step": 0, "stage": 2, "reached": true}],
    "finalize": {"success": true, "target_distance": {"lift": 0.5}, "pose_error": 0.25}})");
}

TEST(ScoreFile, ScoresASmallEpisodeByHand) {
  const auto result = ScoreEpisode(SmallEpisode(), "small.json");

  EXPECT_EQ(
      result.dump(),
      R"({"success":1.0,"completion_time":0.04,"task_stage_reached":{"2":true},"subtask_progress":0.5,)"
      R"("target_distance":{"lift":0.5},"object_pose_error":0.25,"slip_count":1,)"
      R"("slip_count_per_object":{"object_1":1},"env_collision_count":1,"self_collision_count":0,)"
      R"("cartesian_path_length":2.0,"joint_path_length":5.0,"orientation_path_length":3.141592653589793,)"
      R"("avg_cartesian_jerk":0.0,"rms_cartesian_jerk":0.0,"avg_joint_jerk":0.0,"rms_joint_jerk":0.0})");
}

// RoboEval's result contains the value that was passed, even if it is an empty dictionary.
TEST(ScoreFile, AnEmptySetOfFinalValuesIsOne) {
  json episode = SmallEpisode();
  episode["finalize"]["target_distance"] = json::object();
  episode["finalize"]["pose_error"] = nullptr;
  json result = ScoreEpisode(episode, "small.json");
  EXPECT_EQ(result["target_distance"], json::object());
  EXPECT_FALSE(result.contains("object_pose_error"));
  episode["finalize"]["pose_error"] = json::object();
  result = ScoreEpisode(episode, "small.json");
  EXPECT_EQ(result["object_pose_error"], json::object());
}

class LongFile : public testing::Test {
 protected:
  // Writes the small episode with this many steps and the keys in this order.
  std::filesystem::path Write(int steps, const std::vector<std::string>& keys) {
    const json small = SmallEpisode();
    const auto file = folder_.path() / "long.json";
    std::ofstream out(file);
    out << "{";
    for (const std::string& key : keys) {
      out << (key == keys[0] ? "" : ",") << json(key) << ":";
      if (key != "steps") {
        out << small[key];
        continue;
      }
      out << "[";
      for (int k = 0; k < steps; ++k) {
        json step = small["steps"][k % 2];
        step["t"] = 0.02 * (k + 1);
        out << (k == 0 ? "" : ",\n") << step;
      }
      out << "]";
    }
    out << "}";
    return file;
  }
  static void Replace(const std::filesystem::path& file, const std::string& from, const std::string& to) {
    std::ifstream in(file);
    std::string text{std::istreambuf_iterator<char>(in), {}};
    size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    for (; at != std::string::npos; at = text.find(from, at + to.size())) text.replace(at, from.size(), to);
    std::ofstream(file) << text;
  }
  const std::vector<std::string> keys_ = {"robot",   "control_frequency", "control_dt", "config",
                                          "geoms",   "initial",           "steps",      "stages",
                                          "finalize"};
  TemporaryFolder folder_;
};

TEST_F(LongFile, IsScoredStepByStepAsItIsRead) {
  // At most one step is stored. Memory and the work per step therefore do not grow with the number of steps.
  const auto elements_at_once = [](const std::filesystem::path& file) {
    size_t most = 0;
    ReadJsonFile(file, "steps", [&](const json& so_far, const json&) {
      most = std::max(most, so_far["steps"].size());
      return so_far.contains("robot");
    });
    return most;
  };
  const auto file = Write(1000, keys_);
  EXPECT_EQ(elements_at_once(file), 1u);
  const auto streamed = ScoreFile(file);
  EXPECT_EQ(streamed, ScoreEpisode(ReadJsonFile(file), "long.json"));
  EXPECT_EQ(streamed["completion_time"], 20.0);

  // If the keys that the steps need come later, only the first step is offered while the file is read.
  std::vector<std::string> other = keys_;
  std::swap(other.front(), other[6]);
  EXPECT_EQ(ScoreFile(Write(1000, other)), streamed);
}

TEST_F(LongFile, MemoryDoesNotGrowWithTheNumberOfSteps) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "the sanitizer keeps freed memory";
#endif
  const auto peak_kb = [] {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return usage.ru_maxrss;
  };
  ScoreFile(Write(2000, keys_));  // lets libraries allocate memory that they need only once
  const auto file = Write(20'000, keys_);
  const auto before_kb = peak_kb();
  ScoreFile(file);
  EXPECT_LT(peak_kb() - before_kb, 1000);
  EXPECT_GT(std::filesystem::file_size(file), 3'000'000u);  // as JSON values, several times as much
}

// The notation of numbers and names, and white space, do not change the result.
TEST_F(LongFile, MayBeWrittenInAnyWay) {
  const auto file = Write(4, keys_);
  const auto expected = ScoreFile(file);
  const std::pair<const char*, const char*> ways[] = {
      {"\"t\":", "\"\\u0074\" :"}, {":0.5", ":5e-1"}, {",", " ,\n"},
      {"[0,0]", "[-0,0.0]"},       {"{", "{\t\n"},    {"\"pot\"", "\"p\\u006ft\""}};
  for (const auto& [from, to] : ways) {
    Replace(Write(4, keys_), from, to);
    EXPECT_EQ(ScoreFile(file).dump(), expected.dump()) << to;
  }
}

// The numbers are bit-identical to those of the parsed document. Some have more digits than an integer can
// hold.
TEST_F(LongFile, HasEachNumberAsParsingTheWholeHasIt) {
  for (const char* number :
       {"-0", "-0.0", "1E-7", "2.5e+3", "1e23", "9007199254740993", "4.9e-324", "2.2250738585072011e-308",
        "18446744073709551616", "0.95000000000000000000", "-0.01234567890123456789012",
        "0.1000000000000000055511151231257827021181583404541015625"}) {
    const auto file = Write(4, keys_);
    Replace(file, "[3,4]", "[" + std::string(number) + ",4]");
    EXPECT_EQ(ScoreFile(file).dump(), ScoreEpisode(ReadJsonFile(file), "whole").dump()) << number;
  }
}

TEST_F(LongFile, NamesTheStepThatIsWrong) {
  const auto file = Write(30, keys_);
  std::ifstream in(file);
  std::string text{std::istreambuf_iterator<char>(in), {}};
  const std::string good = "\"t\":" + json(0.02 * 26).dump();
  ASSERT_NE(text.find(good), std::string::npos);
  text.replace(text.find(good), good.size(), "\"t\":7");
  std::ofstream(file) << text;
  try {
    ScoreFile(file);
    FAIL() << "accepted";
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()),
              file.string() + ": steps[25].t: expected (index + 1) * control_dt = 0.52, got 7");
  }
  std::ofstream(file) << text.substr(0, text.size() / 2);
  try {
    ScoreFile(file);
    FAIL() << "accepted";
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()).rfind(file.string() + ":", 0), 0) << error.what();
  }
}

struct Mistake {
  const char* name;
  std::function<void(json*)> make;
  const char* message;
};

class ScoreFileMistake : public testing::TestWithParam<Mistake> {};

TEST_P(ScoreFileMistake, IsOneClearLine) {
  json episode = SmallEpisode();
  GetParam().make(&episode);
  const auto error = [](const std::function<void()>& score) -> std::string {
    try {
      score();
    } catch (const InputError& what) {
      return what.what();
    }
    return "accepted";
  };
  EXPECT_EQ(error([&] { ScoreEpisode(episode, "bad.json"); }),
            std::string("bad.json: ") + GetParam().message);
  // Steps in a file are read one by one.
  const TemporaryFolder folder;
  const auto file = folder.path() / "bad.json";
  std::ofstream(file) << episode;
  EXPECT_EQ(error([&] { ScoreFile(file); }), file.string() + ": " + GetParam().message);
}

const Mistake kMistakes[] = {
    {"not_an_object", [](json* e) { *e = json::array(); }, "the document: expected an object, got []"},
    {"missing_key", [](json* e) { e->erase("geoms"); }, "geoms: required key is missing"},
    {"unknown_key", [](json* e) { (*e)["config"]["track_slipage"] = true; },
     "config.track_slipage: unknown key; expected only slip_sample_window, slip_objects, track_vel_sync, "
     "track_vertical_sync, track_slippage, track_collisions, track_cartesian_jerk, track_joint_jerk, "
     "track_cartesian_path_length, track_joint_path_length, track_orientation_path_length"},
    {"wrong_size",
     [](json* e) {
       (*e)["steps"][1]["left"]["joint_position"] = {1, 2, 3};
     },
     "steps[1].left.joint_position: expected 2 numbers (this array has 3), got [1,2,3]"},
    {"nan", [](json* e) { (*e)["steps"][1]["left"]["wrist_position"][2] = std::nan(""); },
     "steps[1].left.wrist_position[2]: expected a finite number, got null"},
    {"null", [](json* e) { (*e)["steps"][0]["left"]["gripper_opening"] = nullptr; },
     "steps[0].left.gripper_opening: expected a finite number, got null"},
    {"negative_window", [](json* e) { (*e)["config"]["slip_sample_window"] = -1; },
     "config.slip_sample_window: expected an integer from 1 to 1000000000, got -1"},
    {"huge_window", [](json* e) { (*e)["config"]["slip_sample_window"] = 18446744073709551615u; },
     "config.slip_sample_window: expected an integer from 1 to 1000000000, got 18446744073709551615"},
    {"float_window", [](json* e) { (*e)["config"]["slip_sample_window"] = 2.0; },
     "config.slip_sample_window: expected an integer from 1 to 1000000000, got 2.0"},
    {"zero_dt", [](json* e) { (*e)["control_dt"] = 0; }, "control_dt: expected a number above 0, got 0"},
    {"wrong_time", [](json* e) { (*e)["steps"][1]["t"] = 0.05; },
     "steps[1].t: expected (index + 1) * control_dt = 0.04, got 0.05"},
    {"wrong_arms",
     [](json* e) {
       (*e)["robot"]["arms"] = {"right", "left"};
     },
     R"(robot.arms: expected ["left", "right"], ["left"] or ["right"], got ["right","left"])"},
    {"quaternion_norm",
     [](json* e) {
       (*e)["steps"][0]["left"]["wrist_quaternion"] = {0, 0, 0, 0};
     },
     "steps[0].left.wrist_quaternion: expected [w, x, y, z] of norm 1, got [0,0,0,0]"},
    {"geom_twice",
     [](json* e) {
       (*e)["geoms"]["scene"] = {0, 1};
     },
     "geoms.scene[0]: expected each id once, in one of robot, scene and ignored, got 0"},
    {"geom_in_no_list", [](json* e) { (*e)["geoms"]["scene"] = json::array(); },
     "geoms.count: expected each id below the count in one of robot, scene and ignored (1 is missing), got "
     "3"},
    {"geom_out_of_range", [](json* e) { (*e)["geoms"]["scene"] = {3}; },
     "geoms.scene[0]: expected an integer from 0 to 2, got 3"},
    {"contact_size",
     [](json* e) {
       (*e)["steps"][0]["contacts"][0] = {0, 1};
     },
     "steps[0].contacts[0]: expected [geom_a, geom_b, dist], got [0,1]"},
    {"contact_id_not_an_integer", [](json* e) { (*e)["steps"][0]["contacts"][0][1] = 1.5; },
     "steps[0].contacts[0][1]: expected an integer from -2147483647 to 2147483647, got 1.5"},
    {"holding_of_no_object", [](json* e) { (*e)["steps"][0]["left"]["holding"] = json::object(); },
     "steps[0].left.holding.pot: required key is missing"},
    {"holding_a_number", [](json* e) { (*e)["initial"]["left"]["holding"]["pot"] = 1; },
     "initial.left.holding.pot: expected true or false, got 1"},
    {"object_twice",
     [](json* e) {
       (*e)["config"]["slip_objects"] = {"pot", "pot"};
     },
     R"(config.slip_objects[1]: expected each object once, got "pot")"},
    {"stage_zero", [](json* e) { (*e)["stages"][0]["stage"] = 0; },
     "stages[0].stage: expected an integer from 1 to 1000000, got 0"},
    {"stage_after_the_end", [](json* e) { (*e)["stages"][0]["step"] = 2; },
     "stages[0].step: expected an integer from -1 to 1, got 2"},
    {"stages_out_of_order",
     [](json* e) {
       (*e)["stages"].push_back({{"step", -1}, {"stage", 1}, {"reached", false}});
     },
     "stages[1].step: expected an integer from 0 to 1, got -1"},
    {"distance_text", [](json* e) { (*e)["finalize"]["target_distance"] = "far"; },
     R"(finalize.target_distance: expected null, a number, or an object of names and numbers, got "far")"},
    {"distance_entry", [](json* e) { (*e)["finalize"]["target_distance"]["lift"] = true; },
     "finalize.target_distance.lift: expected a finite number, got true"},
    {"overflow", [](json* e) { (*e)["steps"][1]["left"]["joint_position"][0] = 1e200; },
     "steps: expected values in a physical range, joint_path_length overflows"},
};
INSTANTIATE_TEST_SUITE_P(All, ScoreFileMistake, testing::ValuesIn(kMistakes),
                         [](const auto& test) { return std::string(test.param.name); });

TEST(ScoreFile, RefusesANegativeCollisionWindow) {
  EXPECT_THROW(ScoreEpisode(SmallEpisode(), "small.json", {.collision_sample_window = -1}), InputError);
}

std::string ReadError(const std::string& text) {
  const std::filesystem::path file = testing::TempDir() + "/" + std::to_string(getpid()) + "_score.json";
  std::ofstream(file) << text;
  std::string what = "accepted";
  try {
    ReadJsonFile(file);
  } catch (const InputError& error) {
    what = error.what();
    const std::string name = file.string();
    if (what.rfind(name, 0) == 0) what = what.substr(name.size());
  }
  std::filesystem::remove(file);
  return what;
}

TEST(ReadJsonFile, NamesTheLineOfASyntaxError) {
  EXPECT_EQ(ReadError("{\n\"a\": 1,\n\"b\": }\n").rfind(":3: expected JSON, ", 0), 0)
      << ReadError("{\n\"a\": 1,\n\"b\": }\n");
  EXPECT_EQ(ReadError("{\n\"a\": NaN}").rfind(":2: expected JSON, ", 0), 0);
  EXPECT_EQ(ReadError("{\"a\": 1}\n\n[").rfind(":3: expected JSON, ", 0), 0);
  EXPECT_EQ(ReadError("").rfind(":1: expected JSON, ", 0), 0);
  EXPECT_EQ(ReadError("{\n\"a\": 1e999}"), ":2: expected JSON, the number 1e999 does not fit a double");
  EXPECT_EQ(ReadError("{\"a\": {\"b\": 1, \"b\": 2}}"), ": b: repeated key, expected each key once");
  EXPECT_EQ(ReadError("{\"a\": {\"b\": 1}, \"b\": [{\"b\": 2}, {\"b\": 2}]}"), "accepted");
  for (const char* text : {"{\n\"a\": NaN}", "", "[1,]"})
    EXPECT_EQ(ReadError(text).find('\n'), std::string::npos);
}

TEST(ReadJsonFile, ReportsAFileThatCannotBeRead) {
  EXPECT_THROW(ReadJsonFile("/nonexistent.json"), InputError);
  EXPECT_THROW(ReadJsonFile("/tmp"), InputError);
}

}  // namespace evalbus::metrics::score_file_test
