#include "results/run_reader.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "base/errors.h"
#include "base/run_layout.h"
#include "base/write_whole.h"
#include "results/found_runs.h"
#include "results/run_folder.h"
#include "tests/unit/results/run_folders.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::results::run_reader_test {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

class RunReaderTest : public testing::Test {
 protected:
  // Returns the error of reading, without the path of the test's folder.
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
  // Returns a line in which one member is replaced.
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
  EXPECT_EQ(run.episodes[0].Json(), first);
  const metrics::NamedNumbers values = {
      {"path.left", 1.5}, {"path.right", 2},      {"held", 1},
      {"success", 1},     {"completion_time", 4}, {"extended.missing_ticks", 0}};
  EXPECT_EQ(run.episodes[0].Values(), values);
  EXPECT_TRUE(run.Remarks().empty());
}

TEST_F(RunReaderTest, EqualEpisodesAreRemarked) {
  WriteRun(run_, RunInfo(2), {EpisodeLine(0), EpisodeLine(1)});
  const std::vector<std::string> remarks = ReadRun(run_).Remarks();
  ASSERT_EQ(remarks.size(), 1u);
  EXPECT_TRUE(remarks[0].starts_with("all 2 episodes have equal starts and equal numbers"));
}

TEST_F(RunReaderTest, ParametersAreNumbers) {
  EXPECT_EQ(ErrorOfLines(Line(0) + Line(1, "parameters", {{"pot_x_m", 0.5}})), "read");
  EXPECT_EQ(ReadRun(run_).episodes[1].parameters, (metrics::NamedNumbers{{"pot_x_m", 0.5}}));
  EXPECT_EQ(ErrorOfLines(Line(0, "parameters", "none")),
            "run/episodes.jsonl:1: \"parameters\" is \"none\", expected an object");
  EXPECT_EQ(ErrorOfLines(Line(0, "parameters", {{"pot_x_m", "far"}})),
            "run/episodes.jsonl:1: \"parameters\": pot_x_m is \"far\", expected a number");
}

TEST_F(RunReaderTest, ACollectionIsNoSampleOfThePolicy) {
  WriteRun(run_, RunInfo(2), {EpisodeLine(0), EpisodeLine(1, true, {{"slip_count", 1}})});
  WriteFile(run_ / "collect.json", "{}");
  EXPECT_EQ(
      ReadRun(run_).Remarks(),
      (std::vector<std::string>{
          "collected demonstrations: only successes were kept, so its rates do not describe the policy"}));
}

TEST_F(RunReaderTest, InterruptedRunReportsIt) {
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
            (std::vector<std::string>{"3 of 20 episodes have finished", "started but not finished: episode 3",
                                      "excluded from all rates because they are incomplete (aborted, or with "
                                      "missing ticks or refused samples): episode 1"}));
}

// run.json of a collection lists the kept episodes under "only", as --only does.
TEST_F(RunReaderTest, ChosenEpisodesAreAllOfARun) {
  ordered_json info = RunInfo(20);
  info["only"] = {1, 7};
  WriteRun(run_, info, {EpisodeLine(1), EpisodeLine(7, false)});
  EXPECT_EQ(ReadRun(run_).Remarks(), std::vector<std::string>{});
  WriteRun(run_, info, {EpisodeLine(1)});
  EXPECT_EQ(ReadRun(run_).Remarks(), std::vector<std::string>{"1 of 2 episodes have finished"});
  // A collection keeps fewer episodes than it tries.
  WriteWhole(run_ / kCollectJson, "{}");
  EXPECT_THAT(ReadRun(run_).Remarks(),
              testing::ElementsAre(testing::StartsWith("collected demonstrations: ")));
}

