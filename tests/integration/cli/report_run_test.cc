// Tests evalbus report and compare --report: pages of real runs show the values of the runs' own files.
#include <tinyxml2.h>

#include <filesystem>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "tests/integration/harness.h"

namespace evalbus::report_run_test {

namespace fs = std::filesystem;
using nlohmann::ordered_json;
using tinyxml2::XMLElement;

void ForAll(const XMLElement* element, const std::function<void(const XMLElement&)>& visit) {
  visit(*element);
  for (auto* child = element->FirstChildElement(); child; child = child->NextSiblingElement())
    ForAll(child, visit);
}

// Returns the values of the <data> elements below `element`, with all their digits.
std::vector<double> ValuesIn(const XMLElement& element) {
  std::vector<double> values;
  ForAll(&element, [&](const XMLElement& e) {
    if (std::string(e.Name()) == "data") values.push_back(std::stod(e.Attribute("value")));
  });
  return values;
}

class ReportRunTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    made_ = new TemporaryFolder;
    Evaluate({"lift_pot/position", "--policy", "noisy_expert", "--episodes", "8", "--in-process", "--video",
              "none"},
             made_->path() / "run");
  }
  static void TearDownTestSuite() {
    delete made_;
    made_ = nullptr;
  }
  void SetUp() override { fs::copy(made_->path() / "run", run_, fs::copy_options::recursive); }
  void Load(const fs::path& page, tinyxml2::XMLDocument* document) {
    ASSERT_EQ(document->Parse(ReadText(page).c_str()), tinyxml2::XML_SUCCESS) << document->ErrorStr();
  }

  static TemporaryFolder* made_;
  TemporaryFolder folder_;
  // The name contains special characters of URLs and of HTML.
  const fs::path run_ = folder_.path() / "a #1 & <b>";
};
TemporaryFolder* ReportRunTest::made_ = nullptr;

TEST_F(ReportRunTest, PageHasTheNumbersOfSummaryJson) {
  const Result result = RunProgram({"evalbus", "report", run_.string()});
  ASSERT_EQ(result.code, 0) << result.err;
  tinyxml2::XMLDocument page;
  Load(run_ / "report.html", &page);

  const auto summary = ordered_json::parse(ReadText(run_ / "summary.json"));
  std::map<std::string, std::map<std::string, std::vector<double>>> table;
  double rate = -1;
  ForAll(page.RootElement(), [&](const XMLElement& element) {
    if (element.Attribute("id", "success-rate")) rate = ValuesIn(element).at(0);
    if (!element.Attribute("data-metric")) return;
    for (auto* td = element.FirstChildElement("td"); td; td = td->NextSiblingElement("td")) {
      if (const char* statistic = td->Attribute("data-statistic")) {
        table[element.Attribute("data-metric")][statistic] = ValuesIn(*td);
      }
    }
  });
  EXPECT_EQ(rate, summary["success_rate"].get<double>());
  EXPECT_EQ(table.size(), summary["metrics"].size());
  for (const auto& [metric, statistics] : summary["metrics"].items()) {
    for (const auto& [name, value] : statistics.items()) {
      std::vector<double> expected;
      for (const ordered_json& number : value.is_array() ? value : ordered_json::array({value})) {
        if (number.is_number()) expected.push_back(number.get<double>());
      }
      EXPECT_EQ(table[metric][name], expected) << metric << " " << name;
    }
  }
}

// Returns the names of the data blocks of a page.
std::vector<std::string> BlocksOf(const tinyxml2::XMLDocument& page) {
  std::vector<std::string> names;
  ForAll(page.RootElement(), [&](const XMLElement& element) {
    if (const char* name = element.Attribute("data-block")) names.emplace_back(name);
  });
  return names;
}

