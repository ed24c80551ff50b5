#include "runner/training_starts.h"

#include <gtest/gtest.h>

#include "base/errors.h"
#include "export/hdf5_file.h"
#include "tests/unit/results/run_folders.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::runner::training_starts_test {

using nlohmann::ordered_json;
using results::EpisodeLine;
using results::RunInfo;
using results::WriteFile;
using results::WriteRun;

class TrainingStartsTest : public testing::Test {
 protected:
  // Returns a contract in the test's folder that was trained on these runs, whose names are relative to the
  // folder.
  policy::Contract Contract(const std::vector<std::string>& runs) const {
    policy::Contract contract;
    contract.file = folder_.path() / "mine.yaml";
    for (const std::string& run : runs) contract.trained_on.push_back({run, "mine.yaml:3: key 'trained_on'"});
    return contract;
  }
  static ordered_json Line(int episode, const ordered_json& parameters) {
    ordered_json line = EpisodeLine(episode);
    line["parameters"] = parameters;
    return line;
  }
  void WriteSet(const std::string& name, const std::string& dataset, const std::vector<std::string>& texts) {
    exports::Hdf5File file(folder_.path() / name);
    file.Write(dataset, texts);
    file.Finish();
  }
  std::string Error(const std::string& run) const {
    try {
      TrainingStarts::Of(Contract({run}));
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }

  TemporaryFolder folder_;
};

TEST_F(TrainingStartsTest, AreThoseOfCompleteEpisodesOfTheSameVariation) {
  ordered_json incomplete = Line(2, {{"pot_x_m", 0.5}});
  incomplete["complete"] = false;
  WriteRun(folder_.path() / "a", RunInfo(3),
           {Line(0, {{"pot_x_m", 0.1}, {"pot_y_m", 0.2}}), Line(1, {{"pot_x_m", 0.1 + 0.2}}), incomplete});
  WriteRun(folder_.path() / "b", RunInfo(1), {Line(0, ordered_json::object())});
  const TrainingStarts training = TrainingStarts::Of(Contract({"a", "b"}));
  // The order of the parameters does not matter, but their values must be bit-identical.
  EXPECT_TRUE(training.Contain("lift_pot/position", {{"pot_y_m", 0.2}, {"pot_x_m", 0.1}}));
  EXPECT_TRUE(training.Contain("lift_pot/position", {{"pot_x_m", 0.1 + 0.2}}));
  EXPECT_FALSE(training.Contain("lift_pot/position", {{"pot_x_m", 0.3}}));
  EXPECT_FALSE(training.Contain("lift_pot/position", {{"pot_x_m", 0.1}}));
  EXPECT_FALSE(training.Contain("lift_pot/position", {{"pot_x_m", 0.5}}));
  EXPECT_FALSE(training.Contain("lift_pot/orientation", {{"pot_x_m", 0.1 + 0.2}}));
  // Run b has an episode without drawn parameters, so this start is among the training starts.
  EXPECT_TRUE(training.Contain("lift_pot/position", ordered_json::object()));
  EXPECT_FALSE(training.Contain("lift_pot/base", ordered_json::object()));
  EXPECT_EQ(training.Json()["sets"], (std::vector<std::string>{"a", "b"}));
  EXPECT_EQ(training.Json()["starts"], 3);
}

TEST_F(TrainingStartsTest, TheirHashDependsOnTheStartsAlone) {
  WriteRun(folder_.path() / "a", RunInfo(2), {Line(0, {{"pot_x_m", 0.1}}), Line(1, {{"pot_x_m", 0.2}})});
  WriteRun(folder_.path() / "b", RunInfo(2), {Line(0, {{"pot_x_m", 0.2}}), Line(1, {{"pot_x_m", 0.1}})});
  WriteRun(folder_.path() / "c", RunInfo(1), {Line(0, {{"pot_x_m", 0.2}})});
  const auto hash = [&](const std::string& run) {
    return TrainingStarts::Of(Contract({run})).Json()["starts_sha256"];
  };
  EXPECT_EQ(hash("a"), hash("b"));
  EXPECT_NE(hash("a"), hash("c"));
}

TEST_F(TrainingStartsTest, AreReadFromExportedSets) {
  const std::string line = R"({"task": "lift_pot/position", "parameters": {"pot_x_m": 0.1}})";
  WriteRun(folder_.path() / "run", RunInfo(1), {Line(0, {{"pot_x_m", 0.1}})});
  WriteSet("set.hdf5", "evalbus_starts", {line});
  WriteFile(folder_.path() / "set/evalbus_starts.jsonl", line + "\n");
  const auto hash = [&](const std::string& set) {
    return TrainingStarts::Of(Contract({set})).Json()["starts_sha256"];
  };
  EXPECT_EQ(hash("set.hdf5"), hash("run"));
  EXPECT_EQ(hash("set"), hash("run"));
}

TEST_F(TrainingStartsTest, OfAnythingElseAreRefused) {
  const std::string place = "mine.yaml:3: key 'trained_on': ";
  const std::string folder = folder_.path().string();
  EXPECT_EQ(Error("none"), place + folder + "/none: no such run folder");
  WriteFile(folder_.path() / "text.hdf5", "HDF");
  EXPECT_EQ(Error("text.hdf5"), place + folder + "/text.hdf5: not an HDF5 file, or truncated");
  WriteSet("other.hdf5", "mask/all", {"demo_0"});
  EXPECT_EQ(Error("other.hdf5"),
            place + folder +
                "/other.hdf5: no dataset 'evalbus_starts'; written by another program or "
                "an older version of evalbus?");
  WriteSet("watched.hdf5", "evalbus_starts", {R"({"task": "lift_pot/base", "parameters": null})"});
  EXPECT_EQ(Error("watched.hdf5"), place + folder +
                                       "/watched.hdf5: the start of episode 0 is unknown, because an "
                                       "external source recorded it");
  std::filesystem::create_directories(folder_.path() / "lerobot/meta");
  EXPECT_EQ(Error("lerobot"),
            place + folder +
                "/lerobot: neither a run, a suite nor a training set of 'evalbus export': no "
                "run.json, suite.json or evalbus_starts.jsonl");
  WriteRun(folder_.path() / "old", RunInfo(1), {EpisodeLine(0)});
  EXPECT_EQ(Error("old"),
            place + folder +
                "/old/episodes.jsonl:1: no \"parameters\", so its start is unknown: recorded by "
                "an external source or an older version of evalbus");
}

}  // namespace evalbus::runner::training_starts_test
