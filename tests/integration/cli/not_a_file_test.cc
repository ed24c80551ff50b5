// Input that is not a regular file is refused immediately, so no command waits for a pipe or reads a device.
#include <sys/stat.h>

#include "tests/integration/harness.h"

namespace evalbus::not_a_file_test {

namespace fs = std::filesystem;

class NotAFile : public testing::TestWithParam<bool> {
 protected:
  static void SetUpTestSuite() {
    made_ = new TemporaryFolder;
    const std::string task = ShortTask(made_->path(), 0.1);
    Evaluate({task, "--policy", "hold", "--episodes", "2", "--in-process"}, made_->path() / "run");
    Evaluate({task, "--policy", "hold", "--episodes", "2", "--in-process"}, made_->path() / "other");
  }
  static void TearDownTestSuite() {
    delete made_;
    made_ = nullptr;
  }
  void SetUp() override {
    for (const char* run : {"run", "other"}) {
      fs::copy(made_->path() / run, folder_.path() / run, fs::copy_options::recursive);
    }
  }

  // Creates a named pipe without a writer, or a link to an endless device.
  void Put(const fs::path& file) const {
    fs::remove(file);
    if (GetParam()) {
      ASSERT_EQ(mkfifo(file.c_str(), 0600), 0);
    } else {
      fs::create_symlink("/dev/zero", file);
    }
  }
  void ExpectRefused(const fs::path& file, const std::vector<std::vector<std::string>>& commands) const {
    Put(file);
    for (std::vector<std::string> command : commands) {
      command.insert(command.begin(), "evalbus");
      SCOPED_TRACE(testing::PrintToString(command));
      const Result result = RunProgram(command, {folder_.path(), nullptr});
      EXPECT_EQ(result.code, 1) << result.out;
      EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
      EXPECT_NE(result.err.find(GetParam() ? "a named pipe, expected a file" : "a device, expected a file"),
                std::string::npos)
          << result.err;
      EXPECT_NE(result.err.find(file.filename().string()), std::string::npos) << result.err;
    }
  }

  static TemporaryFolder* made_;
  const TemporaryFolder folder_;
  const fs::path run_ = folder_.path() / "run";
};
TemporaryFolder* NotAFile::made_ = nullptr;

TEST_P(NotAFile, RunJson) {
  ExpectRefused(run_ / "run.json", {{"report", "run", "-o", "a.html"},
                                    {"export", "run", "--csv", "a.csv"},
                                    {"export", "run", "--hdf5", "a.hdf5"},
                                    {"rescore", "run"},
                                    {"compare", "other", "run"},
                                    {"merge", "whole", "run", "other"},
                                    {"monitor", "run"},
                                    {"run", "lift_pot", "--in-process", "--out", "run", "--resume"},
                                    {"run", "--like", "run"}});
}

TEST_P(NotAFile, EpisodesJsonl) {
  ExpectRefused(run_ / "episodes.jsonl", {{"report", "run", "-o", "a.html"},
                                          {"export", "run", "--csv", "a.csv"},
                                          {"export", "run", "--safetensors", "a"},
                                          {"rescore", "run"},
                                          {"compare", "other", "run"}});
}

TEST_P(NotAFile, Log) {
  const fs::path log = evalbus::LogFile(run_, 1);
  ExpectRefused(log, {{"export", "run", "--hdf5", "a.hdf5"},
                      {"export", "run", "--mcap"},
                      {"rescore", "run"},
                      {"export", "run", "--safetensors", "a"},
                      {"merge", "whole", "run"}});
}

TEST_P(NotAFile, Yaml) {
  ExpectRefused(folder_.path() / "a.yaml", {{"tasks", "check", "a.yaml"},
                                            {"tasks", "show", "a.yaml"},
                                            {"robots", "check", "a.yaml"},
                                            {"policy", "show", "a.yaml"},
                                            {"plan", "check", "a.yaml"},
                                            {"run", "a.yaml", "--in-process"},
                                            {"run", "lift_pot", "--in-process", "--robot", "a.yaml"},
                                            {"run", "lift_pot", "--in-process", "--policy", "a.yaml"},
                                            {"rescore", "run", "--task", "a.yaml"},
                                            {"score", "a.yaml", "run/run.json", "--out", "scored"},
                                            {"watch", "lift_pot", "--map", "a.yaml", "--out", "watched"}});
}

TEST_P(NotAFile, Json) {
  ExpectRefused(folder_.path() / "a.json", {{"score", "a.json"}, {"run", "--options", "a.json", "lift_pot"}});
  fs::create_directory(folder_.path() / "suite");
  ExpectRefused(folder_.path() / "suite/suite.json",
                {{"export", "suite", "--csv", "a.csv"}, {"rescore", "suite"}});
  fs::create_directory(folder_.path() / "plan");
  ExpectRefused(folder_.path() / "plan/plan.json",
                {{"merge", "plan"}, {"status", "plan"}, {"run", "plan/plan.json"}});
}

TEST_P(NotAFile, Tables) {
  WriteText(
      folder_.path() / "map.yaml",
      "task: lift_pot/base\nrate_hz: 50\njoints: {unit: rad, columns: {left/joint1: a, left/joint2: b, "
      "left/joint3: c, "
      "left/joint4: d, left/joint5: e, left/joint6: f, left/joint7: g, right/joint1: h, right/joint2: i, "
      "right/joint3: j, right/joint4: k, right/joint5: l, right/joint6: m, right/joint7: n}}\n"
      "grippers: {left: open, right: open}\n");
  for (const char* table : {"a.csv", "a.npz", "a.h5"}) {
    ExpectRefused(folder_.path() / table, {{"score", "map.yaml", table, "--out", "scored"}});
    EXPECT_FALSE(fs::exists(folder_.path() / "scored"));
  }
  fs::create_directory(folder_.path() / "tables");
  ExpectRefused(folder_.path() / "tables/a.csv", {{"score", "map.yaml", "tables", "--out", "scored"}});
}

INSTANTIATE_TEST_SUITE_P(Kinds, NotAFile, testing::Bool(),
                         [](const auto& test) { return std::string(test.param ? "NamedPipe" : "Device"); });

}  // namespace evalbus::not_a_file_test
