// evalbus score MAP.yaml DATA: a table of joints gives the same scores as a simulation of the same joints.
#include <cmath>
#include <cstring>

#include "bus/channels.h"
#include "evalbus/contacts_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "evalbus/state_t.hpp"
#include "tests/integration/harness.h"

namespace evalbus::score_test {

namespace fs = std::filesystem;

class Score : public testing::Test {
 protected:
  // Writes the joints of a log of the simulation, at all its ticks, as a table and its map.
  void WriteTable(const RecordedLog& log) const {
    const model_info_t model = log.Messages(channels::kModel).at(0);
    std::string names, columns, rows;
    for (const arm_info_t& arm : model.arm) {
      for (const std::string& joint : arm.joint_name) {
        columns += (columns.empty() ? "" : ", ") + joint + ": " + "'" + joint + "'";
        names += (names.empty() ? "" : ",") + joint;
      }
    }
    names += ",left_opening,right_opening";
    for (const state_t& state : log.Messages(channels::kState)) {
      std::string row;
      for (const arm_state_t& arm : state.arm) {
        for (const double position : arm.joint_position_rad) {
          char text[32];
          std::snprintf(text, sizeof text, "%.17g", position);
          row += (row.empty() ? "" : ",") + std::string(text);
        }
      }
      for (const gripper_state_t& gripper : state.gripper) {
        char text[32];
        std::snprintf(text, sizeof text, ",%.17g", gripper.opening);
        row += text;
      }
      rows += row + "\n";
    }
    WriteText(table_, names + "\n" + rows);
    WriteText(map_, "task: lift_pot/base\nrate_hz: 50\njoints: {unit: rad, columns: {" + columns +
                        "}}\ngrippers: {left: {column: left_opening, open: 1, closed: 0}, "
                        "right: {column: right_opening, open: 1, closed: 0}}\n");
  }

  TemporaryFolder folder_;
  const fs::path table_ = folder_.path() / "joints.csv", map_ = folder_.path() / "map.yaml";
};

TEST_F(Score, ClearanceHasThePointsOfASimulationOfTheSameJoints) {
  const fs::path run = folder_.path() / "run", scored = folder_.path() / "scored";
  Evaluate({ShortTask(folder_.path(), 0.4) + "/base", "--policy", "hold", "--episodes", "1", "--in-process"},
           run);
  const RecordedLog simulated = ReadLog(evalbus::LogFile(run, 0));
  WriteTable(simulated);
  const Result result = RunProgram({"evalbus", "score", map_, table_, "--out", scored});
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(SchemaError("run", scored / "run.json"), "");
  EXPECT_EQ(SchemaError("summary", scored / "summary.json"), "");
  EXPECT_EQ(SchemaError("episode", scored / "episodes.jsonl"), "");
  const auto expected = simulated.Messages(channels::kContacts);
  const auto found = ReadLog(evalbus::LogFile(scored, 0)).Messages(channels::kContacts);
  ASSERT_EQ(found.size(), expected.size());
  int with_clearance = 0;
  for (size_t i = 0; i < expected.size(); ++i) {
    // Positions are recomputed from the joints, so their last digits may differ. Therefore, the ticks that
    // have the smallest clearance so far may also differ.
    if (!expected[i].has_clearance || !found[i].has_clearance) continue;
    constexpr double kTolerance = 1e-6;
    EXPECT_NEAR(found[i].clearance_m, expected[i].clearance_m, kTolerance) << i;
    // The two arms may be equally close.
    if (found[i].clearance_robot_geom != expected[i].clearance_robot_geom) continue;
    ++with_clearance;
    EXPECT_EQ(found[i].clearance_scene_geom, expected[i].clearance_scene_geom) << i;
    double distance = 0;
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(found[i].clearance_robot_point_m[k], expected[i].clearance_robot_point_m[k], kTolerance)
          << i;
      EXPECT_NEAR(found[i].clearance_scene_point_m[k], expected[i].clearance_scene_point_m[k], kTolerance)
          << i;
      distance += std::pow(found[i].clearance_robot_point_m[k] - found[i].clearance_scene_point_m[k], 2);
    }
    // contacts_t.lcm documents this property.
    EXPECT_NEAR(std::sqrt(distance), found[i].clearance_m, kTolerance) << i;
  }
  EXPECT_GE(with_clearance, 3);

