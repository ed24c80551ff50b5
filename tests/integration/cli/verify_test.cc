// `evalbus verify` finds changed results in a folder. It names the file and, if a number was changed, the
// number.
#include <random>

#include "base/json_file.h"
#include "base/sha256.h"
#include "tests/integration/harness.h"

namespace evalbus::verify_test {

namespace fs = std::filesystem;

#define EXPECT_SAYS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

class Verify : public testing::Test {
 protected:
  void SetUp() override {
    Evaluate({ShortTask(folder_.path(), 0.4), "--policy", "random", "--episodes", "3", "--in-process"}, run_);
  }
  static Result Of(const fs::path& folder, const std::vector<std::string>& options = {}) {
    std::vector<std::string> command = {"evalbus", "verify", folder};
    command.insert(command.end(), options.begin(), options.end());
    return RunProgram(std::move(command));
  }
  static void Seal(const fs::path& folder) {
    const Result result = Of(folder, {"--write"});
    ASSERT_EQ(result.code, 0) << result.out << result.err;
  }
  static nlohmann::ordered_json ManifestOf(const fs::path& folder) {
    return nlohmann::ordered_json::parse(ReadText(folder / "manifest.json"));
  }
  void Replace(const fs::path& file, const std::string& what, const std::string& with) {
    std::string text = ReadText(file);
    const size_t at = text.find(what);
    ASSERT_NE(at, std::string::npos) << file;
    WriteText(file, text.replace(at, what.size(), with));
  }

  // Changes a file and the hashes of the manifest, so that only the content of the file is wrong.
  void ReplaceAndSeal(const fs::path& folder, const std::string& file, const std::string& what,
                      const std::string& with) {
    Replace(folder / file, what, with);
    nlohmann::ordered_json manifest = ManifestOf(folder);
    manifest["machine"]["files"].at(file) = Sha256File(folder / file);
    manifest.erase("sha256");
    manifest["sha256"] = Sha256Text(ToText(manifest));
    WriteText(folder / "manifest.json", ToText(manifest, 2) + "\n");
    const Result hashes = Of(folder, {"--hashes"});
    EXPECT_EQ(hashes.code, 0) << hashes.out;
  }

  TemporaryFolder folder_;
  const fs::path run_ = folder_.path() / "run";
};

TEST_F(Verify, AnUnchangedRunHasNoFinding) {
  const Result before = Of(run_);
  EXPECT_EQ(before.code, 0) << before.out << before.err;
  EXPECT_SAYS(before.out, "manifest.json: missing, so changed bytes cannot be found; --write writes it");
  Seal(run_);
  EXPECT_EQ(SchemaError("manifest", run_ / "manifest.json"), "");
  const Result after = Of(run_);
  EXPECT_EQ(after.code, 0) << after.out;
  EXPECT_SAYS(after.out, "no finding: ");
  EXPECT_SAYS(after.out, "3 episodes of 1 run scored again");
}

TEST_F(Verify, AFlippedByteOfAnyFileIsNamed) {
  Seal(run_);
  std::mt19937 random(1);
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(run_)) {
    if (entry.is_regular_file() && entry.file_size() > 0) files.push_back(entry.path());
  }
  ASSERT_GT(files.size(), 12U);
  for (const fs::path& file : files) {
    const std::string text = ReadText(file);
    for (int i = 0; i < 3; ++i) {
      std::string changed = text;
      const size_t at = random() % text.size();
      changed[at] = static_cast<char>(changed[at] ^ (1 << random() % 8));
      WriteText(file, changed);
      const Result result = Of(run_, {"--hashes"});
      EXPECT_EQ(result.code, 1) << file << " at " << at << ": " << result.out << result.err;
      EXPECT_SAYS(result.out, file.string() + ":");
    }
    WriteText(file, text);
  }
  EXPECT_EQ(Of(run_).code, 0);
}

