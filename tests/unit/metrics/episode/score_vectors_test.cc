// Compares every public vector with its expected values, within its own tolerances, and with its closed
// forms.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "metrics/episode/score_file.h"

namespace evalbus::metrics::score_vectors_test {

using nlohmann::json;
namespace fs = std::filesystem;

// The full set is next to the repository on the developers' machines. The repository contains a part of it.
fs::path VectorFolder() {
  const fs::path all = fs::path(EVALBUS_SOURCE_DIR) / "../shared/vectors";
  return fs::exists(all / "FORMAT.md") ? all : fs::path(EVALBUS_SOURCE_DIR) / "tests/data/vectors";
}

std::vector<fs::path> VectorFiles() {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(VectorFolder())) {
    if (entry.path().extension() == ".json") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

// Values that differ because the reference does not normalize quaternions, as the definition requires. They
// come from an independent evaluation (NumPy, normalized, arc cosine).
const std::map<std::string, json> kDepartures = {
    {"single_precision_log",
     {{"orientation_path_length", {{"left", 1.6554233540664873}, {"right", 2.1844835275417247}}},
      {"total_orientation_path_length", 3.839906881608212},
      {"avg_orientation_path_length", 1.919953440804106}}}};

// Compares numbers within the tolerance of the top-level key. Compares counts and everything else exactly.
void ExpectAgrees(const json& got, const json& want, const std::string& key, double rel, double abs) {
  if (want.is_object()) {
    ASSERT_TRUE(got.is_object()) << key << ": " << got;
    EXPECT_EQ(got.size(), want.size()) << key << ": " << got << " where " << want << " is expected";
    for (const auto& [name, value] : want.items()) {
      ASSERT_TRUE(got.contains(name)) << key << "." << name;
      ExpectAgrees(got[name], value, key + "." + name, rel, abs);
    }
  } else if (want.is_number_float()) {
    ASSERT_TRUE(got.is_number_float()) << key << ": " << got << " is not a floating-point number";
    EXPECT_LE(std::abs(got.get<double>() - want.get<double>()), abs + rel * std::abs(want.get<double>()))
        << key << ": " << got << " where " << want << " is expected";
  } else {
    EXPECT_EQ(got.type() == json::value_t::number_unsigned ? json(got.get<int64_t>()) : got, want) << key;
    EXPECT_EQ(got.is_boolean(), want.is_boolean()) << key;
  }
}

void ExpectAgrees(const json& got, const json& want, const json& tolerance) {
  for (const auto& [key, value] : want.items()) {
    ASSERT_TRUE(got.contains(key)) << key << " is missing";
    ExpectAgrees(got[key], value, key, tolerance["rel"].get<double>(), tolerance["abs"].value(key, 0.0));
  }
}

class ScoreVectors : public testing::TestWithParam<fs::path> {};

TEST_P(ScoreVectors, AgreesWithinItsTolerances) {
  const json vector = ReadJsonFile(GetParam());
  json want = vector["expected"];
  if (const auto departure = kDepartures.find(vector["name"]); departure != kDepartures.end()) {
    want.update(departure->second);
  }

  // The reference checks collisions only in the steps that it samples for slips.
  const json got(ScoreEpisode(vector, GetParam(), {.collision_sample_window = 0}));
  EXPECT_EQ(got.size(), want.size() + 1) << got << "\nwhere " << want << " and completion_time are expected";
  ExpectAgrees(got, want, vector["tolerance"]);
  ASSERT_TRUE(got["completion_time"].is_number_float());
  EXPECT_EQ(got["completion_time"], vector["expected_duration"]);

  const json every_step(ScoreEpisode(vector, GetParam()));
  EXPECT_EQ(json(ScoreFile(GetParam())).dump(), every_step.dump());
  if (vector.contains("expected_every_step")) want.update(vector["expected_every_step"]);
  ExpectAgrees(every_step, want, vector["tolerance"]);
  if (vector.contains("analytic")) ExpectAgrees(every_step, vector["analytic"], vector["tolerance"]);
}

INSTANTIATE_TEST_SUITE_P(Public, ScoreVectors, testing::ValuesIn(VectorFiles()),
                         [](const auto& test) { return test.param.stem().string(); });

TEST(ScoreVectorsFolder, HoldsTheVectors) {
  const size_t count = VectorFiles().size();
  if (fs::equivalent(VectorFolder(), fs::path(EVALBUS_SOURCE_DIR) / "tests/data/vectors")) {
    std::cout << "the full set (../shared/vectors) is not here: testing the subset of " << count
              << " in tests/data\n";
    EXPECT_GE(count, 20);
  } else {
    EXPECT_GE(count, 123);
  }
}

}  // namespace evalbus::metrics::score_vectors_test
