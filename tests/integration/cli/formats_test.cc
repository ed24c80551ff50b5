// The files that a run writes are checked against the published schemas, and with the commands and the
// snippet of the documentation.
#include <gtest/gtest.h>

#include <set>

#include "lcmtypes/metric_catalog.h"
#include "metrics/statistics/run_statistics.h"
#include "results/notes.h"
#include "tests/integration/harness.h"

namespace evalbus::formats_test {

namespace fs = std::filesystem;

const fs::path kDocs = fs::path(EVALBUS_SOURCE_DIR) / "docs";

class FormatsTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder;
    Evaluate({"lift_pot/position", "--policy", "noisy_expert", "--episodes", "3", "--in-process"}, A());
    Evaluate({"lift_pot/position", "--policy", "expert", "--episodes", "2", "--in-process"}, B());
  }
  static void TearDownTestSuite() { delete folder_; }
  static fs::path A() { return folder_->path() / "a"; }
  static fs::path B() { return folder_->path() / "b"; }

  static TemporaryFolder* folder_;
};
TemporaryFolder* FormatsTest::folder_ = nullptr;

TEST_F(FormatsTest, SchemasHold) {
  for (const fs::path& run : {A(), B()}) {
    EXPECT_EQ(SchemaError("summary", run / "summary.json"), "");
    EXPECT_EQ(SchemaError("run", run / "run.json"), "");
    EXPECT_EQ(SchemaError("episode", run / "episodes/0000/summary.json"), "");
    EXPECT_EQ(SchemaError("episode", run / "episodes.jsonl"), "");
  }
  results::WriteNote(A(), 1, "odd start");
  EXPECT_EQ(SchemaError("notes", A() / "notes.json"), "");
  fs::remove(A() / "notes.json");
  // The schemas refuse invalid documents.
  auto broken = nlohmann::ordered_json::parse(ReadText(A() / "summary.json"));
  broken["metrics"]["completion_time"].erase("mean_95");
  WriteText(folder_->path() / "broken.json", broken.dump());
  EXPECT_NE(SchemaError("summary", folder_->path() / "broken.json"), "");
  broken = nlohmann::ordered_json::parse(ReadText(A() / "episodes/0000/summary.json"));
  broken["end_reason"] = "boredom";
  WriteText(folder_->path() / "broken.json", broken.dump());
  EXPECT_NE(SchemaError("episode", folder_->path() / "broken.json"), "");
  for (const char* key : {"extended", "explanation"}) {
    broken = nlohmann::ordered_json::parse(ReadText(A() / "episodes/0000/summary.json"));
    broken[key]["unheard_of"] = 1;
    WriteText(folder_->path() / "broken.json", broken.dump());
    EXPECT_NE(SchemaError("episode", folder_->path() / "broken.json"), "") << key;
  }
}

TEST_F(FormatsTest, SchemaOfViolationsOfForceLimitsHolds) {
  const fs::path limits = folder_->path() / "limits.yaml", out = folder_->path() / "limited";
  WriteText(
      limits,
      "limits: {pot: {bodies: [pot], quasi_static_force_N: 1, transient_force_N: 1, grip_force_N: 1}}\n");
  Evaluate({"lift_pot/position", "--policy", "expert", "--episodes", "1", "--in-process", "--limits", limits},
           out);
  EXPECT_NE(ReadText(out / "episodes.jsonl").find("\"limit\":\"grip\""), std::string::npos);
  EXPECT_EQ(SchemaError("episode", out / "episodes.jsonl"), "");
}

// Other tests check the schemas against files that commands wrote.
TEST_F(FormatsTest, EverySchemaIsInTheDocumentation) {
  const std::string page = ReadText(kDocs / "versioning.md");
  for (const auto& schema : fs::directory_iterator(kDocs / "schema")) {
    const std::string name = schema.path().filename().string();
    EXPECT_NE(page.find("(schema/" + name + ")"), std::string::npos) << name;
  }
}

TEST_F(FormatsTest, SchemaOfALatencyCurveHolds) {
  const fs::path out = folder_->path() / "latency";
  const Result result =
      RunProgram({"evalbus", "latency", ShortTask(folder_->path(), 0.4), "--policy", "random", "--delays",
                  "0,100", "--execution", "synchronous,rtc", "--episodes", "1", "--out", out});
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(SchemaError("latency", out / "latency.json"), "");
  EXPECT_FALSE(fs::exists(out / "parts"));
  EXPECT_NE(result.out.find("\nsynchronous: success is not shown to depend on the delay: "),
            std::string::npos)
      << result.out;
  for (const auto& entry : fs::recursive_directory_iterator(out)) {
    if (entry.path().filename() == "policy_calls.json") {
      EXPECT_EQ(SchemaError("policy_calls", entry.path()), "");
    }
  }
}