// Without a manifest, the logs show which number was changed.
TEST_F(Verify, AnEditedNumberIsNamed) {
  Replace(run_ / "episodes.jsonl", "\"slip_count\":0", "\"slip_count\":7");
  Result result = Of(run_);
  EXPECT_EQ(result.code, 1);
  EXPECT_SAYS(result.out,
              LogFile(run_, 0).string() + ": episodes.jsonl differs: metrics.slip_count 7 -> 0\n");
  EXPECT_SAYS(result.out, (run_ / "episodes/0000/summary.json").string() +
                              ": metrics.slip_count is 0, in episodes.jsonl 7\n");
  EXPECT_SAYS(result.out,
              (run_ / "summary.json").string() + ": metrics.slip_count.max is 0.0, recomputed 7.0\n");
  Replace(run_ / "episodes.jsonl", "\"slip_count\":7", "\"slip_count\":0");
  Replace(run_ / "summary.json", "\"successes\": 0", "\"successes\": 3");
  result = Of(run_);
  EXPECT_EQ(result.code, 1);
  EXPECT_SAYS(result.out, (run_ / "summary.json").string() + ": successes is 3, recomputed 0\n");
  EXPECT_SAYS(result.out, "1 finding: ");
}

TEST_F(Verify, AValueOfAnotherTypeIsNamed) {
  Replace(run_ / "run.json", "\"git_commit\": \"", "\"git_commit\": 5, \"other_commit\": \"");
  const Result result = Of(run_);
  EXPECT_EQ(result.code, 1);
  EXPECT_SAYS(result.out, run_.string() + ": a JSON file has a value of an unexpected type: ");
}

// A run whose failures are removed from its results must not be verified.
TEST_F(Verify, ARemovedLineIsNamed) {
  std::string lines = ReadText(run_ / "episodes.jsonl");
  lines.erase(lines.rfind('\n', lines.size() - 2) + 1);
  WriteText(run_ / "episodes.jsonl", lines);
  const Result result = Of(run_);
  EXPECT_EQ(result.code, 1);
  EXPECT_SAYS(result.out, (run_ / "episodes/0002").string() + ": episodes.jsonl lacks this episode\n");
  EXPECT_SAYS(result.out, "note: " + run_.string() + ": 2 of 3 episodes have finished\n");
}

TEST_F(Verify, AnEditedOptionThatTheLogsContainIsNamed) {
  for (const auto& [recorded, edited, difference] :
       {std::tuple("\"control_hz\": 50.0", "\"control_hz\": 20.0", "control_hz is 20.0, MODEL has 50.0"),
        std::tuple("\"realtime\": false", "\"realtime\": true", "realtime is true, MODEL has false"),
        std::tuple("\"after_success_s\": 0.0", "\"after_success_s\": 0.5",
                   "after_success_s is 0.5, MODEL has 0")}) {
    Replace(run_ / "run.json", recorded, edited);
    const Result result = Of(run_);
    EXPECT_EQ(result.code, 1);
    EXPECT_SAYS(result.out,
                LogFile(run_, 0).string() + ": does not belong to this run: run.json: " + difference + "\n");
    Replace(run_ / "run.json", edited, recorded);
  }
}

// These metrics are not in the log alone but also need policy_calls.json next to it.
TEST_F(Verify, AnEditedMetricOfADelayIsNamed) {
  const fs::path run = folder_.path() / "delayed";
  Evaluate({ShortTask(folder_.path(), 1), "--policy", "random", "--latency", "100", "--episodes", "1",
            "--in-process"},
           run);
  // Five of the 50 ticks pass during each of the two inferences, which begin at ticks 0 and 30.
  const auto line = nlohmann::json::parse(ReadText(run / "episodes.jsonl"));
  EXPECT_EQ(line["extended"]["stale_action_ratio"], 0.2);
  EXPECT_EQ(line["extended"]["effective_hz"], 40);
  EXPECT_EQ(SchemaError("episode", run / "episodes/0000/summary.json"), "");
  Result result = Of(run);
  EXPECT_EQ(result.code, 0) << result.out << result.err;
  Replace(run / "episodes.jsonl", "\"effective_hz\":40", "\"effective_hz\":50");
  result = Of(run);
  EXPECT_EQ(result.code, 1);
  EXPECT_SAYS(result.out,
              LogFile(run, 0).string() + ": episodes.jsonl differs: extended.effective_hz 50.0 -> 40.0\n");
}

