// Tests evalbus judge, and evalbus watch with an operator, with real processes and a page that gives
// verdicts.
#include <signal.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "tests/integration/harness.h"
#include "tests/unit/viz/web/web_client.h"
#include "viz/viewer/block.h"

namespace evalbus::judge_test {

namespace fs = std::filesystem;

uint16_t PortOf(Program& program) {
  constexpr std::string_view kAddress = "page http://127.0.0.1:";
  const auto find = [&] { return program.out().find(kAddress); };
  WaitFor([&] { return find() != std::string::npos || !program.running(); });
  EXPECT_NE(find(), std::string::npos) << program.err();
  if (find() == std::string::npos) return 0;
  return static_cast<uint16_t>(std::stoi(program.out().substr(find() + kAddress.size())));
}

// An operator's browser page.
class Page {
 public:
  explicit Page(uint16_t port) : client_(port, "http://localhost:" + std::to_string(port)) {}
  // Reads until the state of the judgment fulfills the condition; returns it, or null if the connection ends.
  nlohmann::ordered_json Until(const std::function<bool(const nlohmann::ordered_json&)>& condition) {
    while (true) {
      const std::string bytes = client_.Read();
      if (bytes.empty()) return nullptr;
      nlohmann::ordered_json head = viz::BlockReader(bytes).head();
      if (head["block"] == "judge" && condition(head)) return head;
    }
  }
  void Give(int episode, const std::string& outcome) {
    client_.Publish(nlohmann::json{
        {"verdict", {{"episode", episode}, {"outcome", outcome}, {"stages", nullptr}, {"rubric", nullptr}}}}
                        .dump());
  }
  bool is_closed() {
    client_.Read();
    return static_cast<bool>(client_.error());
  }

