// Every task is made to fail in known ways, and the scores must distinguish the failures. docs/failures.md
// describes the flaws that cause them.
#include <gtest/gtest.h>

#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "tests/integration/harness.h"

namespace evalbus::failures_test {

using Json = nlohmann::ordered_json;

// One variation of each family and a time limit (s) that leaves a faultless expert little idle time. LiftTray
// uses the variation in which the tray has to be moved; if the tray only has to leave the hob, there is no
// partial progress.
struct Task {
  const char *variation, *time_limit_s;
};
const std::map<std::string, Task> kTasks = {
    {"cube_handover", {"base", "11"}},
    {"lift_pot", {"base", "8"}},
    {"lift_tray", {"drag_over", "9"}},
    {"pack_box", {"base", "20"}},
    {"pick_single_book_from_table", {"base", "18"}},
    {"rotate_valve", {"base", "6"}},
    {"stack_single_book_shelf", {"base", "24"}},
    {"stack_two_blocks", {"base", "9"}},
};

// Returns the task as a file of the folder, with the shorter time limit.
std::string Shortened(const std::string& name, const std::filesystem::path& folder) {
  const std::string models = EVALBUS_SOURCE_DIR "/models/";
  std::string text = ReadText(models + "tasks/" + name + ".yaml");
  text = std::regex_replace(text, std::regex(R"(\.\./)"), models);
  text = std::regex_replace(text, std::regex("time_limit_s: [0-9]+"),
                            std::string("time_limit_s: ") + kTasks.at(name).time_limit_s);
  WriteText(folder / (name + ".yaml"), text);
  return folder / (name + ".yaml/") / kTasks.at(name).variation;
}

// Events that a score is expected to count. By default it counts no slip and no collision.
enum Counted { kNothing = 0, kSlips = 1, kCollisions = 2 };

struct Outcome {
  std::string task, failure_reason;
  std::set<int> stages_reached;
  // Text that the explanation must contain.
  const char* text;
  int counted = kNothing;
};

struct Failures {
  const char* flaw;
  std::vector<Outcome> outcomes;
};

void PrintTo(const Failures& failures, std::ostream* stream) { *stream << failures.flaw; }

std::string EndReason(const std::string& failure_reason, const std::string& text) {
  if (failure_reason.empty()) return "success";
  if (failure_reason == "policy_error") return failure_reason;
  return text.find("touches world") != std::string::npos ? "failure" : "time_limit";
}

// Checks conditions that every explanation must meet.
void ExpectConsistent(const Json& episode) {
  const Json& explanation = episode["explanation"];
  const Json& metrics = episode["metrics"];
  EXPECT_EQ(explanation["slips"].size(), metrics["slip_count"]);
  for (const Json& slip : explanation["slips"]) {
    EXPECT_GT(slip["time_s"], 0);
    EXPECT_NE(slip["object"], "");
  }
  EXPECT_EQ(explanation["first_collision"].is_null(), metrics["env_collision_count"] == 0);
  if (!explanation["first_collision"].is_null()) {
    EXPECT_NE(explanation["first_collision"]["scene_geom"], "");
    EXPECT_GT(explanation["first_collision"]["time_s"], 0);
  }
  ASSERT_FALSE(explanation["conditions"].empty());
  for (const Json& condition : explanation["conditions"]) {
    EXPECT_EQ(condition.contains("value"), condition.contains("threshold")) << condition;
  }
}

// Texts that occur in the expected explanations of several failures.
const char *const kOtherGripper = "the other gripper does not touch rod",
                  *const kCabinet = "pot touches left_cabinet", *const kBook = "height of book 0.7",
                  *const kWheel = "fraction of the range of first_valve/wheel 0",
                  *const kFlap = "fraction of the range of box/left_flap 1.00",
                  *const kShelf = "book does not touch shelf/lower_shelf",
                  *const kCubes = "red_cube does not touch blue_cube", *const kNoStage = "no stage reached",
                  *const kCollision = "first collision at";

// Any error of the policy ends the episode immediately.
const std::vector<Outcome> kAfterAnError = {
    {"cube_handover", "policy_error", {1}, kOtherGripper},
    {"lift_pot", "policy_error", {1, 2}, "height of pot 1.006 m < 1.096"},
    {"lift_tray", "policy_error", {1}, "right gripper does not touch tray"},
    {"pack_box", "policy_error", {2}, kFlap},
    {"pick_single_book_from_table", "policy_error", {1, 2}, kBook},
    {"rotate_valve", "policy_error", {1, 3}, kWheel},
    {"stack_single_book_shelf", "policy_error", {1}, kShelf},
    {"stack_two_blocks", "policy_error", {1, 2}, "red_cube does not touch table"},
};

const std::vector<Failures> kFailures = {
    {"miss",
     {{"cube_handover", "grasp_miss", {}, kOtherGripper},
      {"lift_pot", "grasp_miss", {}, kCabinet},
      {"lift_tray", "grasp_miss", {}, "left gripper does not touch tray"},
      {"pack_box", "timeout", {}, "fraction of the range of box/left_flap 1.00 > 0.05"},
      // The closed hand that should pull the book misses it, and no hand closes near the book.
      {"pick_single_book_from_table", "timeout", {}, kBook},
      {"rotate_valve", "grasp_miss", {}, kWheel},
      {"stack_single_book_shelf", "timeout", {}, kShelf},
      {"stack_two_blocks", "grasp_miss", {}, kCubes}}},
    {"slip",
     {{"pick_single_book_from_table", "", {1, 2}, kBook},
      {"stack_two_blocks", "grasp_slip", {1, 2}, kCubes}}},
    {"early",
     {{"cube_handover", "dropped", {1}, kOtherGripper},
      // The opened hand still pushes the tray to its cabinet, so releasing the tray had no consequence.
      {"lift_tray", "timeout", {1, 3}, "tray slipped from left", kSlips},
      {"pick_single_book_from_table", "dropped", {1, 2}, kBook},
      {"rotate_valve", "dropped", {1, 3}, kWheel},
      {"stack_single_book_shelf", "dropped", {1}, kShelf, kSlips | kCollisions},
      {"stack_two_blocks", "dropped", {1, 2}, kCubes}}},
    {"drop",
     {{"cube_handover", "dropped", {1}, kOtherGripper},
      {"lift_pot", "dropped", {1, 2}, kCabinet, kSlips},
      {"pick_single_book_from_table", "dropped", {1, 2}, kBook, kSlips},
      {"stack_single_book_shelf", "dropped", {1}, kShelf},
      {"stack_two_blocks", "dropped", {1, 2}, kCubes}}},
    {"stop",
     {{"cube_handover", "stall", {1}, kOtherGripper},
      {"lift_pot", "stall", {1, 2}, "height of pot 1.0"},
      {"lift_tray", "stall", {1}, "right gripper does not touch tray"},
      {"pack_box", "stall", {2}, kFlap},
      {"pick_single_book_from_table", "stall", {1, 2}, kBook},
      {"rotate_valve", "stall", {1, 3}, kWheel},
      {"stack_single_book_shelf", "stall", {1}, kShelf},
      {"stack_two_blocks", "stall", {1, 2}, "red_cube does not touch table"}}},
    {"collide",
     {{"cube_handover", "collision", {}, kCollision, kCollisions},
      {"lift_pot", "collision", {}, kCollision, kCollisions},
      {"pick_single_book_from_table", "collision", {}, kCollision, kCollisions},
      // A hand slides off a wheel while it moves down to the table, which counts as a slip.
      {"rotate_valve", "collision", {3}, kCollision, kSlips | kCollisions},
      {"stack_single_book_shelf", "collision", {}, kCollision, kCollisions},
      {"stack_two_blocks", "collision", {}, kCollision, kCollisions}}},
    {"slow",
     {{"cube_handover", "timeout", {}, kNoStage},
      {"lift_pot", "timeout", {}, kNoStage},
      {"lift_tray", "timeout", {}, kNoStage},
      {"pack_box", "timeout", {}, kNoStage},
      {"rotate_valve", "timeout", {}, kNoStage},
      {"stack_two_blocks", "timeout", {}, kNoStage}}},
    {"error", kAfterAnError},
    {"nan", kAfterAnError},
};

class FailuresTest : public testing::TestWithParam<Failures> {};

TEST_P(FailuresTest, AreToldApart) {
  const Failures& failures = GetParam();
  const TemporaryFolder folder;
  const auto out = folder.path() / "suite";
  std::vector<std::string> arguments = {"--policy",    std::string("flawed_expert:") + failures.flaw,
                                        "--seed",      "1",
                                        "--episodes",  "1",
                                        "--workers",   "2",
                                        "--in-process"};
  for (const Outcome& outcome : failures.outcomes)
    arguments.push_back(Shortened(outcome.task, folder.path()));
  Evaluate(arguments, out);
  std::map<std::string, Json> episodes;
  for (const auto& entry : std::filesystem::directory_iterator(out)) {
    if (!std::filesystem::exists(entry.path() / "episodes.jsonl")) continue;
    const Json episode = Episodes(entry.path()).at(0);
    episodes[episode["task"]] = episode;
  }
  for (const Outcome& expected : failures.outcomes) {
    SCOPED_TRACE(expected.task);
    ASSERT_TRUE(episodes.contains(expected.task));
    const Json& episode = episodes[expected.task];
    const std::string text = episode["explanation"]["text"];
    SCOPED_TRACE(text);
    EXPECT_EQ(episode["failure_reason"], expected.failure_reason);
    EXPECT_EQ(episode["end_reason"], EndReason(expected.failure_reason, text));
    std::set<int> stages;
    for (const auto& [index, reached] : episode["metrics"]["task_stage_reached"].items()) {
      if (reached) stages.insert(std::stoi(index));
    }
    EXPECT_EQ(stages, expected.stages_reached);
    const int64_t slips = episode["metrics"]["slip_count"],
                  collisions = episode["metrics"]["env_collision_count"];
    EXPECT_EQ((slips > 0 ? kSlips : 0) + (collisions > 0 ? kCollisions : 0), expected.counted)
        << slips << " slips, " << collisions << " collisions";
    EXPECT_NE(text.find(expected.text), std::string::npos) << expected.text;
    ExpectConsistent(episode);
  }
}

INSTANTIATE_TEST_SUITE_P(EachFlaw, FailuresTest, testing::ValuesIn(kFailures),
                         [](const auto& failures) { return std::string(failures.param.flaw); });

TEST(FailuresTestOfThePolicy, ItsOwnErrorsAreReported) {
  const TemporaryFolder folder;
  for (const auto& [flaw, detail] : {std::pair{"error", "the flawed expert gives up"},
                                     std::pair{"nan", "the action contains NaN or infinity"}}) {
    const auto out = folder.path() / flaw;
    Evaluate(
        {"rotate_valve", "--policy", std::string("flawed_expert:") + flaw, "--episodes", "1", "--in-process"},
        out);
    EXPECT_NE(std::string(Episodes(out).at(0)["end_detail"]).find(detail), std::string::npos)
        << Episodes(out).at(0)["end_detail"];
  }
}

}  // namespace evalbus::failures_test
