// The report page is well-formed and escaped, and it shows the numbers that it was given.
#include "report/page/report_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tinyxml2.h>

#include <cmath>
#include <functional>
#include <set>

#include "base/json_file.h"

namespace evalbus::report::report_page_test {

using testing::HasSubstr;
using testing::Not;
using tinyxml2::XMLElement;

class Page {
 public:
  explicit Page(const std::string& html) {
    EXPECT_EQ(document_.Parse(html.c_str()), tinyxml2::XML_SUCCESS) << document_.ErrorStr();
  }
  // Returns all elements with this name for which `wanted` is true, in document order.
  std::vector<const XMLElement*> All(
      const std::string& name,
      const std::function<bool(const XMLElement&)>& wanted = [](const XMLElement&) { return true; }) const {
    std::vector<const XMLElement*> found;
    const std::function<void(const XMLElement*)> visit = [&](const XMLElement* element) {
      if (element->Name() == name && wanted(*element)) found.push_back(element);
      for (auto* child = element->FirstChildElement(); child; child = child->NextSiblingElement())
        visit(child);
    };
    visit(document_.RootElement());
    return found;
  }
  const XMLElement* ById(const std::string& id) const {
    for (const char* name : {"table", "tr", "div", "h2", "h3", "h4", "article"}) {
      for (const XMLElement* element : All(name)) {
        if (element->Attribute("id", id.c_str())) return element;
      }
    }
    return nullptr;
  }