 private:
  viz::WebClient client_;
};

int Judged(const nlohmann::ordered_json& head) {
  return static_cast<int>(
      std::ranges::count_if(head["verdicts"], [](const auto& verdict) { return !verdict.is_null(); }));
}

std::vector<nlohmann::ordered_json> Verdicts(const fs::path& run) {
  std::vector<nlohmann::ordered_json> verdicts;
  std::istringstream lines(ReadText(run / "verdicts.jsonl"));
  for (std::string line; std::getline(lines, line);) verdicts.push_back(nlohmann::ordered_json::parse(line));
  return verdicts;
}

class Judge : public testing::Test {
 protected:
  void SetUp() override {
    for (const auto& [policy, run] : {std::pair("expert", a_), {"hold", b_}}) {
      Evaluate({ShortTask(folder_.path(), 0.4), "--policy", policy, "--episodes", "3", "--seed", "5",
                "--in-process"},
               run);
    }
  }
  std::unique_ptr<Program> Begin(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> command = {"evalbus", "judge", a_, b_, "--operator", "ann", "--port", "0"};
    command.insert(command.end(), more.begin(), more.end());
    return std::make_unique<Program>(command);
  }
  TemporaryFolder folder_;
  const fs::path a_ = folder_.path() / "run_a", b_ = folder_.path() / "run_b";
};

TEST_F(Judge, AnInterruptedSessionContinuesAndRevealsAtTheEnd) {
  ASSERT_EQ(RunProgram({"evalbus", "verify", a_, "--write"}).code, 0);
  {
    const auto program = Begin();
    Page page(PortOf(*program));
    EXPECT_EQ(page.Until([](const auto&) { return true; })["verdicts"].size(), 6u);
    page.Give(0, "success");
    page.Give(1, "failure");
    page.Until([](const auto& head) { return Judged(head) == 2; });
    program->Signal(SIGINT);
    EXPECT_EQ(program->Wait(), 0) << program->err();
    EXPECT_NE(program->out().find("verdicts on 2 of 6 episodes"), std::string::npos) << program->out();
    EXPECT_EQ(program->out().find("hold"), std::string::npos) << program->out();
  }
  // The first two episodes have the same seed and form a pair.
  ASSERT_EQ(Verdicts(a_).size(), 1u);
  ASSERT_EQ(Verdicts(b_).size(), 1u);
  EXPECT_EQ(Verdicts(a_)[0]["episode"], Verdicts(b_)[0]["episode"]);
  EXPECT_NE(Verdicts(a_)[0]["verdict"], Verdicts(b_)[0]["verdict"]);
  const Result other_order = RunProgram({"evalbus", "judge", a_, b_, "--operator", "ann", "--seed", "1"});
  EXPECT_EQ(other_order.code, 1);
  EXPECT_NE(other_order.err.find("--seed 1: ann has begun to judge in the order of --seed 0"),
            std::string::npos)
      << other_order.err;

  const fs::path json = folder_.path() / "judged.json";
  const auto program = Begin({"--json", json});
  Page page(PortOf(*program));
  EXPECT_EQ(Judged(page.Until([](const auto&) { return true; })), 2);
  for (int episode = 2; episode < 6; ++episode) page.Give(episode, "failure");
  const auto last = page.Until([](const auto& head) { return !head["results"].is_null(); });
  EXPECT_NE(last["results"].dump().find("policy hold"), std::string::npos) << last;
  // Once the results are revealed, no verdict is accepted.
  page.Give(0, "failure");
  EXPECT_NE(page.Until([](const auto& head) { return head["error"] != ""; })["error"].dump().find("revealed"),
            std::string::npos);
  program->Signal(SIGINT);
  EXPECT_EQ(program->Wait(), 0) << program->err();
  EXPECT_EQ(SchemaError("judgment", json), "");
  EXPECT_EQ(SchemaError("verdict", a_ / "verdicts.jsonl"), "");
  const auto result = nlohmann::json::parse(ReadText(json));
  const bool a_was_first = Verdicts(a_)[0]["place"] == 0;
  const auto& success = result["comparisons"][0]["comparison"]["comparisons"][0]["success"];
  EXPECT_EQ(success["pairs"]["baseline_only"], a_was_first ? 1 : 0);
  EXPECT_EQ(success["pairs"]["run_only"], a_was_first ? 0 : 1);
  EXPECT_EQ(success["pairs"]["neither"], 2);
  // Without an operator, the command prints the same results. A report also shows them.
  const Result printed = RunProgram({"evalbus", "judge", a_, b_});
  EXPECT_EQ(printed.code, 0) << printed.err;
  EXPECT_NE(program->out().find(printed.out), std::string::npos) << printed.out;
  // Options without an effect are refused.
  const Result unseeded = RunProgram({"evalbus", "judge", a_, b_, "--seed", "1"});
  EXPECT_EQ(unseeded.code, 1);
  EXPECT_NE(unseeded.err.find("--seed requires --operator"), std::string::npos) << unseeded.err;
  const Result single = RunProgram({"evalbus", "judge", a_, "--operator", "bob", "--seed", "1"});
  EXPECT_EQ(single.code, 1);
  EXPECT_NE(single.err.find("--seed requires two runs"), std::string::npos) << single.err;
  ASSERT_EQ(RunProgram({"evalbus", "report", a_, "--out", folder_.path() / "a.html", "--mb", "0"}).code, 0);
  EXPECT_NE(ReadText(folder_.path() / "a.html").find("Operator ann: success in "), std::string::npos);
  // Verdicts are not among the files that `verify` checks.
  const Result verified = RunProgram({"evalbus", "verify", a_});
  EXPECT_EQ(verified.code, 0) << verified.out;
  EXPECT_EQ(verified.out.find("verdicts.jsonl"), std::string::npos) << verified.out;
}

TEST_F(Judge, AnotherProcessOfTheOperatorAcceptsNoVerdictAfterTheResults) {
  const auto program = Begin(), second = Begin();
  Page page(PortOf(*program)), late(PortOf(*second));
  for (int episode = 0; episode < 6; ++episode) page.Give(episode, "failure");
  page.Until([](const auto& head) { return !head["results"].is_null(); });
  late.Give(0, "success");
  const auto refused = late.Until([](const auto& head) { return head["error"] != ""; });
  EXPECT_NE(refused["error"].dump().find("revealed"), std::string::npos) << refused;
  for (const fs::path& run : {a_, b_}) {
    for (const auto& verdict : Verdicts(run)) EXPECT_EQ(verdict["verdict"], "failure");
  }
}

TEST_F(Judge, VerdictsOfAnotherJudgmentDoNotCount) {
  const auto verdict = [](int episode, int place, const std::string& order_seed,
                          const std::string& other = "") {
    return R"({"episode":)" + std::to_string(episode) +
           R"(,"operator":"ann","verdict":"success","stages_reached":null,"rubric":null,)"
           R"("time_utc":"2026-11-29T03:00:00Z","place":)" +
           std::to_string(place) + R"(,"order_seed":)" + order_seed +
           (other.empty() ? "" : R"(,"other_run":")" + other + '"') + "}\n";
  };
  const auto refusal = [&](const std::string& lines, bool is_pair) {
    WriteText(a_ / "verdicts.jsonl", lines);
    std::vector<std::string> command = {"evalbus", "judge", a_, "--operator", "ann", "--port", "0"};
    if (is_pair) command.insert(command.begin() + 3, b_);
    const Result result = RunProgram(command);
    EXPECT_EQ(result.code, 1) << result.out;
    return result.err;
  };
  EXPECT_NE(refusal(verdict(1, 1, "null"), true).find("from a judgment of this run alone"),
            std::string::npos);
  EXPECT_NE(refusal(verdict(1, 17, "0"), true).find("from a judgment with another run"), std::string::npos);
  // A judgment with a third run of equal seeds has the same order, so one of these places is the right one.
  for (int place = 0; place < 6; ++place) {
    EXPECT_NE(
        refusal(verdict(1, place, "0", std::string(64, 'a')), true).find("from a judgment with another run"),
        std::string::npos);
  }
  EXPECT_NE(refusal(verdict(1, 1, "0"), false).find("from a judgment of two runs"), std::string::npos);
  // The second line is for an episode that the run does not have.
  WriteText(a_ / "verdicts.jsonl", verdict(1, 1, "null") + verdict(7, 2, "null"));
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"evalbus", "judge", a_}, {"evalbus", "report", a_}}) {
    const Result result = RunProgram(command);
    EXPECT_EQ(result.code, 1) << result.out;
    EXPECT_NE(result.err.find("verdicts.jsonl:2: the run has no episode 7"), std::string::npos) << result.err;
  }
}