  const std::string table = ReadText(table_);
  WriteText(table_, table.substr(0, table.find('\n', table.find('\n') + 1) + 1));
  const Result one_row = RunProgram({"evalbus", "score", map_, table_, "--out", folder_.path() / "one"});
  EXPECT_EQ(one_row.code, 1);
  EXPECT_NE(one_row.err.find("expected two rows or more, got one\n"), std::string::npos) << one_row.err;
}

// In the recording, a joint has a different zero and direction, and the pot has a different frame.
TEST_F(Score, ZerosAndFramesOfTheRecordingAreConverted) {
  const fs::path run = folder_.path() / "run", scored = folder_.path() / "scored",
                 converted = folder_.path() / "converted";
  Evaluate({ShortTask(folder_.path(), 0.2) + "/base", "--policy", "hold", "--episodes", "1", "--in-process"},
           run);
  WriteTable(ReadLog(evalbus::LogFile(run, 0)));
  const auto with = [&](const std::string& text, const std::string& column, const std::string& now) {
    const size_t at = text.find(column);
    EXPECT_NE(at, std::string::npos) << text;
    return text.substr(0, at) + now + text.substr(at + column.size());
  };
  const std::string pose = "objects:\n  pot: {position_m: [x, y, z], quaternion_wxyz: [w, i, j, k]";
  const std::string map = ReadText(map_), table = ReadText(table_);
  const auto write = [&](const std::string& last_names, const std::string& last) {
    std::string text;
    for (size_t begin = 0; begin < table.size();) {
      const size_t end = table.find('\n', begin);
      text += table.substr(begin, end - begin) + (begin == 0 ? last_names : last) + "\n";
      begin = end + 1;
    }
    WriteText(table_, text);
  };
  write(",x,y,z,w,i,j,k", ",0.7,0,1.1,1,0,0,0");
  WriteText(map_, map + pose + "}\n");
  ASSERT_EQ(RunProgram({"evalbus", "score", map_, table_, "--out", scored}).code, 0);
  // Our joint is (0.5 - q) if the column is q: sign -1, zero 0.5.
  std::string turned;
  for (size_t begin = 0, line = 0; begin < table.size(); ++line) {
    const size_t end = table.find('\n', begin), comma = table.find(',', begin);
    char text[32];
    std::snprintf(text, sizeof text, "%.17g",
                  line == 0 ? 0 : 0.5 - std::stod(table.substr(begin, comma - begin)));
    turned += (line == 0 ? table.substr(begin, end - begin) + ",x,y,z,w,i,j,k"
                         : text + table.substr(comma, end - comma) + ",0.7,0,1,0,0,0,1") +
              "\n";
    begin = end + 1;
  }
  WriteText(table_, turned);
  WriteText(map_, with(map, "left/joint1: 'left/joint1'",
                       "left/joint1: {column: 'left/joint1', sign: -1, zero: 0.5}") +
                      pose + ", frame: {position_m: [0, 0, 0.1], quaternion_wxyz: [0, 0, 0, -1]}}\n");
  const Result result = RunProgram({"evalbus", "score", map_, table_, "--out", converted});
  ASSERT_EQ(result.code, 0) << result.err;
  const auto before = ReadLog(evalbus::LogFile(scored, 0)).Messages(channels::kState),
             after = ReadLog(evalbus::LogFile(converted, 0)).Messages(channels::kState);
  ASSERT_EQ(before.size(), after.size());
  for (size_t k = 0; k < before.size(); ++k) {
    ASSERT_EQ(before[k].qpos_mixed.size(), after[k].qpos_mixed.size());
    for (size_t i = 0; i < before[k].qpos_mixed.size(); ++i)
      EXPECT_NEAR(before[k].qpos_mixed[i], after[k].qpos_mixed[i], 1e-12) << k << " " << i;
  }
  WriteText(map_, with(map, "left/joint1: 'left/joint1'", "left/joint1: {column: 'left/joint1', sign: 0}"));
  EXPECT_EQ(RunProgram({"evalbus", "score", map_, table_, "--out", folder_.path() / "refused"}).err,
            "error: " + map_.string() + ":3: key 'sign': expected 1 or -1, got 0\n");
  WriteText(map_, with(map, "lift_pot/base", "lift_pt/base"));
  EXPECT_EQ(RunProgram({"evalbus", "score", map_, table_, "--out", folder_.path() / "refused"}).err,
            "error: " + map_.string() +
                ":1: key 'task': unknown task 'lift_pt/base'; did you mean 'lift_pot/base'?\n");
  WriteText(map_,
            "task: lift_pot/base\nrate_hz: 50\njoints: {unit: rad, columns: {left/joint1: q, "
            "left/joint2: q}}\n");
  EXPECT_EQ(
      RunProgram({"evalbus", "score", map_, table_, "--out", folder_.path() / "refused"}).err,
      "error: " + map_.string() + ":3: key 'left/joint2': 'q' is already the column of 'left/joint1'\n");
}