 private:
  tinyxml2::XMLDocument document_;
};

std::string TextOf(const XMLElement* element) {
  std::string text;
  for (auto* node = element->FirstChild(); node; node = node->NextSibling()) {
    if (node->ToText()) text += node->Value();
    if (node->ToElement()) text += TextOf(node->ToElement());
  }
  return text;
}

metrics::MetricSummary Metric(const std::string& name, double mean) {
  metrics::MetricSummary metric;
  metric.name = name;
  metric.mean = mean;
  return metric;
}

// A run of four episodes: two successes, a failure, and an incomplete episode.
ReportRun SomeRun() {
  ReportRun report;
  results::RecordedRun& run = report.run;
  run.name = "a";
  run.task = "lift_pot";
  run.variation = "position";
  run.policy = "expert";
  run.info = {{"git_commit", "919abb6a9159"}};
  metrics::RunSummary& summary = report.summary;
  summary.episodes = 4;
  summary.complete = summary.judged = 3;
  summary.successes = 2;
  summary.success_rate = 2.0 / 3;
  summary.wilson = {0.2, 0.9};
  summary.clopper_pearson = {0.1, 0.95};
  summary.stages = {{1, 1}};
  summary.successes_without_stage = 1;
  summary.failure_reasons = {{"timeout", 1}};
  summary.metrics = {Metric("completion_time", 9.25), Metric("extended.min_clearance_m", 0.125),
                     Metric("extended.contact_time_s", 5.25), Metric("slip_count", 0),
                     Metric("extended.stage_time_s.1", 3.5)};
  metrics::MetricSummary& time = summary.metrics[0];
  time.median = 5.5;
  time.p5 = 4.5;
  time.p95 = 17.5;
  time.max = 20;
  summary.metrics[1].mean_95 = {0.11, 0.14};
  metrics::MetricSummary& touching = summary.metrics[2];
  touching.median = 5.25;
  touching.p5 = 4.3;
  touching.p95 = 6.2;
  report.stage_name = {{1, "left_gripper_touches_pot"}};
  for (int i = 0; i < 4; ++i) {
    results::RecordedEpisode episode;
    episode.episode = i;
    episode.seed = 100 + i;
    episode.end_reason = i < 2 ? "success" : "time_limit";
    episode.success = i < 2;
    episode.complete = i < 3;
    episode.failure_reason = i < 2 ? "" : "timeout";
    episode.explanation = i == 2 ? "tilt of pot 27.4 deg > 20 deg" : "";
    episode.values = {
        {"completion_time", 4.25 + i}, {"extended.contact_time_s", 4.25 + i}, {"slip_count", 0}};
    episode.stages = {{1, i == 0}};
    run.episodes.push_back(episode);
    report.files.push_back({{}, {{"log", "episodes/000" + std::to_string(i) + "/events.lcmlog"}}});
  }
  report.files[2].videos = {{"front", "episodes/0002/front.mp4"}};
  ReportCurves curves{.episode = 2, .why = "first failure", .figures = {}, .events = {}};
  curves.figures.push_back({.name = "gripper opening",
                            .unit = "",
                            .time = {0, 1, 2},
                            .lines = {{"left", {1, 0.5, 0}}, {"right", {1, 1, 0}}},
                            .events = {}});
  curves.events = {{EpisodeEvent::Kind::kSlip, 1.5, "left loses pot"},
                   {EpisodeEvent::Kind::kEnd, 2, "time_limit"}};
  curves.figures[0].events = curves.events;
  report.curves.push_back(curves);
  return report;
}

std::string PageOf(std::vector<ReportRun> runs) {
  return ReportPage({.title = "title", .runs = std::move(runs), .remarks = {}, .made_by = "0.1.0"});
}

TEST(ReportPage, NamesTheEngineThatSimulated) {
  const auto subtitle = [](const nlohmann::ordered_json& info) {
    ReportRun run = SomeRun();
    run.run.info.update(info);
    const Page page(PageOf({run}));
    return TextOf(
        page.All("p", [](const XMLElement& p) { return p.Attribute("class", "subtitle") != nullptr; }).at(0));
  };
  EXPECT_THAT(subtitle({{"mujoco_version", "3.3.3"}}), testing::EndsWith(", MuJoCo 3.3.3"));
  // Data from a file was not simulated, so no MuJoCo version is shown.
  EXPECT_THAT(subtitle({{"mujoco_version", "3.3.3"}, {"source", "file"}}), Not(HasSubstr("MuJoCo")));
}

TEST(ReportPage, StatesTheRateAndTheExclusions) {
  ReportRun run = SomeRun();
  run.remarks = run.run.Remarks();
  const Page page(PageOf({run}));
  std::string text;
  for (const XMLElement* p : page.All("p")) text += TextOf(p) + "\n";
  EXPECT_THAT(text,
              HasSubstr("2 of 3 complete episodes succeeded: 67 % (95 % interval 20 to 90 %, Wilson)."));
  EXPECT_THAT(text, HasSubstr("time limit (1)"));
  EXPECT_THAT(text, HasSubstr("Excluded from all rates because they are incomplete"));
}

TEST(ReportPage, EpisodesWithoutAVerdictAreNoFailures) {
  ReportRun run = SomeRun();
  results::RecordedEpisode& episode = run.run.episodes[2];
  episode.failure_reason = "not_judged";
  run.summary.judged = 2;
  run.summary.failure_reasons = {{"not_judged", 1}};
  const Page page(PageOf({run}));
  const XMLElement* const row = page.ById("episode-2");
  ASSERT_TRUE(row);
  EXPECT_STREQ(row->Attribute("class"), "incomplete");
  EXPECT_THAT(TextOf(row), Not(HasSubstr("✗")));
  EXPECT_FALSE(page.ById("failures"));
  std::string text;
  for (const XMLElement* p : page.All("p")) text += TextOf(p) + "\n";
  EXPECT_THAT(text, HasSubstr("Not judged: 1 episode."));
}

TEST(ReportPage, StatesThatStagesAreNotConditionsOfSuccess) {
  ReportRun run = SomeRun();
  EXPECT_THAT(PageOf({run}), HasSubstr(">" + run.summary.StagesText() + ".</p>"));
  run.summary.successes_without_stage = 0;
  EXPECT_THAT(PageOf({run}), Not(HasSubstr("not conditions of success")));
}

TEST(ReportPage, NumbersHaveAllTheirDigits) {
  const Page page(PageOf({SomeRun()}));
  const auto rate = page.All("data");
  ASSERT_FALSE(rate.empty());
  EXPECT_EQ(std::stod(rate[0]->Attribute("value")), 2.0 / 3);
  const auto row = page.All("tr", [](const XMLElement& tr) {
    return tr.Attribute("data-metric", "extended.min_clearance_m") != nullptr;
  });
  ASSERT_EQ(row.size(), 1u);
  EXPECT_THAT(TextOf(row[0]), HasSubstr("0.11 to 0.14"));
}

// The page shows millimeters, with the digits that the standard error (50 mm / sqrt(3)) permits. The
// machine-readable value is in meters and has all digits.
TEST(ReportPage, TilesAndFiguresHaveTheCatalogsWordsAndUnits) {
  ReportRun run = SomeRun();
  for (int i = 0; i < 4; ++i) {
    run.run.episodes[i].values.emplace_back("extended.min_clearance_m", 0.1 + 0.01 * i);
  }
  run.summary.metrics[1].mean = 0.12512;
  run.summary.metrics[1].std = 0.05;
  run.summary.metrics[1].episodes = 3;
  const Page page(PageOf({run}));
  const auto tiles = page.All("div", [](const XMLElement& div) {
    return TextOf(&div).starts_with("mean smallest clearance") && div.Attribute("class", "tile");
  });
  ASSERT_EQ(tiles.size(), 1u);
  EXPECT_THAT(TextOf(tiles[0]), HasSubstr("125 mm"));
  const auto* value =
      tiles[0]->FirstChildElement("div")->NextSiblingElement("div")->FirstChildElement("data");
  ASSERT_TRUE(value);
  EXPECT_EQ(value->DoubleAttribute("value"), 0.12512);
  const auto figures = page.All("svg", [](const XMLElement& svg) {
    const char* label = svg.Attribute("aria-label");
    return label && std::string(label).starts_with("histogram of smallest clearance");
  });
  ASSERT_EQ(figures.size(), 1u);
  EXPECT_THAT(TextOf(figures[0]), HasSubstr("110 to 112 mm: 1 of 3 episodes"));
}

TEST(ReportPage, ARealtimeRunListsItsTimes) {
  ReportRun run = SomeRun();
  EXPECT_EQ(Page(PageOf({run})).ById("times"), nullptr);
  const auto times = [](double p50_s) {
    return nlohmann::ordered_json{
        {"count", 50}, {"p50_s", p50_s}, {"p99_s", 0.00095}, {"p999_s", 0.0021}, {"max_s", 0.0123}};
  };
  run.pacing = {{"ticks", 50},
                {"deadline_misses", 1},
                {"late_ticks", 0},
                {"error", times(0.0001)},
                {"action_latency", times(0.00031)},
                {"partial_latency", times(0.0002)}};
  const std::string html = PageOf({run});
  EXPECT_THAT(html, HasSubstr("Of 50 ticks, 1 had no message from the policy process in time"));
  const Page page(html);
  const XMLElement* table = page.ById("times");
  ASSERT_NE(table, nullptr);
  EXPECT_THAT(TextOf(table), HasSubstr("real time, msp50p99p99.9max"));
  EXPECT_THAT(TextOf(table), HasSubstr("STATE to ACTION0.310.952.1012.30"));
}

// Runs of older versions have an explanation but no cause.
TEST(ReportPage, StatesTheCauseOfAFailure) {
  ReportRun run = SomeRun();
  run.run.episodes[2].cause = {"lost_object", 1.5, "Left gripper lost the pot at 1.50 s."};
  const Page page(PageOf({run}));
  EXPECT_THAT(TextOf(page.ById("episode-2")), HasSubstr("time limit: Left gripper lost the pot at 1.50 s."));
  EXPECT_THAT(TextOf(page.ById("curves-2")), HasSubstr("Left gripper lost the pot at 1.50 s."));
  EXPECT_THAT(TextOf(page.ById("curves-2")), Not(HasSubstr("27.4 deg")));
}

TEST(ReportPage, TheReasonOfAFailureLeadsToItsMoment) {
  ReportRun run = SomeRun();
  run.moments[2].url = "#view:run=0,episode=2,t=2.620";
  const Page page(PageOf({run}));
  const auto links = page.All("a", [](const XMLElement& a) {
    return a.Attribute("href", "#view:run=0,episode=2,t=2.620") && TextOf(&a) == "time limit";
  });
  EXPECT_EQ(links.size(), 1u);
  EXPECT_EQ(TextOf(page.ById("episode-2")), TextOf(Page(PageOf({SomeRun()})).ById("episode-2")));
}

TEST(ReportPage, StatesTheConditionsOfASuccess) {
  ReportRun run = SomeRun();
  run.run.episodes[0].cause = {"success", 4.25, "Success at 4.25 s: height of pot 1.097 m."};
  EXPECT_THAT(TextOf(Page(PageOf({run})).ById("episode-0")), HasSubstr("successheight of pot 1.097 m4.25"));
}

TEST(ReportPage, HasARowForEachEpisodeWithItsFiles) {
  const Page page(PageOf({SomeRun()}));
  const XMLElement* row = page.ById("episode-2");
  ASSERT_TRUE(row);
  EXPECT_THAT(TextOf(row), HasSubstr("time limit: tilt of pot 27.4 deg > 20 deg"));
  std::set<std::string> links;
  for (const XMLElement* a : page.All("a")) links.insert(a->Attribute("href"));
  EXPECT_TRUE(links.contains("episodes/0002/front.mp4"));
  EXPECT_TRUE(links.contains("episodes/0003/events.lcmlog"));
  EXPECT_TRUE(links.contains("#curves-2"));
}

// The failure reason "collision" may be a contact with an object, which the counter ignores.
TEST(ReportPage, StatesWhichCollisionsAreCounted) {
  const Page page(PageOf({SomeRun()}));
  const auto notes = page.All("p", [](const XMLElement& p) {
    return TextOf(&p).ends_with("contacts with the objects of the task are not counted.");
  });
  EXPECT_EQ(notes.size(), 1u);
}

// The histogram has bars for 4.25, 5.25 and 6.25, in bins of 0.2, starting at 4.2. The last one is not a
// success.
TEST(ReportPage, HistogramHasABarForEachBinWithValues) {
  const Page page(PageOf({SomeRun()}));
  const auto bars_of = [&](const std::string& metric) {
    const auto figures = page.All("svg", [&](const XMLElement& svg) {
      const char* label = svg.Attribute("aria-label");
      return label && std::string(label).starts_with("histogram of " + metric);
    });
    EXPECT_EQ(figures.size(), 1u) << metric;
    return figures.at(0);
  };
  std::vector<std::string> titles, classes;
  const auto* figure = bars_of("time touching the scene");
  for (auto* g = figure->FirstChildElement("g"); g; g = g->NextSiblingElement("g")) {
    if (g->Attribute("class")) continue;
    titles.push_back(TextOf(g->FirstChildElement("title")));
    classes.push_back(g->FirstChildElement("rect")->Attribute("class"));
    EXPECT_EQ(g->FirstChildElement("rect")->DoubleAttribute("height"), 72);
  }
  EXPECT_EQ(titles,
            (std::vector<std::string>{"4.2 to 4.4 s: 1 of 3 episodes", "5.2 to 5.4 s: 1 of 3 episodes",
                                      "6.2 to 6.4 s: 1 of 3 episodes, 1 without success"}));
  EXPECT_EQ(classes, (std::vector<std::string>{"good", "good", "bad"}));
  // The time at which a failed episode ended is not a completion time.
  int bars = 0;
  for (auto* g = bars_of("completion time")->FirstChildElement("g"); g; g = g->NextSiblingElement("g"))
    bars += !g->Attribute("class");
  EXPECT_EQ(bars, 2);
}

// The figure is 260 pixels wide, and a character is about 6.4 pixels wide.
TEST(ReportPage, LabelsOfAScaleStayInTheFigure) {
  ReportRun run = SomeRun();
  for (size_t i = 0; i < 3; ++i) {
    run.run.episodes[i].values[0].second = 0.1008 + 0.0004 * static_cast<double>(i);
  }
  const Page page(PageOf({run}));
  const auto figures = page.All("svg", [](const XMLElement& svg) {
    const char* label = svg.Attribute("aria-label");
    return label && std::string(label).starts_with("histogram of completion time");
  });
  ASSERT_EQ(figures.size(), 1u);
  int labels = 0;
  for (auto* text = figures[0]->FirstChildElement("text"); text; text = text->NextSiblingElement("text")) {
    if (!text->Attribute("text-anchor", "middle")) continue;
    ++labels;
    EXPECT_LE(text->DoubleAttribute("x") + 3.2 * static_cast<double>(TextOf(text).size()), 260)
        << TextOf(text);
  }
  EXPECT_GT(labels, 1);
}

TEST(ReportPage, ValuesThatDifferByRoundingAreTheSameInEveryEpisode) {
  ReportRun run = SomeRun();
  run.run.episodes[1].values[0].second = std::nextafter(4.25, 5);
  run.run.episodes[2].values[0].second = 4.25;
  const Page page(PageOf({run}));
  const auto notes = page.All("p", [](const XMLElement& p) {
    return TextOf(&p).starts_with(
        "Equal in all complete episodes that have the value: completion time 4.25 s");
  });
  EXPECT_EQ(notes.size(), 1u);
}

TEST(ReportPage, NothingFromARunBecomesMarkup) {
  const std::string evil = "</script><img src=x onerror=\"alert(1)\">&'";
  ReportRun run = SomeRun();
  run.run.name = run.run.policy = run.run.task = run.run.variation = evil;
  run.stage_name[1] = evil;
  run.summary.metrics[0].name = evil;
  run.remarks = {evil};
  run.run.info = {{evil, evil}, {"object", {{evil, evil}}}};
  run.model_hashes = {{evil, evil}};
  results::RecordedEpisode& failure = run.run.episodes[2];
  failure.failure_reason = failure.explanation = failure.end_reason = evil;
  run.files[2].videos = {{evil, Url(evil)}};
  for (size_t i = 0; i < 2; ++i) run.run.episodes[i].values[0].first = evil;
  run.curves[0].why = run.curves[0].events[0].text = run.curves[0].figures[0].name = evil;
  run.curves[0].figures[0].lines[0].name = run.curves[0].figures[0].unit = evil;
  const std::string html =
      ReportPage({.title = evil, .runs = {run, run}, .remarks = {evil}, .made_by = evil});
  EXPECT_THAT(html, Not(HasSubstr("<img")));
  EXPECT_THAT(html, HasSubstr("&lt;img"));
  const Page page(html);
  EXPECT_EQ(page.All("script").size(), 1u);
}

TEST(ReportPage, CharactersThatXmlHasNoPlaceForAreReplaced) {
  const std::string odd = std::string("a\x1b[31mb\xff\xc2\x9b", 9) + std::string(1, '\0') + "z";
  ReportRun run = SomeRun();
  run.run.name = run.run.policy = run.run.episodes[2].explanation = odd;
  run.model_hashes = {{odd, odd}};
  run.files[2].videos = {{odd, Url(odd)}};
  const std::string html = ReportPage({.title = odd, .runs = {run}, .remarks = {odd}, .made_by = odd});
  EXPECT_THAT(html, HasSubstr("a?[31mb???z"));
  for (const char c : html) EXPECT_TRUE(static_cast<unsigned char>(c) >= 0x20 || c == '\n') << int{c};
  const Page page(html);
}

TEST(ReportPage, SquaresLeadToTheirEpisodes) {
  const Page page(PageOf({SomeRun(), SomeRun()}));
  const auto squares = page.All("a", [](const XMLElement& a) {
    return a.Attribute("title") && std::string(a.Attribute("title")).starts_with("episode ");
  });
  ASSERT_EQ(squares.size(), 8u);
  EXPECT_STREQ(squares[6]->Attribute("href"), "#run-1-episode-2");
  EXPECT_STREQ(squares[6]->Attribute("class"), "bad");
  for (const XMLElement* square : squares) EXPECT_TRUE(page.ById(square->Attribute("href") + 1));
}

TEST(ReportPage, FailuresCanBeShownAlone) {
  const auto boxes = [](const Page& page) {
    return page.All("input",
                    [](const XMLElement& input) { return input.Attribute("class", "only-failures"); });
  };
  const Page page(PageOf({SomeRun()}));
  ASSERT_EQ(boxes(page).size(), 1u);
  // The style sheet hides the rows of class good that follow the checkbox.
  EXPECT_STREQ(page.ById("episode-0")->Attribute("class"), "good");
  EXPECT_STREQ(page.ById("episode-2")->Attribute("class"), "bad");
  const auto labels = page.All("label");
  ASSERT_EQ(labels.size(), 1u);
  EXPECT_STREQ(labels[0]->Attribute("for"), boxes(page)[0]->Attribute("id"));
  EXPECT_EQ(TextOf(labels[0]), "only the 2 without success");
  ReportRun good = SomeRun();
  for (results::RecordedEpisode& episode : good.run.episodes) episode.success = episode.complete = true;
  EXPECT_TRUE(boxes(Page(PageOf({good}))).empty());
}

TEST(ReportPage, FailuresHaveImageAndCause) {
  ReportRun run = SomeRun();
  run.run.episodes[2].cause = {"lost_object", 3.62, "Right gripper lost the pot."};
  run.moments[2] = {.image = "data:image/jpeg;base64,AA==", .url = "#view:run=0,episode=2,t=2.620"};
  const Page page(PageOf({run}));
  const auto cards = page.All("figure", [](const XMLElement& figure) {
    return figure.Attribute("class", "card failure") != nullptr;
  });
  // Episode 3 is incomplete, so it has no card.
  ASSERT_EQ(cards.size(), 1u);
  EXPECT_THAT(TextOf(cards[0]), HasSubstr("✗ time limitRight gripper lost the pot."));
  EXPECT_STREQ(cards[0]->FirstChildElement("img")->Attribute("alt"), "episode 2 at 3.62 s");
  EXPECT_STREQ(cards[0]->FirstChildElement("figcaption")->FirstChildElement("a")->Attribute("href"),
               "#view:run=0,episode=2,t=2.620");
}

TEST(ReportPage, ShowsTheCommandAndFoldsEmptySettings) {
  ReportRun run = SomeRun();
  run.command = "evalbus run lift_pot/position --seed 1";
  run.run.info.update({{"assets", nlohmann::ordered_json::array()}, {"plugins", nullptr}, {"engine", ""}});
  run.model_hashes = {{"git_commit", "again"}, {"physics_sha256", "hash"}};
  const Page page(PageOf({run}));
  const auto tables =
      page.All("table", [](const XMLElement& table) { return table.Attribute("class", "made") != nullptr; });
  ASSERT_EQ(tables.size(), 2u);
  EXPECT_THAT(TextOf(tables[0]),
              testing::StartsWith("commandevalbus run lift_pot/position --seed 1policyexpert"));
  EXPECT_EQ(TextOf(tables[1]), "git_commit919abb6a9159physics_sha256hash");
}

TEST(ReportPage, ConfigurationStatesHowManyEpisodesOnlySelects) {
  ReportRun run = SomeRun();
  run.run.planned = 6;
  run.run.seed = 7;
  EXPECT_THAT(PageOf({run}), HasSubstr("<td>6 episodes, seed 7</td>"));
  run.run.info["only"] = {3, 4};
  EXPECT_THAT(PageOf({run}), HasSubstr("<td>2 of 6 episodes, seed 7</td>"));
}

TEST(ReportPage, HtmlElementsWithoutContentAreClosed) {
  // A browser parses <td/> as an open element.
  const std::string html = PageOf({SomeRun()});
  for (const char* name : {"td", "th", "div", "i", "span", "script", "video", "data", "a", "text", "p"})
    EXPECT_THAT(html, Not(testing::ContainsRegex("<" + std::string(name) + "( [^>]*)?/>"))) << name;
}

TEST(ReportPage, SeveralRunsHaveATableAndAnchorsOfTheirOwn) {
  ReportRun other = SomeRun();
  other.run.variation = "orientation";
  const Page page(PageOf({SomeRun(), other}));
  const XMLElement* table = page.ById("suite");
  ASSERT_TRUE(table);
  EXPECT_THAT(TextOf(table), HasSubstr("orientation"));
  EXPECT_TRUE(page.ById("run-0-episode-2"));
  EXPECT_TRUE(page.ById("run-1-episode-2"));
  std::set<std::string> ids;
  for (const char* name : {"table", "tr", "div", "h2", "h3", "h4", "article"}) {
    for (const XMLElement* element : page.All(name)) {
      if (!element->Attribute("id")) continue;
      EXPECT_TRUE(ids.insert(element->Attribute("id")).second) << element->Attribute("id");
    }
  }
}

TEST(ReportPage, RunWithoutACompleteEpisodeHasNoRate) {
  ReportRun run = SomeRun();
  for (results::RecordedEpisode& episode : run.run.episodes) episode.complete = false;
  run.summary.complete = run.summary.judged = run.summary.successes = 0;
  run.summary.success_rate = std::nan("");
  run.summary.metrics.clear();
  run.remarks = {"invalid and excluded from all rates"};
  const std::string html = PageOf({run});
  const Page page(html);
  EXPECT_THAT(html, HasSubstr("no success rate"));
  EXPECT_THAT(html, HasSubstr(">Invalid and excluded from all rates<"));
  EXPECT_THAT(html, Not(HasSubstr("Distributions")));
  EXPECT_THAT(html, Not(HasSubstr("nan")));
}

TEST(Url, KeepsNothingThatMeansSomething) {
  EXPECT_EQ(Url("../a b/#1?.mp4"), "../a%20b/%231%3F.mp4");
  EXPECT_EQ(Url("javascript:x"), "javascript%3Ax");
  EXPECT_EQ(Url("épisode"), "%C3%A9pisode");
}

}  // namespace evalbus::report::report_page_test