TEST_F(Judge, NothingButAVerdictOnAnEpisodeIsAccepted) {
  const auto program = Begin();
  const uint16_t port = PortOf(*program);
  Page other(port);
  other.Give(17, "success");
  EXPECT_NE(other.Until([](const auto& head) { return head["error"] != ""; })["error"].dump().find(
                "no such episode"),
            std::string::npos);
  viz::WebClient note(port, "http://localhost:" + std::to_string(port));
  note.Publish(R"({"note": {"run": 0, "episode": 0, "text": "odd"}})");
  while (!note.error()) note.Read();
  EXPECT_FALSE(fs::exists(a_ / "notes.json") || fs::exists(b_ / "notes.json"));
  EXPECT_FALSE(fs::exists(a_ / "verdicts.jsonl") || fs::exists(b_ / "verdicts.jsonl"));
}

// check_judge.py documents what is checked.
TEST_F(Judge, BrowserGivesVerdictsBlind) {
  const Result result = RunProgram({"/usr/bin/python3", EVALBUS_SOURCE_DIR "/tests/browser/check_judge.py",
                                    EVALBUS_BINARY_DIR "/bin/evalbus", a_, b_});
  if (result.code == 77) GTEST_SKIP() << result.out;
  EXPECT_EQ(result.code, 0) << result.out << result.err;
}