TEST_F(Verify, AnEditedPageIsNamedAlthoughItsHashIsRight) {
  ASSERT_EQ(RunProgram({"evalbus", "report", run_}).code, 0);
  ASSERT_EQ(
      RunProgram({"evalbus", "report", run_, "--mb", "0", "--episode", "1", "-o", run_ / "small.html"}).code,
      0);
  Seal(run_);
  Result result = Of(run_);
  EXPECT_EQ(result.code, 0) << result.out;
  EXPECT_SAYS(result.out, "; 2 pages made again");
  const std::string rate = "0 of 3 episodes succeeded: 0 % (95 % interval 0 to 56 %, Wilson).";
  ReplaceAndSeal(run_, "report.html", rate, "1" + rate.substr(1));
  result = Of(run_);
  EXPECT_EQ(result.code, 1);
  EXPECT_SAYS(result.out, (run_ / "report.html").string() + ": '1" + rate.substr(1) + "' under '");
  EXPECT_SAYS(result.out, ", recomputed '" + rate + "'\n1 finding: ");
  ReplaceAndSeal(run_, "report.html", "1" + rate.substr(1), rate);
  // Changes the exact value behind a rounded number.
  ReplaceAndSeal(run_, "small.html", "<data value=\"0.4\">", "<data value=\"0.41\">");
  result = Of(run_);
  EXPECT_EQ(result.code, 1);
  EXPECT_SAYS(result.out, (run_ / "small.html").string() + ": 'value=\"0.41\"' under '");
}

// Neither a new name of the folder nor notes that a user adds later make a page wrong.
TEST_F(Verify, ARenamedRunAndItsPageHaveNoFinding) {
  ASSERT_EQ(RunProgram({"evalbus", "report", run_, "--mb", "0"}).code, 0);
  const fs::path renamed = folder_.path() / "renamed";
  fs::rename(run_, renamed);
  WriteText(renamed / "notes.json", R"({"1": "looks odd"})");
  const Result result = Of(renamed);
  EXPECT_EQ(result.code, 0) << result.out << result.err;
  EXPECT_SAYS(result.out, "; 1 page made again");
}

TEST_F(Verify, APageOfAnotherVersionIsNotCompared) {
  ASSERT_EQ(RunProgram({"evalbus", "report", run_, "--mb", "0"}).code, 0);
  Replace(run_ / "report.html", "Made by evalbus ", "Made by evalbus 0.0.1 of ");
  const Result result = Of(run_);
  EXPECT_EQ(result.code, 0) << result.out;
  EXPECT_SAYS(result.out,
              "note: " + (run_ / "report.html").string() + ": not compared: made by evalbus 0.0.1 of ");
}