TEST_F(RunReaderTest, InvalidEpisodesAreCountedForThemselves) {
  ordered_json invalid = EpisodeLine(1, false), incomplete = EpisodeLine(2);
  invalid["complete"] = incomplete["complete"] = false;
  invalid["end_reason"] = invalid["failure_reason"] = "server_error";
  WriteRun(run_, RunInfo(3), {EpisodeLine(0), invalid, incomplete});
  const RecordedRun run = ReadRun(run_);
  EXPECT_EQ(run.invalid(), std::vector<int>{1});
  EXPECT_EQ(run.incomplete(), std::vector<int>{2});
  EXPECT_EQ(run.Remarks(),
            (std::vector<std::string>{
                "invalid and excluded from all rates because the policy's server failed: episode 1; --resume "
                "runs it "
                "again",
                "excluded from all rates because they are incomplete (aborted, or with missing ticks or "
                "refused samples): episode 2"}));
  const metrics::RunSummary summary = run.Statistics().Summary(false);
  EXPECT_EQ(summary.episodes, 3);
  EXPECT_EQ(summary.complete, 1);
  EXPECT_EQ(summary.invalid, 1);
  EXPECT_EQ(summary.successes, 1);
  invalid["complete"] = true;
  EXPECT_EQ(ErrorOfLines(EpisodeLine(0).dump() + "\n" + invalid.dump() + "\n"),
            "run/episodes.jsonl:2: \"complete\" with \"end_reason\" server_error: such an episode cannot be "
            "complete");
}

TEST_F(RunReaderTest, AMisspelledFolderGetsAHint) {
  WriteRun(folder_.path() / "early", RunInfo(1), {EpisodeLine(0)});
  fs::create_directories(folder_.path() / "earlx");  // not a run
  const std::string hint =
      ": no such run folder; did you mean '" + (folder_.path() / "early").string() + "'?";
  EXPECT_TRUE(Error(folder_.path() / "earli").ends_with(hint)) << Error(folder_.path() / "earli");
  EXPECT_TRUE(Error(folder_.path() / "earli/").ends_with(hint)) << Error(folder_.path() / "earli/");
  EXPECT_EQ(Error(folder_.path() / "other"), "other: no such run folder");
  EXPECT_EQ(SimilarFolder("/nowhere/at/all"), "");
}

TEST_F(RunReaderTest, RefusesWhatIsNoRunFolder) {
  EXPECT_EQ(Error(run_), "run: no such run folder");
  WriteFile(folder_.path() / "file", "x");
  EXPECT_EQ(Error(folder_.path() / "file"), "file: a file; expected a run folder");
  fs::create_directories(run_);
  EXPECT_EQ(Error(run_), "run: not a run folder of evalbus: it has no run.json");
  fs::create_directories(folder_.path() / "plan");
  WriteFile(folder_.path() / "plan/plan.json", "{}");
  EXPECT_EQ(Error(folder_.path() / "plan"),
            "plan: the folder of a plan; expected the folder of one of its policies or runs");
  for (const char* policy : {"b", "a"}) {
    fs::create_directories(folder_.path() / "plan" / policy / "task");
    WriteFile(folder_.path() / "plan" / policy / "suite.json", "{}");
    WriteFile(folder_.path() / "plan" / policy / "task/run.json", "{}");
  }
  const std::string plan = (folder_.path() / "plan").string();
  const std::string suites = "policies or runs, for example " + plan + "/a";
  EXPECT_THAT([&] { ReadRuns(plan); }, testing::ThrowsMessage<InputError>(testing::EndsWith(suites)));
  const std::string runs = "expected the folder of one of its runs, for example " + plan + "/a/task";
  EXPECT_THAT([&] { ReadRun(plan); }, testing::ThrowsMessage<InputError>(testing::EndsWith(runs)));
  WriteFile(run_ / "run.json", "{\n  \"task\": \"lift_pot\",\n  nonsense\n}\n");
  EXPECT_EQ(Error(run_).substr(0, 29), "run/run.json:3: expected JSON");
  WriteFile(run_ / "run.json", "[1]\n");
  EXPECT_EQ(Error(run_), "run/run.json: not a JSON object");
  WriteFile(run_ / "run.json", "{\"task\": \"x\"}\n");
  EXPECT_EQ(Error(run_), "run/run.json: no \"variation\"; was this made by evalbus?");
  WriteFile(run_ / "run.json", "{\"task\": 1}\n");
  EXPECT_EQ(Error(run_), "run/run.json: \"task\" is 1, expected a name");
  WriteRun(run_, RunInfo(3), {});
  EXPECT_EQ(Error(run_), "run: this run has no finished episode");
}