// Spreadsheet programs begin their files with a byte order mark.
TEST_F(Score, AByteOrderMarkIsSkipped) {
  const fs::path run = folder_.path() / "run", scored = folder_.path() / "scored",
                 marked = folder_.path() / "marked";
  Evaluate({ShortTask(folder_.path(), 0.2) + "/base", "--policy", "hold", "--episodes", "1", "--in-process"},
           run);
  WriteTable(ReadLog(evalbus::LogFile(run, 0)));
  ASSERT_EQ(RunProgram({"evalbus", "score", map_, table_, "--out", scored}).code, 0);
  WriteText(table_, "\xEF\xBB\xBF" + ReadText(table_));
  const Result result = RunProgram({"evalbus", "score", map_, table_, "--out", marked});
  ASSERT_EQ(result.code, 0) << result.err;
  ExpectSameScores(scored, marked);
}

// The last sample follows after a gap and lies between two ticks, so no tick after the gap is scored.
TEST_F(Score, TicksThatAreMissingAtTheEndCount) {
  std::string names = "t", columns, positions;
  for (const std::string arm : {"left", "right"}) {
    for (int j = 1; j <= 7; ++j) {
      const std::string joint = arm + "/joint" + std::to_string(j);
      names += "," + joint;
      columns += (columns.empty() ? "" : ", ") + joint + ": " + joint;
      positions += j == 4 ? ",-1.5" : j == 6 ? ",1.5" : ",0";
    }
  }
  std::string table = names + "\n";
  for (const char* time : {"0", "0.02", "0.04", "0.205"}) table += time + positions + "\n";
  WriteText(table_, table);
  WriteText(map_, "task: lift_pot\ntime: {column: t, unit: s}\njoints: {unit: rad, columns: {" + columns +
                      "}}\ngrippers: {left: open, right: open}\n");
  const fs::path scored = folder_.path() / "scored";
  const Result result = RunProgram({"evalbus", "score", map_, table_, "--out", scored});
  ASSERT_EQ(result.code, 0) << result.err;
  const auto episode = nlohmann::json::parse(ReadText(scored / "episodes.jsonl"));
  EXPECT_EQ(episode["complete"], false);
  EXPECT_EQ(episode["extended"]["missing_ticks"], 8);  // ticks 3 to 10, at 0.06 to 0.2 s
  EXPECT_EQ(episode["end_detail"], "samples are missing in 1 place");
}

// A run and a score have the same entries for software and models in run.json.
TEST_F(Score, ListsTheSoftwareItWasMadeWith) {
  const fs::path run = folder_.path() / "run", scored = folder_.path() / "scored";
  Evaluate({"lift_pot/base", "--policy", "hold", "--episodes", "1", "--in-process", "--only", "0"}, run);
  WriteTable(ReadLog(evalbus::LogFile(run, 0)));
  ASSERT_EQ(RunProgram({"evalbus", "score", map_, table_, "--out", scored}).code, 0);
  const auto info = nlohmann::json::parse(ReadText(run / "run.json")),
             other = nlohmann::json::parse(ReadText(scored / "run.json"));
  for (const char* key : {"schema_version", "task", "variation", "task_sha256", "robot_sha256",
                          "physics_sha256", "visual_sha256", "limits_sha256", "evalbus_version", "git_commit",
                          "git_dirty", "plugins", "mujoco_version"}) {
    ASSERT_TRUE(info.contains(key) && other.contains(key)) << key;
    EXPECT_EQ(info[key], other[key]) << key;
  }
  EXPECT_EQ(other["source"], "file");
}

}  // namespace evalbus::score_test