TEST_F(ReportRunTest, AsManyEpisodesArePackedAsTheSizeAllows) {
  const fs::path file = run_ / "report.html";
  const auto report = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"evalbus", "report", run_.string()});
    const Result result = RunProgram(more);
    EXPECT_EQ(result.code, 0) << result.err;
    tinyxml2::XMLDocument page;
    Load(file, &page);
    std::set<std::string> episodes;
    for (const std::string& name : BlocksOf(page)) {
      if (name.starts_with("episode/")) episodes.insert(name);
    }
    // The command prints how many episodes the page contains.
    if (!episodes.empty()) {
      EXPECT_NE(result.out.find(std::to_string(episodes.size())), std::string::npos) << result.out;
    }
    return episodes;
  };
  EXPECT_EQ(report({}).size(), 8u);
  const std::string whole = ReadText(file);
  EXPECT_LT(whole.size(), size_t{8'000'000});
  report({});
  EXPECT_EQ(ReadText(file), whole) << "equal runs, equal bytes";

  EXPECT_EQ(report({"--mb", "0"}).size(), 0u);
  EXPECT_EQ(ReadText(file).find("THREE"), std::string::npos);
  const size_t without = fs::file_size(file);
  EXPECT_EQ(report({"--episode", "2,5"}), (std::set<std::string>{"episode/0/2", "episode/0/5"}));
  const size_t with_two = fs::file_size(file);
  // The size limit allows more than two episodes but not all.
  const size_t most = (with_two + whole.size()) / 2;
  const std::set<std::string> some = report({"--mb", std::to_string(static_cast<double>(most) / 1e6)});
  EXPECT_LE(fs::file_size(file), most + 1);
  EXPECT_GT(some.size(), 1u);
  EXPECT_LT(some.size(), 8u);
  // If no episode fits, the page has no viewer.
  EXPECT_EQ(report({"--mb", std::to_string(static_cast<double>(without) / 1e6 + 0.1)}).size(), 0u);
  EXPECT_EQ(ReadText(file).find("THREE"), std::string::npos);
}

TEST_F(ReportRunTest, LinksLeadToFilesAlsoFromAnotherFolder) {
  const fs::path out = folder_.path() / "elsewhere";
  fs::create_directories(out);
  const Result result = RunProgram({"evalbus", "report", run_.string(), "-o", (out / "page.html").string()});
  ASSERT_EQ(result.code, 0) << result.err;
  tinyxml2::XMLDocument page;
  Load(out / "page.html", &page);
  int logs = 0;
  ForAll(page.RootElement(), [&](const XMLElement& element) {
    const char* href = element.Attribute("href");
    if (!href || !std::string(href).ends_with("events.lcmlog")) return;
    ++logs;
    std::string path;
    for (const char* c = href; *c; ++c) {
      path += *c == '%' ? static_cast<char>(std::stoi(std::string(c + 1, 2), nullptr, 16)) : *c;
      if (*c == '%') c += 2;
    }
    EXPECT_TRUE(fs::exists(out / path)) << href;
  });
  EXPECT_EQ(logs, 8);
}

TEST_F(ReportRunTest, BrowserHasNothingToComplainAbout) {
  if (RunProgram({"/bin/sh", "-c", "command -v chromium && command -v python3"}).code != 0) {
    GTEST_SKIP() << "needs chromium and python3";
  }
  const fs::path comparison = folder_.path() / "comparison.html";
  Evaluate({"lift_pot/position", "--episodes", "8", "--in-process", "--video", "none"}, folder_.path() / "b");
  ASSERT_EQ(RunProgram({"evalbus", "compare", run_.string(), (folder_.path() / "b").string(), "--report",
                        comparison.string()})
                .code,
            0);
  ASSERT_EQ(RunProgram({"evalbus", "report", run_.string()}).code, 0);
  for (const fs::path& page : {run_ / "report.html", comparison}) {
    const Result result =
        RunProgram({"/usr/bin/python3", EVALBUS_SOURCE_DIR "/tests/browser/check_page.py", page.string()});
    EXPECT_EQ(result.code, 0) << result.out << result.err;
  }
}

// check_viewer.py checks bodies, values, timeline, sizes, and that HTML in the names of bodies or tasks is
// not interpreted.
TEST_F(ReportRunTest, ViewerShowsTheContentsOfLogsAndSummaries) {
  if (RunProgram({"/bin/sh", "-c", "command -v chromium && command -v python3"}).code != 0) {
    GTEST_SKIP() << "needs chromium and python3";
  }
  ASSERT_EQ(RunProgram({"evalbus", "report", run_.string()}).code, 0);
  const Result result = RunProgram({"/usr/bin/python3", EVALBUS_SOURCE_DIR "/tests/browser/check_viewer.py",
                                    (run_ / "report.html").string(), run_.string()});
  EXPECT_EQ(result.code, 0) << result.out << result.err;
}

TEST_F(ReportRunTest, WhatIsNotThereIsNamed) {
  const Result result = RunProgram({"evalbus", "report", run_.string(), "--episode", "99"});
  EXPECT_EQ(result.code, 1);
  EXPECT_NE(result.err.find("no finished episode 99"), std::string::npos) << result.err;
  EXPECT_FALSE(fs::exists(run_ / "report.html"));
  EXPECT_EQ(RunProgram({"evalbus", "report", folder_.path().string()}).code, 1);
}

}  // namespace evalbus::report_run_test
