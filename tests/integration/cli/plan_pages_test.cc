// The console, the report and the comparison pages of a plan show the same p value for the same comparison.
#include <gmock/gmock.h>

#include <csignal>

#include "tests/integration/harness.h"

namespace evalbus::plan_pages_test {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

class PlanPages : public testing::Test {
 protected:
  // The expert needs 6 s; failures end soon after it.
  Result Run(const std::string& episodes) {
    WriteText(folder_.path() / "plan.yaml",
              "policies: [expert, \"flawed_expert:miss\", noisy_expert]\ntasks: [" +
                  ShortTask(folder_.path(), 8) + "/position]\n" + episodes);
    return RunProgram({"evalbus", "run", folder_.path() / "plan.yaml", "--out", results_, "--workers", "2"});
  }
  std::string Page(const std::string& name) { return ReadText(results_ / name); }

  TemporaryFolder folder_;
  const fs::path results_ = folder_.path() / "results";
};

TEST_F(PlanPages, OfOneThatStopsHaveThePOfAnyLook) {
  const Result run = Run("episodes: 10\nuntil: decided(alpha 0.05, max 20)\n");
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_EQ(SchemaError("stops", results_ / "stops.json"), "");
  EXPECT_EQ(SchemaError("plan", results_ / "plan.json"), "");
  EXPECT_FALSE(fs::exists(results_ / "parts"));
  const auto stops = nlohmann::json::parse(ReadText(results_ / "stops.json"));
  ASSERT_EQ(stops.size(), 2u);
  for (const auto& stop : stops) {
    const std::string policy = stop["policy"];
    SCOPED_TRACE(policy);
    // Computed by hand for 10 pairs that only one policy won: evidence C(20, 10) / 2^10, 40 % of alpha for
    // the looks at interim results, two policies.
    if (policy == "flawed_expert-miss") {
      EXPECT_EQ(stop["only_baseline"], 10);
      EXPECT_EQ(stop["episodes"], 10);
      EXPECT_NEAR(stop["p"], 2 * 1024.0 / 184756 / 0.4, 1e-12);
    }
    const double adjusted = stop["p"];
    char exact[32];
    std::snprintf(exact, sizeof exact, "p = %.3f", adjusted);
    const bool is_tiny = adjusted < 0.001;
    const std::string p = is_tiny ? "p &lt; 0.001" : exact;
    const std::string page = Page(policy + "/against_expert.html");
    EXPECT_THAT(page, HasSubstr("McNemar valid at any look"));
    EXPECT_THAT(page, HasSubstr(p));
    EXPECT_THAT(page, Not(HasSubstr("exact McNemar")));
    EXPECT_THAT(page, HasSubstr("on average larger than the true one"));
    EXPECT_THAT(Page("report.html"), HasSubstr(p));
    EXPECT_THAT(run.out, HasSubstr(is_tiny ? "p < 0.001" : exact));
    EXPECT_THAT(stop["text"].get<std::string>(), HasSubstr(is_tiny ? "p < 0.001" : exact));
    const bool is_decided = stop["is_decided"];
    EXPECT_EQ(page.find(" worse than ") != std::string::npos, is_decided);
  }
  EXPECT_THAT(Page("report.html"), Not(HasSubstr("exact McNemar")));
  // The report does not rank policies whose number of episodes depends on the results, because the tests
  // behind the letters assume a fixed number.
  EXPECT_THAT(Page("report.html"), Not(HasSubstr("Policies that share a letter")));

  // A manual comparison notes that its p values are not valid for a plan that stops depending on its results.
  const fs::path run_folder = OnlyRun(results_ / "expert");
  const Result compared =
      RunProgram({"evalbus", "compare", run_folder, OnlyRun(results_ / "flawed_expert-miss")});
  EXPECT_THAT(compared.out,
              HasSubstr("its plan stopped depending on its results (until: decided(alpha 0.05, max 20))"));
  Evaluate({"--like", run_folder, "--episodes", "1"}, folder_.path() / "again");
  EXPECT_EQ(nlohmann::json::parse(ReadText(folder_.path() / "again/run.json"))["until"], "");
}

// Each look uses the episodes that existed at that time, although the folder has more of them now.
TEST_F(PlanPages, OneThatStopsIsResumedAndVerified) {
  ASSERT_EQ(Run("episodes: 5\nuntil: decided(alpha 0.05, max 15)\n").code, 0);
  const fs::path file = results_ / "stops.json";
  const std::string stops = ReadText(file), summary = ReadText(results_ / "expert/summary.json");
  // Simulates a plan that was interrupted after its last episode.
  fs::remove(file);
  const Result resumed =
      RunProgram({"evalbus", "run", folder_.path() / "plan.yaml", "--out", results_, "--resume"});
  ASSERT_EQ(resumed.code, 0) << resumed.err;
  EXPECT_EQ(ReadText(file), stops);
  EXPECT_EQ(ReadText(results_ / "expert/summary.json"), summary);

  const Result sized = RunProgram({"evalbus", "report", results_, "--mb", "0"});
  EXPECT_EQ(sized.code, 1);
  EXPECT_THAT(sized.err, HasSubstr("--mb require a run or suite"));

  Result verified = RunProgram({"evalbus", "verify", results_});
  EXPECT_EQ(verified.code, 0) << verified.out;
  const int lost = nlohmann::json::parse(stops)[0]["only_baseline"];
  const std::string key = "\"only_baseline\": ";
  std::string edited = stops;
  edited.replace(edited.find(key), key.size() + std::to_string(lost).size(), key + "99");
  WriteText(file, edited);
  verified = RunProgram({"evalbus", "verify", results_});
  EXPECT_EQ(verified.code, 1);
  EXPECT_THAT(verified.out, HasSubstr(file.string() + ": 0.only_baseline is 99, recomputed " +
                                      std::to_string(lost) + "\n"));

  auto partial = nlohmann::json::parse(stops);
  const std::string policy = partial[0]["policy"];
  partial.erase(0);
  WriteText(file, partial.dump());
  const Result report = RunProgram({"evalbus", "report", results_});
  EXPECT_EQ(report.code, 1);
  EXPECT_EQ(report.err, "error: " + file.string() + ": no decision on policy " + policy + "\n");
}

// A plan whose videos cannot be made keeps its results, as a run does.
TEST_F(PlanPages, AreWrittenAlsoIfThereIsNoFfmpeg) {
  WriteText(folder_.path() / "plan.yaml", "policies: [hold, random]\ntasks: [" +
                                              ShortTask(folder_.path(), 0.1) +
                                              "/position]\nepisodes: 1\nvideo: all\n");
  const auto without_ffmpeg = [] {
    setenv("EVALBUS_PATH", "/nowhere", 1);
    unsetenv("EVALBUS_FFMPEG");
  };
  const Result run = RunProgram({"evalbus", "run", folder_.path() / "plan.yaml", "--out", results_},
                                {.working_folder = {}, .before = without_ffmpeg});
  EXPECT_EQ(run.code, 2);
  EXPECT_THAT(run.out, HasSubstr("No difference shown between random and hold"));
  EXPECT_THAT(run.err, HasSubstr("videos are missing: hold  "));
  EXPECT_THAT(run.err, HasSubstr("; to record them, run the same command with --out "));
  EXPECT_TRUE(fs::exists(results_ / "report.html"));

  // Wilson's interval of 0 of 1 ends at z^2 / (1 + z^2) = 0.793.
  const fs::path table = folder_.path() / "table.md";
  const auto written = fs::last_write_time(results_ / "report.html");
  const Result report = RunProgram({"evalbus", "report", results_, "--markdown", table});
  EXPECT_EQ(report.code, 0) << report.err;
  EXPECT_EQ(report.out, table.string() + "\n");
  EXPECT_EQ(fs::last_write_time(results_ / "report.html"), written);
  EXPECT_THAT(ReadText(table), HasSubstr("| task | hold | random |\n"));
  EXPECT_THAT(ReadText(table), HasSubstr("/position | 0/1 (0 to 79 %) | 0/1 (0 to 79 %) |\n"));
  const Result same = RunProgram({"evalbus", "report", results_, "--markdown", results_ / "report.html"});
  EXPECT_EQ(same.code, 1);
  EXPECT_THAT(same.err, HasSubstr("the plan's page and --markdown name the same file"));
}

TEST_F(PlanPages, StateOnceThatNoStartWasSeenInTraining) {
  const std::string task = ShortTask(folder_.path(), 0.1);
  WriteText(folder_.path() / "plan.yaml",
            "policies: [hold]\ntasks: [" + task + "/position, " + task + "/base]\nepisodes: 1\n");
  ASSERT_EQ(RunProgram({"evalbus", "run", folder_.path() / "plan.yaml", "--out", results_}).code, 0);
  for (const auto& entry : fs::directory_iterator(results_ / "hold")) {
    const fs::path lines = entry.path() / "episodes.jsonl";
    if (!fs::exists(lines)) continue;
    WriteText(lines, "{\"seen_in_training\":false," + ReadText(lines).substr(1));
  }
  ASSERT_EQ(RunProgram({"evalbus", "report", results_}).code, 0);
  EXPECT_THAT(Page("report.html"), HasSubstr("hold: 0 of 2 starts were seen in training"));
  EXPECT_THAT(Page("report.html"), testing::Not(HasSubstr("0 of 1 start was seen in training")));
}

// The plan is interrupted when the first of three reports has begun. On a loaded machine, all reports may
// have been written when the signal arrives. Such an attempt is repeated.
TEST_F(PlanPages, AreWrittenByResumeAfterAnInterruption) {
  WriteText(folder_.path() / "plan.yaml", "policies: [hold, random, expert]\ntasks: [" +
                                              ShortTask(folder_.path(), 0.1) + "/position]\nepisodes: 1\n");
  const fs::path results = folder_.path() / "my results";
  const std::vector<std::string> command = {"evalbus", "run",   folder_.path() / "plan.yaml",
                                            "--out",   results, "--resume"};
  int code = 0;
  for (int attempt = 0; attempt < 20 && code == 0; ++attempt) {
    fs::remove_all(results);
    Program plan(command);
    ASSERT_TRUE(WaitFor([&] { return fs::exists(results / "hold/logs/report.log"); })) << plan.err();
    plan.Signal(SIGINT);
    code = plan.Wait();
    if (code == 0) continue;
    EXPECT_THAT(plan.err(), HasSubstr("stopped before all pages were written"));
    EXPECT_THAT(plan.err(), testing::ContainsRegex("with --out '[^']*my results' --resume\n$"));
  }
  EXPECT_EQ(code, 2);
  EXPECT_FALSE(fs::exists(results / "report.html"));
  EXPECT_EQ(RunProgram(command).code, 0);
  for (const char* page : {"report.html", "hold/report.html", "random/report.html", "expert/report.html"})
    EXPECT_TRUE(fs::exists(results / page)) << page;
}

TEST_F(PlanPages, OfSeveralPoliciesHaveThePOfAllAndARanking) {
  const Result run = Run("episodes: 8\n");
  ASSERT_EQ(run.code, 0) << run.err;
  const std::string headline = "flawed_expert-miss is 100 points worse than expert, 95 % CI ";
  const std::string evidence =
      "0 of 8 against 8 of 8 on the same seeds, exact McNemar, adjusted with Holm's method, p = 0.016.";
  EXPECT_THAT(run.out, HasSubstr(headline + "-100 to -54.\n" + evidence));
  EXPECT_THAT(Page("report.html"), HasSubstr(headline + "−100 to −54. " + evidence));
  const std::string page = Page("flawed_expert-miss/against_expert.html");
  EXPECT_THAT(page, HasSubstr("<h1>" + headline + "−100 to −54</h1>"));
  EXPECT_THAT(page, HasSubstr(evidence));
  EXPECT_THAT(run.out, HasSubstr("Ranking by success\nexpert"));
  EXPECT_THAT(run.out, HasSubstr("\npolicy              task "));
  EXPECT_THAT(run.out, HasSubstr("\nfailures, one of each policy\nflawed_expert-miss  "));
  EXPECT_THAT(run.out, testing::ContainsRegex("evalbus web .*flawed_expert-miss/.* --episode 0\n"));
  EXPECT_THAT(run.out, testing::ContainsRegex("\nlook     evalbus web .*\nshare    evalbus report .*\n$"));
  EXPECT_THAT(Page("report.html"), HasSubstr("Policies that share a letter"));
  EXPECT_THAT(Page("flawed_expert-miss/report.html"),
              HasSubstr("<h1>flawed_expert-miss succeeds in 0 of 8 episodes of lift_pot/position</h1>"));

  // `verify` regenerates all pages: the plan's page, two comparisons and three reports of policies.
  const auto verify = [&] { return RunProgram({"evalbus", "verify", results_}); };
  EXPECT_THAT(verify().out, HasSubstr("; 6 pages made again"));
  for (const std::string name : {"report.html", "flawed_expert-miss/against_expert.html"}) {
    const std::string text = Page(name);
    std::string edited = text;
    WriteText(results_ / name, edited.replace(edited.find("0 of 8 against"), 1, "1"));
    const Result found = verify();
    EXPECT_EQ(found.code, 1);
    EXPECT_THAT(found.out, HasSubstr((results_ / name).string() + ": '"));
    EXPECT_THAT(found.out, HasSubstr("1 of 8 against"));
    EXPECT_THAT(found.out, HasSubstr("1 finding: "));
    WriteText(results_ / name, text);
  }
}

}  // namespace evalbus::plan_pages_test