TEST_F(RunReaderTest, RefusesLinesThatDoNotBelong) {
  EXPECT_EQ(ErrorOfLines(Line(0) + Line(1)), "read");
  const std::string no_json = "run/episodes.jsonl:2: expected JSON, syntax error while parsing value";
  EXPECT_EQ(ErrorOfLines(Line(0) + "oops\n" + Line(1)).substr(0, no_json.size()), no_json);
  EXPECT_EQ(ErrorOfLines(Line(0) + "\n").substr(0, no_json.size()), no_json);
  EXPECT_EQ(ErrorOfLines(Line(0) + "{\"episode\": 1e999}\n"),
            "run/episodes.jsonl:2: expected JSON, the number 1e999 does not fit a double");
  EXPECT_EQ(ErrorOfLines(Line(0) + "{\"a\": 1, \"a\": 2}\n"),
            "run/episodes.jsonl:2: a: repeated key, expected each key once");
  EXPECT_EQ(ErrorOfLines(std::string(300'000, '[') + "\n"),
            "run/episodes.jsonl:1: expected JSON nested at most 64 levels deep");
  EXPECT_EQ(ErrorOfLines("3\n"), "run/episodes.jsonl:1: not a JSON object");
  EXPECT_EQ(ErrorOfLines(Line(0) + Line(1) + Line(0)),
            "run/episodes.jsonl:3: episode 0 is repeated, first in line 1");
  EXPECT_EQ(
      ErrorOfLines(Line(0) + Line(1, "task", "stack_two_blocks")),
      "run/episodes.jsonl:2: an episode of stack_two_blocks/position in a run of lift_pot/position: runs "
      "must not be mixed in one file");
  EXPECT_EQ(
      ErrorOfLines(Line(0, "variation", "base")),
      "run/episodes.jsonl:1: an episode of lift_pot/base in a run of lift_pot/position: runs must not be "
      "mixed in one file");
  EXPECT_EQ(ErrorOfLines(Line(0, "seed", 12)),
            "run/episodes.jsonl:1: seed 12 is not the seed of episode 0 in a run with seed 7: the line "
            "belongs to another run");
  EXPECT_EQ(ErrorOfLines("{\"name\": 1}\n"), "run/episodes.jsonl:1: no \"task\"; was this made by evalbus?");
  EXPECT_EQ(ErrorOfLines(Line(0, "complete", 1)),
            "run/episodes.jsonl:1: \"complete\" is 1, expected true or false");
  EXPECT_EQ(ErrorOfLines(Line(0, "episode", -1)),
            "run/episodes.jsonl:1: \"episode\" is -1, expected 0 to 99999999");
  EXPECT_EQ(ErrorOfLines(Line(0, "metrics", ordered_json::object())),
            "run/episodes.jsonl:1: \"metrics\" without a \"success\" of 0 or 1");
}

// A line must have every value that other code reads.
TEST_F(RunReaderTest, RefusesLinesThatLackSomething) {
  const auto without = [this](const std::string& pointer) {
    ordered_json line = EpisodeLine(0);
    ordered_json::json_pointer at(pointer);
    line[at.parent_pointer()].erase(at.back());
    return ErrorOfLines(line.dump() + "\n");
  };
  for (const std::string key : {"task", "variation", "episode", "seed", "end_reason", "end_detail",
                                "failure_reason", "complete", "metrics", "extended", "explanation"}) {
    EXPECT_EQ(without("/" + key), "run/episodes.jsonl:1: no \"" + key + "\"; was this made by evalbus?");
  }
  EXPECT_EQ(without("/metrics/completion_time"),
            "run/episodes.jsonl:1: no \"completion_time\"; was this made by evalbus?");
  EXPECT_EQ(without("/explanation/text"), "run/episodes.jsonl:1: no \"text\"; was this made by evalbus?");
  EXPECT_EQ(ErrorOfLines(Line(0, "end_detail", nullptr)),
            "run/episodes.jsonl:1: \"end_detail\" is null, expected a string");
  EXPECT_EQ(ErrorOfLines(Line(0, "explanation", "fell")),
            "run/episodes.jsonl:1: \"explanation\" is \"fell\", expected an object");
  EXPECT_EQ(ErrorOfLines(Line(0, "pacing", 1)), "run/episodes.jsonl:1: \"pacing\" is 1, expected an object");
  EXPECT_EQ(ErrorOfLines(Line(0, "pacing", {{"ticks", 0.5}})),
            "run/episodes.jsonl:1: \"ticks\" is 0.5, expected a whole number");
  ordered_json line = EpisodeLine(0);
  line["metrics"]["task_stage_reached"] = {{"1", "yes"}};
  EXPECT_EQ(ErrorOfLines(line.dump() + "\n"),
            "run/episodes.jsonl:1: stages, slips, collisions or final poses are not numbers");
}

// The run was killed, or its disk was full, while it wrote the line.
TEST_F(RunReaderTest, ExcludesATruncatedLastLineWithARemark) {
  WriteRun(run_, RunInfo(3), {EpisodeLine(0)});
  const std::string whole = Line(0) + Line(1);
  for (const size_t rest : {size_t{1}, Line(1).size() - 2}) {
    WriteFile(run_ / "episodes.jsonl", whole.substr(0, Line(0).size() + rest));
    const RecordedRun run = ReadRun(run_);
    ASSERT_EQ(run.episodes.size(), 1u);
    EXPECT_EQ(run.Remarks().at(1),
              "line 2 of episodes.jsonl is truncated and ignored: the run was stopped while it was written");
  }
  // The line is complete except for its newline.
  WriteFile(run_ / "episodes.jsonl", whole.substr(0, whole.size() - 1));
  EXPECT_EQ(ReadRun(run_).episodes.size(), 2u);
}

// An I/O error must not be taken for the end of the file, because episodes would be missing unnoticed.
TEST_F(RunReaderTest, AFailedReadIsNotTheEndOfTheRun) {
  WriteRun(run_, RunInfo(3), {});
  fs::remove(run_ / "episodes.jsonl");
  fs::create_symlink("/proc/self/mem", run_ / "episodes.jsonl");
  EXPECT_THROW(ReadRunAsFarAsItGot(run_), EnvironmentError);
  EXPECT_THROW(EpisodeLines(run_ / "episodes.jsonl").Next(), EnvironmentError);
}

TEST_F(RunReaderTest, RefusesANumberOfEpisodesThatNoRunHas) {
  for (const int64_t episodes : {int64_t{-1}, int64_t{1} << 32}) {
    ordered_json info = RunInfo(3);
    info["episodes"] = episodes;
    WriteRun(run_, info, {EpisodeLine(0)});
    EXPECT_EQ(Error(run_), fmt::format("run/run.json: \"episodes\" is {}, expected 0 to 99999999", episodes));
  }
}

TEST_F(RunReaderTest, VersionOfTheSchema) {
  ordered_json info = RunInfo(1);
  info["schema_version"] = 1;
  WriteRun(run_, info, {EpisodeLine(0)});
  EXPECT_EQ(Error(run_), "read");
  info["schema_version"] = 2;
  info["evalbus_version"] = "9.0";
  WriteRun(run_, info, {EpisodeLine(0)});
  EXPECT_EQ(Error(run_),
            "run/run.json: \"schema_version\" is 2, expected 1; read this run with evalbus \"9.0\"");
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
              "run/suite.json: \"" + name + "\" in \"runs\", expected the name of a folder in the suite");
  }
  WriteFile(run_ / "suite.json", R"({"runs": ["a", "b", "a"]})");
  EXPECT_EQ(Error(run_), "run/suite.json: \"a\" is listed in \"runs\" twice");
  WriteFile(run_ / "suite.json", R"({"run": []})");
  EXPECT_EQ(Error(run_), "run/suite.json: no \"runs\", expected a list of folders in the suite");
  WriteFile(run_ / "suite.json", R"({"runs": ["a", "b"]})");
  WriteFile(run_ / "b/episodes.jsonl", Line(0) + "oops\n");
  EXPECT_TRUE(Error(run_).starts_with("run/b/episodes.jsonl:2: expected JSON, ")) << Error(run_);
}

}  // namespace evalbus::results::run_reader_test