TEST_F(Verify, AnEditedComparisonIsNamedAlthoughItsHashIsRight) {
  const fs::path other = folder_.path() / "other";
  Evaluate({ShortTask(folder_.path(), 0.4), "--policy", "hold", "--episodes", "3", "--in-process"}, other);
  // The inputs are named relative to the folder in which the command ran.
  const Result compared = RunProgram({"evalbus", "compare", "run", "other", "--on", "idle_time_s", "--json",
                                      "run/against.json", "--report", "run/against.html", "--mb", "0"},
                                     {.working_folder = folder_.path(), .before = {}});
  ASSERT_EQ(compared.code, 0) << compared.err;
  EXPECT_EQ(SchemaError("comparison", run_ / "against.json"), "");
  Seal(run_);
  Result result = Of(run_);
  EXPECT_EQ(result.code, 0) << result.out;
  EXPECT_SAYS(result.out, "; 1 page made again; 1 comparison made again");
  ReplaceAndSeal(run_, "against.json", "\"baseline_episodes\": 3", "\"baseline_episodes\": 4");
  result = Of(run_);
  EXPECT_EQ(result.code, 1);
  EXPECT_SAYS(result.out, (run_ / "against.json").string() +
                              ": comparisons.0.success.baseline_episodes is 4, recomputed 3\n");
  ReplaceAndSeal(run_, "against.json", "\"baseline_episodes\": 4", "\"baseline_episodes\": 3");
  ReplaceAndSeal(run_, "against.html", "0 of 3 against 0 of 3", "2 of 3 against 0 of 3");
  result = Of(run_);
  EXPECT_EQ(result.code, 1);
  EXPECT_SAYS(result.out, (run_ / "against.html").string() + ": '2 of 3 against 0 of 3");
  fs::remove_all(other);
  result = Of(run_);
  EXPECT_SAYS(result.out,
              "note: " + (run_ / "against.json").string() + ": not compared: there is no run other\n");
}

TEST_F(Verify, AChangedOptionIsNamed) {
  Seal(run_);
  Replace(run_ / "run.json", "\"policy_timeout_s\": 60.0", "\"policy_timeout_s\": 90.0");
  const Result result = Of(run_, {"--hashes"});
  EXPECT_EQ(result.code, 1);
  EXPECT_SAYS(result.out, (run_ / "run.json").string() + ": policy_timeout_s 60.0 -> 90.0\n");
}

TEST_F(Verify, HashesWithoutAManifestAreRefused) {
  const Result result = Of(run_, {"--hashes"});
  EXPECT_EQ(result.code, 1) << result.out;
  EXPECT_SAYS(result.err, run_.string() + ": no manifest.json, so there is nothing to compare; ");
}

TEST_F(Verify, AMissingFileIsNamed) {
  Seal(run_);
  fs::remove(LogFile(run_, 1));
  const Result result = Of(run_);
  EXPECT_EQ(result.code, 1);
  EXPECT_SAYS(result.out, LogFile(run_, 1).string() + ": missing; the manifest has it\n");
  EXPECT_SAYS(result.out, LogFile(run_, 1).string() + ": missing; episodes.jsonl has its score\n");
}

TEST_F(Verify, AnAddedFileIsNoFinding) {
  Seal(run_);
  WriteText(run_ / "notes.txt", "mine");
  const Result result = Of(run_);
  EXPECT_EQ(result.code, 0);
  EXPECT_SAYS(result.out, "note: " + (run_ / "notes.txt").string() + ": not in the manifest\n");
}

TEST_F(Verify, AWrongRunIsNotSealed) {
  Replace(run_ / "summary.json", "\"successes\": 0", "\"successes\": 3");
  EXPECT_EQ(Of(run_, {"--write"}).code, 1);
  EXPECT_FALSE(fs::exists(run_ / "manifest.json"));
}

TEST_F(Verify, EqualRunsHaveEqualContent) {
  const fs::path other = folder_.path() / "elsewhere" / "again";
  Evaluate({ShortTask(folder_.path(), 0.4), "--policy", "random", "--episodes", "3", "--workers", "2",
            "--in-process"},
           other);
  Seal(run_);
  Seal(other);
  const auto a = ManifestOf(run_), b = ManifestOf(other);
  EXPECT_EQ(a["content"].dump(2), b["content"].dump(2));
  EXPECT_EQ(a["content_sha256"], b["content_sha256"]);
  EXPECT_NE(a["sha256"], b["sha256"]);
}