// The catalog has every number in `metrics` and `extended` of an episode.
TEST_F(FormatsTest, CatalogKnowsEveryNumber) {
  for (const nlohmann::ordered_json& episode : Episodes(A())) {
    std::set<std::string> numbers;
    for (const auto& [name, value] : metrics::FlattenedValues({{"extended", episode["extended"]}})) {
      numbers.emplace(name);
    }
    for (const auto& [name, value] : metrics::FlattenedValues(episode["metrics"])) numbers.emplace(name);
    EXPECT_GT(numbers.size(), 60u);
    for (const std::string& name : numbers) {
      EXPECT_NE(FindMetric(name).metric, nullptr) << name << " is not in lcmtypes/metric_catalog.cc";
    }
  }
}

TEST_F(FormatsTest, PythonOfTheDocumentationRuns) {
  const std::string page = ReadText(kDocs / "run_folder.md");
  const size_t begin = page.find("```python\n") + 10;
  const std::string code = page.substr(begin, page.find("```", begin) - begin);
  const Result result = RunProgram({"/usr/bin/python3", "-c", code, B()});
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(result.out.substr(0, 30), "2 of 2 episodes succeeded\nmedi") << result.out;
}

TEST_F(FormatsTest, Export) {
  const fs::path csv = folder_->path() / "a.csv";
  const Result result = RunProgram({"evalbus", "export", A(), "--csv", csv});
  EXPECT_EQ(result.code, 0) << result.err;
  const Result rows = RunProgram({"/usr/bin/python3", "-c",
                                  "import csv, json, sys\n"
                                  "rows = list(csv.DictReader(open(sys.argv[1])))\n"
                                  "lines = [json.loads(l) for l in open(sys.argv[2])]\n"
                                  "assert len(rows) == len(lines) == 3\n"
                                  "for row, line in zip(rows, lines):\n"
                                  "    assert int(row['seed']) == line['seed']\n"
                                  "    left = line['metrics']['cartesian_path_length']['left']\n"
                                  "    assert float(row['cartesian_path_length.left']) == left\n",
                                  csv, A() / "episodes.jsonl"});
  EXPECT_EQ(rows.code, 0) << rows.err;
}

TEST_F(FormatsTest, Compare) {
  const fs::path json = folder_->path() / "comparison.json";
  const Result result = RunProgram({"evalbus", "compare", A(), B(), "--baseline", "expert", "--json", json});
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_NE(result.out.find("a (noisy_expert) against b (expert), lift_pot/position\n"), std::string::npos)
      << result.out;
  EXPECT_EQ(SchemaError("comparison", json), "");
  const auto comparison = nlohmann::ordered_json::parse(ReadText(json));
  EXPECT_EQ(comparison["baseline"]["policy"], "expert");
  EXPECT_EQ(comparison["comparisons"][0]["success"]["episodes"], 2);
  EXPECT_EQ(comparison["comparisons"][0]["tasks"][0]["unmatched"], 1);

  // Three runs are also ranked.
  ASSERT_EQ(RunProgram({"evalbus", "compare", A(), B(), B(), "--json", json}).code, 0);
  EXPECT_EQ(nlohmann::ordered_json::parse(ReadText(json))["ranking"].size(), 3u);
  EXPECT_EQ(SchemaError("comparison", json), "");

  const Result unknown = RunProgram({"evalbus", "compare", A(), B(), "--baseline", "unknown"});
  EXPECT_EQ(unknown.code, 1);
  EXPECT_EQ(unknown.err,
            "error: --baseline unknown: neither one of the runs nor a folder; the runs are a (noisy_expert), "
            "b (expert)\n");
}

// A baseline that is named only by --baseline is an additional run.
TEST_F(FormatsTest, CompareWithABaselineOutsideTheRuns) {
  const fs::path other = folder_->path() / "other/a", json = folder_->path() / "alike.json";
  fs::create_directories(other.parent_path());
  fs::copy(B(), other, fs::copy_options::recursive);
  ASSERT_EQ(RunProgram({"evalbus", "compare", A(), "--baseline", other, "--json", json}).code, 0);
  const auto comparison = nlohmann::ordered_json::parse(ReadText(json));
  EXPECT_NE(comparison["baseline"]["name"], comparison["comparisons"][0]["name"]);

  const fs::path video = folder_->path() / "video.gif";
  const Result three = RunProgram({"evalbus", "compare", A(), B(), "--baseline", other, "--video", video});
  EXPECT_EQ(three.code, 1);
  EXPECT_EQ(three.err, "error: --video: expected two runs or suites, got 3\n");
  EXPECT_FALSE(fs::exists(video));
}

}  // namespace evalbus::formats_test
