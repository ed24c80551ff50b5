#include "cli/results/run_reader.h"

#include <gtest/gtest.h>

#include "base/errors.h"
#include "tests/unit/cli/results/run_folders.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::results {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

class RunReaderTest : public testing::Test {
 protected:
  // What reading says, without the name of the test's folder.
  std::string Error(const fs::path& folder) {
    try {
      ReadRuns(folder);
    } catch (const InputError& error) {
      std::string text = error.what();
      EXPECT_EQ(text.find('\n'), std::string::npos) << text;
      const std::string here = folder_.path().string() + "/";
      if (text.starts_with(here)) text.erase(0, here.size());
      return text;
    }
    return "read";
  }
  std::string ErrorOfLines(const std::string& text) {
    WriteRun(run_, RunInfo(5), {});
    WriteFile(run_ / "episodes.jsonl", text);
    return Error(run_);
  }
  // A line of which a member is replaced.
  static std::string Line(int episode, const std::string& key = "", const ordered_json& value = {}) {
    ordered_json line = EpisodeLine(episode);
    if (!key.empty()) line[key] = value;
    return line.dump() + "\n";
  }

  TemporaryFolder folder_;
  const fs::path run_ = folder_.path() / "run";
};

TEST_F(RunReaderTest, FinishedRun) {
  ordered_json first = EpisodeLine(0, true, {{"path", {{"left", 1.5}, {"right", 2}}}, {"held", true}});
  WriteRun(run_, RunInfo(3), {first, EpisodeLine(2), EpisodeLine(1, false)});
  const RecordedRun run = ReadRun(run_);
  EXPECT_EQ(run.name, "run");
  EXPECT_EQ(ReadRun(run_ / "").name, "run");
  EXPECT_EQ(run.task_name(), "lift_pot/position");
  EXPECT_EQ(run.policy, "expert");
  EXPECT_EQ(run.info["control_hz"], 50);
  ASSERT_EQ(run.episodes.size(), 3u);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(run.episodes[static_cast<size_t>(i)].episode, i);
  EXPECT_EQ(run.episodes[1].line, 3);
  EXPECT_TRUE(run.episodes[0].success);
  EXPECT_FALSE(run.episodes[1].success);
  EXPECT_EQ(run.episodes[1].failure_reason, "timeout");
  EXPECT_EQ(run.episodes[0].json, first);
  const std::vector<std::pair<std::string, double>> values = {
      {"path.left", 1.5}, {"path.right", 2}, {"held", 1}, {"success", 1}, {"extended.missing_ticks", 0}};
  EXPECT_EQ(run.episodes[0].Values(), values);
  EXPECT_TRUE(run.Remarks().empty());
}

TEST_F(RunReaderTest, EqualEpisodesAreRemarked) {
  WriteRun(run_, RunInfo(2), {EpisodeLine(0), EpisodeLine(1)});
  const std::vector<std::string> remarks = ReadRun(run_).Remarks();
  ASSERT_EQ(remarks.size(), 1u);
  EXPECT_TRUE(remarks[0].starts_with("all 2 episodes are equal in every number, so they are one sample"));
}

TEST_F(RunReaderTest, InterruptedRunSaysSo) {
  ordered_json incomplete = EpisodeLine(1);
  incomplete["complete"] = false;
  WriteRun(run_, RunInfo(20), {EpisodeLine(0), incomplete, EpisodeLine(2, false)});
  fs::create_directories(run_ / "episodes/0003.partial");
  fs::create_directories(run_ / "episodes/0002");
  const RecordedRun run = ReadRun(run_);
  EXPECT_EQ(run.episodes.size(), 3u);
  EXPECT_EQ(run.incomplete(), std::vector<int>{1});
  EXPECT_EQ(run.unfinished, std::vector<int>{3});
  EXPECT_EQ(run.Remarks(),
            (std::vector<std::string>{
                "3 of 20 episodes have finished", "begun and not finished: episode 3",
                "left out of all rates, since ticks are missing or samples were refused: episode 1"}));
}

TEST_F(RunReaderTest, RefusesWhatIsNoRunFolder) {
  EXPECT_EQ(Error(run_), "run: no such run folder");
  WriteFile(folder_.path() / "file", "x");
  EXPECT_EQ(Error(folder_.path() / "file"), "file: a file; expected a run folder");
  fs::create_directories(run_);
  EXPECT_EQ(Error(run_), "run: not a run folder of evalbus, it has no run.json");
  WriteFile(run_ / "run.json", "{\n  \"task\": \"lift_pot\",\n  nonsense\n}\n");
  EXPECT_EQ(Error(run_).substr(0, 29), "run/run.json:3: expected JSON");
  WriteFile(run_ / "run.json", "[1]\n");
  EXPECT_EQ(Error(run_), "run/run.json: not a JSON object");
  WriteFile(run_ / "run.json", "{\"task\": \"x\"}\n");
  EXPECT_EQ(Error(run_), "run/run.json: no \"variation\"; is this of evalbus?");
  WriteFile(run_ / "run.json", "{\"task\": 1}\n");
  EXPECT_EQ(Error(run_), "run/run.json: \"task\" is 1, expected a name");
  WriteRun(run_, RunInfo(3), {});
  EXPECT_EQ(Error(run_), "run: this run has no finished episode");
}