TEST(JudgedEpisode, HasPosesAndNoResults) {
  const TemporaryFolder folder;
  const fs::path run = folder.path() / "run";
  Evaluate({"lift_pot/position", "--policy", "expert", "--episodes", "1", "--in-process"}, run);
  Program program({"evalbus", "judge", run, "--operator", "ann", "--port", "0"});
  const viz::BlockReader block(viz::BodyOf(viz::Get(PortOf(program), "/episode/0/0")));
  const nlohmann::ordered_json& head = block.head();
  for (const char* key : {"failure_reason", "end_detail", "explanation", "cause_text", "success", "complete"})
    EXPECT_EQ(head[key], nullptr) << key;
  for (const char* key : {"policy", "end_reason"}) EXPECT_EQ(head[key], "") << key;
  for (const char* key : {"criteria", "parameters"}) EXPECT_EQ(head[key].size(), 0u) << key;
  EXPECT_EQ(head["seed"], 0);
  ASSERT_EQ(head["stages"].size(), 4u);
  for (const auto& stage : head["stages"]) EXPECT_EQ(stage["tick"], nullptr) << stage;
  ASSERT_EQ(head["events"].size(), 1u) << head["events"];
  EXPECT_EQ(head["events"][0]["text"], "");
  // The block has the poses of all ticks of the recorded episode, but values of its first tick only.
  const size_t ticks = ReadLog(LogFile(run, 0)).Messages(channels::kState).size();
  EXPECT_EQ(block.Shape("position_m").back(), ticks);
  EXPECT_EQ(block.Shape("contact_depth_m").back(), 0u);
  const std::vector<double> curves = block.Values("curves");
  for (const auto& curve : head["curves"]) {
    // The gripper opening is part of STATE, which is published at every tick.
    if (curve["name"] == "gripper_opening") continue;
    for (size_t row = curve["first_row"]; row < curve["first_row"].get<size_t>() + curve["parts"].size();
         ++row) {
      for (size_t tick = 1; tick < ticks; ++tick)
        ASSERT_TRUE(std::isnan(curves[row * ticks + tick])) << curve["name"] << " at tick " << tick;
    }
  }
}

TEST(JudgedWatch, ShowsResultsWhenTheOperatorHasJudged) {
  EVALBUS_NEEDS_BUS();
  const TemporaryFolder folder;
  const fs::path original = folder.path() / "original", out = folder.path() / "watched";
  const std::string task = ShortTask(folder.path(), 0.4);
  Evaluate({task, "--policy", "hold", "--episodes", "1", "--in-process"}, original);
  const std::string url = UniqueUrl();
  Program watch({"evalbus", "watch", task, "--out", out, "--url", url, "--operator", "ann"});
  const uint16_t port = PortOf(watch);
  ASSERT_NE(port, 0);
  Program::Setting setting;
  setting.before = [url] {
    setenv("PYTHONPATH", EVALBUS_SOURCE_DIR "/python", 1);
    setenv("EVALBUS_URL", url.c_str(), 1);
  };
  Program source({"/usr/bin/python3", EVALBUS_SOURCE_DIR "/python/examples/watch_source.py",
                  LogFile(original, 0).string(), "--objects"},
                 setting);
  Page page(port);
  ASSERT_EQ(page.Until([](const auto& head) { return !head["verdicts"].empty(); })["verdicts"].size(), 1u)
      << watch.out() << watch.err() << source.err();
  EXPECT_TRUE(WaitFor([&] {
    return watch.out().find("when ann has judged all episodes") != std::string::npos;
  })) << watch.out()
      << watch.err();
  EXPECT_EQ(viz::StatusOf(viz::Get(port, "/episode/0/0")), 200);
  EXPECT_EQ(watch.out().find("timeout"), std::string::npos) << watch.out();
  page.Give(0, "success");
  EXPECT_TRUE(WaitFor([&] { return watch.out().find("the page remains") != std::string::npos; }))
      << watch.out();
  EXPECT_NE(watch.out().find("1 time limit"), std::string::npos) << watch.out();
  EXPECT_NE(watch.out().find("Operator ann: success in 1 of 1 episode"), std::string::npos) << watch.out();
  watch.Signal(SIGINT);
  EXPECT_EQ(watch.Wait(), 0) << watch.err();
}

}  // namespace evalbus::judge_test