TEST_F(Verify, ASuiteHasItsRuns) {
  const fs::path suite = folder_.path() / "suite";
  Evaluate({"lift_pot/base", "lift_pot/position", "--policy", "random", "--episodes", "1", "--in-process"},
           suite);
  Seal(suite);
  EXPECT_EQ(Of(suite).code, 0);
  const fs::path summary = suite / "lift_pot-base" / "summary.json";
  WriteText(summary, ReadText(summary) + "\n");
  Result result = Of(suite, {"--hashes"});
  EXPECT_EQ(result.code, 1);
  EXPECT_SAYS(result.out, summary.string() + ": changed: its SHA-256 is not that of the manifest\n");
  // With a new manifest, the changed run no longer matches the manifest of the suite.
  Seal(suite / "lift_pot-base");
  result = Of(suite, {"--hashes"});
  EXPECT_EQ(result.code, 1);
  EXPECT_SAYS(result.out, (suite / "lift_pot-base" / "manifest.json").string() + ": changed");
}

TEST_F(Verify, OtherFoldersAreRefused) {
  const Result result = Of(folder_.path());
  EXPECT_EQ(result.code, 1);
  EXPECT_SAYS(result.err, ": neither a run, a suite nor a plan");
  EXPECT_EQ(result.err.find('\n'), result.err.size() - 1) << result.err;
}

TEST_F(Verify, NotesThatAPlanHasNotFinished) {
  const fs::path plan = folder_.path() / "plan.yaml", out = folder_.path() / "plan";
  WriteText(plan, "policies: [random, hold]\ntasks: [" + ShortTask(folder_.path(), 0.4) + "]\nepisodes: 1\n");
  ASSERT_EQ(RunProgram({"evalbus", "run", plan, "--out", out, "--part", "1/2"}).code, 0);
  const Result part = Of(out);
  EXPECT_EQ(part.code, 0) << part.out << part.err;
  EXPECT_SAYS(part.out, "note: " + out.string() + ": the plan has not finished: 1 of 2 episodes\n");
  ASSERT_EQ(RunProgram({"evalbus", "run", plan, "--out", out, "--part", "2/2"}).code, 0);
  EXPECT_EQ(Of(out).out.find("has not finished"), std::string::npos);
}

TEST(GateCommand, EndsWithTheVerdictsExitCode) {
  const TemporaryFolder folder;
  const auto run = [&](const std::string& policy) {
    const fs::path out = folder.path() / policy;
    Evaluate({"lift_pot/position", "--policy", policy, "--episodes", "12", "--in-process"}, out);
    return out;
  };
  const fs::path expert = run("expert"), still = run("hold");
  const auto gate = [&](const fs::path& baseline, const fs::path& other, const std::string& margin) {
    return RunProgram({"evalbus", "gate", baseline, other, "--margin", margin, "--junit",
                       folder.path() / "gate.xml", "--markdown", folder.path() / "gate.md"});
  };
  // With a margin of 30 %, 12 pairs without a loss are enough, because 0.7^12 < 0.05.
  const Result pass = gate(expert, expert, "30");
  EXPECT_EQ(pass.code, 0) << pass.out << pass.err;
  EXPECT_SAYS(ReadText(folder.path() / "gate.xml"), "failures=\"0\"");
  EXPECT_SAYS(ReadText(folder.path() / "gate.md"), "### PASS: ");
  const Result fail = gate(expert, still, "30");
  EXPECT_EQ(fail.code, 10) << fail.out << fail.err;
  EXPECT_SAYS(fail.out, "FAIL  hold against expert: success 100.0 -> 0.0 % in 12 pairs: a loss of at least ");
  const Result unknown = gate(expert, expert, "5");
  EXPECT_EQ(unknown.code, 11) << unknown.out << unknown.err;
  const Result idle = gate(still, still, "30");
  EXPECT_EQ(idle.code, 11) << idle.out << idle.err;
  EXPECT_SAYS(idle.out, " shows that the policy commanded a motion; such a run cannot pass");
  EXPECT_EQ(gate(expert, folder.path() / "none", "5").code, 1);
  EXPECT_SAYS(gate(expert, still, "100").err, " to 99.000000 percentage points");
  EXPECT_SAYS(gate(expert, still, "nan").err, "--margin: Value nan is not a number (see");
}

}  // namespace evalbus::verify_test