TEST_F(RunReaderTest, RefusesLinesThatDoNotBelong) {
  EXPECT_EQ(ErrorOfLines(Line(0) + Line(1)), "read");
  EXPECT_EQ(ErrorOfLines(Line(0) + "oops\n" + Line(1)), "run/episodes.jsonl:2: not JSON");
  EXPECT_EQ(ErrorOfLines(Line(0) + "\n"), "run/episodes.jsonl:2: not JSON");
  EXPECT_EQ(ErrorOfLines(Line(0) + "{\"episode\": 1e999}\n"), "run/episodes.jsonl:2: not JSON");
  EXPECT_EQ(ErrorOfLines("3\n"), "run/episodes.jsonl:1: not a JSON object");
  EXPECT_EQ(
      ErrorOfLines(Line(0) + Line(1).substr(0, 40)),
      "run/episodes.jsonl:2: cut off in mid-line: the run was stopped while this was written; remove the "
      "line");
  EXPECT_EQ(ErrorOfLines(Line(0) + Line(1) + Line(0)),
            "run/episodes.jsonl:3: episode 0 again, first in line 1");
  EXPECT_EQ(
      ErrorOfLines(Line(0) + Line(1, "task", "stack_two_blocks")),
      "run/episodes.jsonl:2: an episode of stack_two_blocks/position in a run of lift_pot/position: runs "
      "must not be mixed in one file");
  EXPECT_EQ(
      ErrorOfLines(Line(0, "variation", "base")),
      "run/episodes.jsonl:1: an episode of lift_pot/base in a run of lift_pot/position: runs must not be "
      "mixed in one file");
  EXPECT_EQ(
      ErrorOfLines(Line(0, "seed", 12)),
      "run/episodes.jsonl:1: seed 12 is not that of episode 0 in a run with seed 7: a line of another run");
  EXPECT_EQ(ErrorOfLines("{\"name\": 1}\n"), "run/episodes.jsonl:1: no \"task\"; is this of evalbus?");
  EXPECT_EQ(ErrorOfLines(Line(0, "complete", 1)),
            "run/episodes.jsonl:1: \"complete\" is 1, expected true or false");
  EXPECT_EQ(ErrorOfLines(Line(0, "episode", -1)),
            "run/episodes.jsonl:1: \"episode\" is -1, expected a number from 0");
  EXPECT_EQ(ErrorOfLines(Line(0, "metrics", ordered_json::object())),
            "run/episodes.jsonl:1: \"metrics\" without a \"success\" of 0 or 1");
}

TEST_F(RunReaderTest, Suite) {
  WriteFile(run_ / "suite.json", R"({"runs": ["a", "b", "c"]})");
  EXPECT_EQ(Error(run_), "run: this suite has no finished episode");
  WriteRun(run_ / "a", RunInfo(1), {EpisodeLine(0)});
  WriteRun(run_ / "b", RunInfo(2), {EpisodeLine(0), EpisodeLine(1)});
  const RecordedRuns suite = ReadRuns(run_);
  EXPECT_TRUE(suite.is_suite);
  EXPECT_EQ(suite.name, "run");
  ASSERT_EQ(suite.runs.size(), 2u);
  EXPECT_EQ(suite.runs[0].name, "run/a");
  EXPECT_EQ(suite.runs[1].episodes.size(), 2u);
  EXPECT_EQ(suite.missing, std::vector<std::string>{"c"});
  EXPECT_FALSE(ReadRuns(run_ / "a").is_suite);
  EXPECT_THROW(ReadRun(run_), InputError);

  for (const std::string name : {"../b", "..", ".", "", "/etc", "a/../../b"}) {
    WriteFile(run_ / "suite.json", R"({"runs": ["a", ")" + name + R"("]})");
    EXPECT_EQ(Error(run_),
              "run/suite.json: \"" + name + "\" in \"runs\", expected the name of a folder in this one");
  }
  WriteFile(run_ / "suite.json", R"({"run": []})");
  EXPECT_EQ(Error(run_), "run/suite.json: no \"runs\", expected a list of folders in this one");
  WriteFile(run_ / "suite.json", R"({"runs": ["a", "b"]})");
  WriteFile(run_ / "b/episodes.jsonl", Line(0) + "oops\n");
  EXPECT_EQ(Error(run_), "run/b/episodes.jsonl:2: not JSON");
}

}  // namespace
}  // namespace evalbus::results
