// The random values that a task draws for the model of each episode do not depend on how a run is divided.
// They are in the log, and visual ones do not affect the physics.
#include <algorithm>

#include "bus/channels.h"
#include "evalbus/episode_begin_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "tests/integration/harness.h"
#include "tests/unit/dressed_scene.h"

namespace evalbus::randomized_test {

namespace fs = std::filesystem;

class RandomizedRun : public testing::Test {
 protected:
  // lift_pot with two variations that differ only visually.
  std::string Task() {
    const std::string file = ShortTask(folder_.path(), 2);
    const std::string physics =
        "    randomize:\n"
        "      - spawn_box: {object: pot, center_m: [0.735, 0], half_extents_m: [0.1, 0.1]}\n"
        "      - mass: {of: [pot], min_factor: 0.8, max_factor: 1.2}\n"
        "      - friction: {of: [pot, left/hand], min_factor: 0.8, max_factor: 1.2}\n";
    const std::string appearance =
        "      - color: {of: [pot], min_rgb: [0, 0, 0], max_rgb: [1, 1, 1]}\n"
        "      - light: {name: key, min_factor: 0.5, max_factor: 1.5, turn_deg: 10}\n"
        "      - texture: {of: [left_cabinet, right_cabinet], choices: [left_cabinet/oak, checker, marble]}\n"
        "      - camera: {name: overview, shift_m: [0.1, 0.1, 0.1], turn_deg: 5}\n";
    WriteText(file, WithVariation(ReadText(file), "  seen:\n    instruction: lift the colored pot\n" +
                                                      physics + appearance + "  unseen:\n" + physics));
    return file;
  }
  void Run(const std::string& variation, const std::string& name, std::vector<std::string> more = {}) {
    more.insert(more.begin(), {task_ + "/" + variation, "--episodes", "2", "--seed", "5"});
    Evaluate(more, folder_.path() / name);
  }
  // Runs with the seeds of a run older than seed_stream, with which two variations have equal episode seeds.
  void RunWithSharedSeeds(const std::string& variation) {
    Run(variation, variation + "-template", {"--in-process", "--policy", "hold"});
    auto info = nlohmann::ordered_json::parse(ReadText(folder_.path() / (variation + "-template/run.json")));
    info.erase("seed_stream");
    fs::create_directories(folder_.path() / "old");
    WriteText(folder_.path() / "old/run.json", info.dump());
    Evaluate({"--like", folder_.path() / "old", "--policy", "expert"}, folder_.path() / variation);
  }
  RecordedLog Log(const std::string& name, int episode) {
    return ReadLog(LogFile(folder_.path() / name, episode));
  }

  TemporaryFolder folder_;
  const std::string task_ = Task();
};

TEST_F(RandomizedRun, IsTheSameHoweverItIsCutAndFromItsLog) {
  Run("seen", "reference", {"--in-process"});
  const fs::path reference = folder_.path() / "reference";
  if (WhyNoBus().empty()) {
    Run("seen", "processes");
    ExpectSameScores(folder_.path() / "processes", reference);
    for (int i = 0; i < 2; ++i) ExpectSameTicks(Log("processes", i), Log("reference", i));
  }
  Run("seen", "again", {"--in-process", "--policy", "replay:" + reference.string()});
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(Log("again", i).Payloads(channels::kState), Log("reference", i).Payloads(channels::kState));
  }
  const Result rescored = RunProgram({"evalbus", "rescore", reference});
  EXPECT_EQ(rescored.code, 0) << rescored.out << rescored.err;
}

TEST_F(RandomizedRun, WhatIsSeenChangesNoByteOfTheRest) {
  RunWithSharedSeeds("seen");
  RunWithSharedSeeds("unseen");
  for (int i = 0; i < 2; ++i) ExpectSameTicks(Log("seen", i), Log("unseen", i));

  const auto parameters = [&](const std::string& name, int episode) {
    return Log(name, episode).Messages(channels::kEpisodeBegin).at(0);
  };
  const episode_begin_t first = parameters("seen", 0), unseen = parameters("unseen", 0);
  EXPECT_EQ(unseen.parameter_name,
            (std::vector<std::string>{"pot_x_m", "pot_y_m", "pot_mass_factor", "pot_friction_factor"}));
  ASSERT_EQ(first.num_parameters, 4 + 3 + 1 + 3 + 1 + 6);
  EXPECT_TRUE(std::equal(unseen.parameter_value_mixed.begin(), unseen.parameter_value_mixed.end(),
                         first.parameter_value_mixed.begin()));
  EXPECT_EQ(first.parameter_name[4], "pot_red_fraction");
  EXPECT_EQ(first.parameter_name[8], "light_key_turn_x_rad");
  EXPECT_EQ(first.parameter_name[11], "left_cabinet_texture_choice");
  const fs::path run_json = folder_.path() / "seen/run.json";
  EXPECT_EQ(SchemaError("run", run_json), "");
  EXPECT_EQ(nlohmann::json::parse(ReadText(run_json))["parameter_choices"]["left_cabinet_texture_choice"],
            (nlohmann::json{"left_cabinet/oak", "checker", "marble"}));
  EXPECT_NE(first.parameter_value_mixed, parameters("seen", 1).parameter_value_mixed);
  EXPECT_EQ(Log("seen", 0).Messages(channels::kModel).at(0).instruction, "lift the colored pot");
  EXPECT_EQ(Log("unseen", 0).Messages(channels::kModel).at(0).instruction, "lift the pot by the handles");
}

TEST_F(RandomizedRun, ANameThatIsNotThereIsALineBeforeTheRun) {
  std::string text = ReadText(task_);
  const std::string known = "{name: key,";
  WriteText(task_, text.replace(text.find(known), known.size(), "{name: kee,"));
  const Result result = RunProgram(
      {"evalbus", "run", task_ + "/seen", "--in-process", "--out", (folder_.path() / "none").string()});
  EXPECT_EQ(result.code, 1);
  EXPECT_NE(result.err.find(": the scene has no light 'kee'"), std::string::npos) << result.err;
}

}  // namespace evalbus::randomized_test
