#include "viz/report/report_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <set>

#include "base/text.h"
#include "lcmtypes/metric_catalogue.h"
#include "viz/report/page.h"
#include "viz/report/scale.h"

namespace evalbus::viz {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
// What is seen at once; the rest opens on demand.
constexpr size_t kHistogramsShown = 8;
constexpr size_t kCurvesShown = 6;

std::string Plural(int count, const std::string& noun) {
  return fmt::format("{} {}{}", count, noun, count == 1 ? "" : "s");
}

double ValueOf(const ReportEpisode& episode, const std::string& metric) {
  for (const auto& [name, value] : episode.values) {
    if (name == metric) return value;
  }
  return kNaN;
}

// The first of these metrics that the episode has; one- and two-armed robots have different names.
double FirstOf(const ReportEpisode& episode, std::initializer_list<const char*> metrics) {
  for (const char* metric : metrics) {
    if (const double value = ValueOf(episode, metric); std::isfinite(value)) return value;
  }
  return kNaN;
}

const ReportMetric* Find(const ReportRun& run, const std::string& name) {
  for (const ReportMetric& metric : run.metrics) {
    if (metric.name == name) return &metric;
  }
  return nullptr;
}

double Statistic(const ReportMetric* metric, const std::string& name) {
  if (!metric) return kNaN;
  for (const ReportStatistic& statistic : metric->statistics) {
    if (statistic.name == name && !statistic.value.empty()) return statistic.value[0];
  }
  return kNaN;
}

double SuccessRate(const ReportRun& run) {
  return run.complete > 0 ? static_cast<double>(run.successes) / run.complete : kNaN;
}

ReportInterval FirstInterval(const ReportRun& run) {
  return run.intervals.empty() ? ReportInterval{"", 0, 1} : run.intervals[0];
}

// "19 of 20 episodes succeeded: 95 % (95 % interval 76 to 99 %, Wilson)."
std::string RateSentence(const ReportRun& run) {
  if (run.complete == 0) return "No episode is complete, so there is no success rate.";
  std::string text =
      fmt::format("{} of {} {}succeeded: {}", run.successes,
                  Plural(run.complete, run.complete < run.episodes ? "complete episode" : "episode"), "",
                  Percent(SuccessRate(run)));
  if (!run.intervals.empty()) {
    const ReportInterval& interval = run.intervals[0];
    text += fmt::format(" (95 % interval {:.0f} to {:.0f} %, {})", interval.lower * 100, interval.upper * 100,
                        interval.method);
  }
  return text + ".";
}

std::string FailureSentence(const ReportRun& run) {
  const ReportCounts& reasons = run.failure_reasons;
  if (reasons.empty()) return "";
  std::string text = "Why the others did not: ";
  for (size_t i = 0; i < reasons.size(); ++i) {
    text += fmt::format("{}{} ({})", i == 0 ? "" : ", ", reasons[i].first, reasons[i].second);
  }
  return text + ".";
}

std::string IncompleteSentence(const ReportRun& run) {
  std::string numbers;
  int count = 0;
  for (const ReportEpisode& episode : run.episode) {
    if (episode.complete) continue;
    numbers += fmt::format("{}{}", count++ == 0 ? "" : ", ", episode.episode);
  }
  if (count == 0) return "";
  return fmt::format("{} not complete, and left out of every rate and statistic: {}.",
                     count == 1 ? "1 episode is" : fmt::format("{} episodes are", count), numbers);
}

const char* Outcome(const ReportEpisode& episode) {
  return !episode.complete ? "incomplete" : episode.success ? "good" : "bad";
}

const char* OutcomeSign(const ReportEpisode& episode) {
  return !episode.complete ? "–" : episode.success ? "✓" : "✗";
}

class RunSections {
 public:
  // `id` makes anchors unique on a page with several runs.
  RunSections(const ReportRun& run, std::string id, const char* heading, const char* subheading, Markup* html)
      : run_(run), id_(std::move(id)), heading_(heading), subheading_(subheading), html_(*html) {}

  void Write() {
    Stages();
    Distributions();
    Episodes();
    Curves();
    Made();
  }

  void Summary() {
    html_.Element("p", {{"class", "verdict"}}, RateSentence(run_));
    if (const std::string text = FailureSentence(run_); !text.empty()) html_.Element("p", {}, text);
    if (const std::string text = IncompleteSentence(run_); !text.empty()) {
      html_.Element("p", {{"class", "warning"}}, text);
    }
    for (const std::string& remark : run_.remarks) html_.Element("p", {{"class", "warning"}}, remark);
    Tiles();
    Strip();
  }

 private:
  void Tile(const std::string& label, const std::function<void()>& value, const std::string& note) {
    html_.Element("div", {{"class", "tile"}}, [&] {
      html_.Element("div", {{"class", "label"}}, label);
      html_.Element("div", {{"class", "value"}}, [&] { value(); });
      if (!note.empty()) html_.Element("div", {{"class", "note"}}, note);
    });
  }

  void Tiles() {
    html_.Element("div", {{"class", "tiles"}}, [&] {
      const double rate = SuccessRate(run_);
      const ReportInterval interval = FirstInterval(run_);
      html_.Element("div", {{"class", "tile wide"}}, [&] {
        html_.Element("div", {{"class", "label"}}, "success rate");
        html_.Element("div", {{"class", "value"}, {"id", id_ + "success-rate"}},
                      [&] { Data(rate, Percent(rate), &html_); });
        if (std::isfinite(rate)) DrawShare(rate, interval.lower, interval.upper, true, &html_);
        for (const ReportInterval& other : run_.intervals) {
          html_.Element("div", {{"class", "note"}}, [&] {
            html_.Text("95 % interval ");
            Data(other.lower, fmt::format("{:.1f}", other.lower * 100), &html_);
            html_.Text(" to ");
            Data(other.upper, fmt::format("{:.1f} %", other.upper * 100), &html_);
            html_.Text(", " + other.method);
          });
        }
      });
      for (const char* name : {"completion_time", "subtask_progress", "slip_count", "env_collision_count",
                               "self_collision_count", "extended.min_clearance_m"}) {
        const ReportMetric* metric = Find(run_, name);
        if (!metric) continue;
        const MetricNumber number = FindMetric(name);
        const std::string unit(number.shown_unit());
        const auto shown = [&](const char* statistic) {
          return Statistic(metric, statistic) * number.scale();
        };
        Tile(
            "mean " + number.label(),
            [&] {
              Data(Statistic(metric, "mean"), Number(shown("mean")), &html_);
              if (!unit.empty()) html_.Element("span", {{"class", "unit"}}, " " + unit);
            },
            "median " + Number(shown("median"), 3) + ", max " + Number(shown("max"), 3));
      }
    });
  }

  // One square per episode, in order.
  void Strip() {
    html_.Element("div", {{"class", "strip"}, {"aria-hidden", "true"}}, [&] {
      for (const ReportEpisode& episode : run_.episode) {
        const std::string& reason =
            episode.failure_reason.empty() ? episode.end_reason : episode.failure_reason;
        html_.Element("i",
                      {{"class", Outcome(episode)},
                       {"title", fmt::format("episode {}: {}{}", episode.episode, reason,
                                             episode.complete ? "" : ", not complete")}},
                      "");
      }
    });
    html_.Element("p", {{"class", "legend"}}, [&] {
      const auto key = [&](const char* css_class, const std::string& text) {
        html_.Element("span", {{"class", "key"}}, [&] {
          html_.Element("i", {{"class", css_class}}, "");
          html_.Text(text);
        });
      };
      key("good", "success");
      key("bad", "no success");
      if (run_.complete < run_.episodes) key("incomplete", "not complete");
    });
  }

  void Heading(const std::string& text, const std::string& id) {
    html_.Element(heading_, {{"id", id_ + id}}, text);
  }

  void Stages() {
    if (run_.stages.empty() && run_.failure_reasons.empty() && run_.collisions.empty()) return;
    html_.Element("section", {{"class", "columns"}}, [&] {
      if (!run_.stages.empty()) html_.Element("div", {}, [&] { StageTable(); });
      if (!run_.failure_reasons.empty()) {
        html_.Element("div", {}, [&] {
          Heading("Failure reasons", "failures");
          html_.Element("p", {{"class", "note"}}, "Of the complete episodes without success.");
          Counts(run_.failure_reasons);
        });
      }
      if (!run_.collisions.empty()) {
        html_.Element("div", {}, [&] {
          Heading("Collisions", "collisions");
          html_.Element("p", {{"class", "note"}}, "New ones by what was touched, in all complete episodes.");
          Counts(run_.collisions);
        });
      }
    });
  }

  void Counts(const ReportCounts& counts) {
    double sum = 0;
    for (const auto& [name, count] : counts) sum += static_cast<double>(count);
    html_.Element("table", {{"class", "bars"}}, [&] {
      html_.Element("tbody", {}, [&] {
        for (const auto& entry : counts) {
          const auto count = static_cast<double>(entry.second);
          html_.Element("tr", {}, [&] {
            html_.Element("th", {{"scope", "row"}}, entry.first);
            html_.Element("td", {{"class", "bar"}}, [&] { DrawBar(count / sum, "bad", &html_); });
            NumberCell(count, &html_);
          });
        }
      });
    });
  }

  void StageTable() {
    Heading("Stages", "stages");
    html_.Element(
        "p", {{"class", "note"}},
        "Complete episodes that reached each stage, in any order, and the median time at which they did.");
    html_.Element("table", {{"class", "bars"}}, [&] {
      html_.Element("tbody", {}, [&] {
        for (const ReportStage& stage : run_.stages) {
          const double share = run_.complete > 0 ? static_cast<double>(stage.reached) / run_.complete : kNaN;
          html_.Element("tr", {}, [&] {
            html_.Element(
                "th", {{"scope", "row"}},
                stage.name.empty() ? "stage " + stage.index : stage.index + " " + Words(stage.name));
            html_.Element("td", {{"class", "bar"}}, [&] {
              if (std::isfinite(share)) DrawBar(share, "good", &html_);
            });
            NumberCell(share, Percent(share), &html_);
            NumberCell(stage.median_time, fmt::format("{:.2f} s", stage.median_time), &html_);
          });
        }
      });
    });
  }

  // No stages, no parts by arm where there is a number for both.
  bool HasFigure(const MetricNumber& number) const {
    if (!number.metric) return true;
    const std::string name(number.metric->name);
    const auto stands_alone = [&](const char* prefix) { return !Find(run_, prefix + name); };
    switch (number.metric->kind) {
      case MetricKind::kSuccess:
      case MetricKind::kByStage:
      case MetricKind::kByObject:
        return false;
      default:
        break;
    }
    switch (number.part) {
      case MetricPart::kAverage:
        return stands_alone("total_");
      case MetricPart::kItself:
        return number.of.empty() || stands_alone("total_");
      case MetricPart::kMean:
        return number.of.empty() || stands_alone("overall_avg_");
      case MetricPart::kRms:
        return number.of.empty() || stands_alone("overall_rms_");
      default:
        return true;
    }
  }

  void Distributions() {
    std::vector<std::function<void()>> figures;
    std::vector<std::pair<std::string, double>> constant;
    for (const ReportMetric& metric : run_.metrics) {
      const MetricNumber number = FindMetric(metric.name);
      if (!HasFigure(number)) continue;
      const double scale = number.scale();
      HistogramFigure figure{.name = number.label(),
                             .unit = std::string(number.shown_unit()),
                             .succeeded = {},
                             .failed = {},
                             .p5 = Statistic(&metric, "p5") * scale,
                             .median = Statistic(&metric, "median") * scale,
                             .p95 = Statistic(&metric, "p95") * scale};
      double low = std::numeric_limits<double>::infinity(), high = -low;
      for (const ReportEpisode& episode : run_.episode) {
        const double value = ValueOf(episode, metric.name);
        if (!episode.complete || !std::isfinite(value)) continue;
        (episode.success ? figure.succeeded : figure.failed).push_back(value * scale);
        low = std::min(low, value);
        high = std::max(high, value);
      }
      if (figure.succeeded.empty() && figure.failed.empty()) continue;
      if (!IsRange(low, high)) {
        constant.emplace_back(metric.name, low);
        continue;
      }
      figures.push_back(
          [this, figure = std::move(figure), &metric, scale] { HistogramCard(figure, metric, scale); });
    }
    html_.Element("section", {}, [&] {
      Heading("Distributions", "distributions");
      if (!figures.empty()) {
        html_.Element(
            "p", {{"class", "note"}},
            "Number of complete episodes by value; above the bars the 5th to 95th percentile and the "
            "median (dot).");
        Folded(figures, kHistogramsShown, "more distributions", "cards");
      }
      if (!constant.empty()) {
        html_.Element("p", {{"class", "note"}}, [&] {
          html_.Text("The same in every episode: ");
          for (size_t i = 0; i < constant.size(); ++i) {
            const MetricNumber number = FindMetric(constant[i].first);
            const std::string unit(number.shown_unit());
            html_.Text((i == 0 ? "" : ", ") + number.label() + " ");
            html_.Text(Number(constant[i].second * number.scale()) + (unit.empty() ? "" : " " + unit));
          }
          html_.Text(".");
        });
      }
      if (!run_.metrics.empty()) StatisticsTable();
    });
  }

  // The first of them at once, the others on demand.
  void Folded(const std::vector<std::function<void()>>& figures, size_t shown, const std::string& what,
              const char* css_class) {
    // One or two are not worth a click.
    if (figures.size() <= shown + 2) shown = figures.size();
    html_.Element("div", {{"class", css_class}}, [&] {
      for (size_t i = 0; i < shown; ++i) figures[i]();
    });
    if (figures.size() == shown) return;
    html_.Element("details", {}, [&] {
      html_.Element("summary", {}, fmt::format("{} {}", figures.size() - shown, what));
      html_.Element("div", {{"class", css_class}}, [&] {
        for (size_t i = shown; i < figures.size(); ++i) figures[i]();
      });
    });
  }

  void HistogramCard(const HistogramFigure& figure, const ReportMetric& metric, double scale) {
    html_.Element("figure", {{"class", "card"}}, [&] {
      html_.Element("figcaption", {{"title", metric.name}}, [&] {
        html_.Text(figure.name);
        if (!figure.unit.empty()) html_.Element("span", {{"class", "unit"}}, ", " + figure.unit);
      });
      DrawHistogram(figure, &html_);
      html_.Element("div", {{"class", "note"}},
                    fmt::format("median {}, mean {}, max {}", Number(figure.median, 3),
                                Number(Statistic(&metric, "mean") * scale, 3),
                                Number(Statistic(&metric, "max") * scale, 3)));
    });
  }

  void StatisticsTable() {
    // The columns that any metric has, in order.
    std::vector<std::string> columns;
    for (const ReportMetric& metric : run_.metrics) {
      for (const ReportStatistic& statistic : metric.statistics) {
        if (std::find(columns.begin(), columns.end(), statistic.name) == columns.end()) {
          columns.push_back(statistic.name);
        }
      }
    }
    html_.Element("details", {}, [&] {
      html_.Element("summary", {}, fmt::format("All {} metrics in numbers", run_.metrics.size()));
      html_.Element("div", {{"class", "scroll"}, {"tabindex", "0"}}, [&] {
        html_.Element("table", {{"class", "sortable"}, {"id", id_ + "statistics"}}, [&] {
          html_.Element("thead", {}, [&] {
            html_.Element("tr", {}, [&] {
              html_.Element("th", {}, "metric");
              html_.Element("th", {}, "unit");
              for (const std::string& column : columns) {
                html_.Element("th", {{"class", "number"}}, Words(column));
              }
            });
          });
          html_.Element("tbody", {}, [&] {
            for (const ReportMetric& metric : run_.metrics) StatisticsRow(metric, columns);
          });
        });
      });
    });
  }

  // The numbers of summary.json by their names there, and in their units.
  void StatisticsRow(const ReportMetric& metric, const std::vector<std::string>& columns) {
    const MetricInfo* info = FindMetric(metric.name).metric;
    const bool has_unit = info && info->unit != "count" && info->unit != "1";
    html_.Element("tr", {{"data-metric", metric.name}}, [&] {
      html_.Element("th", {{"scope", "row"}}, [&] { html_.Element("code", {}, metric.name); });
      html_.Element("td", {}, has_unit ? std::string(info->unit) : "");
      for (const std::string& column : columns) {
        html_.Element("td", {{"class", "number"}, {"data-statistic", column}}, [&] {
          const auto found = std::find_if(metric.statistics.begin(), metric.statistics.end(),
                                          [&](const ReportStatistic& s) { return s.name == column; });
          if (found == metric.statistics.end()) return html_.Text("-");
          for (size_t i = 0; i < found->value.size(); ++i) {
            if (i > 0) html_.Text(" to ");
            Data(found->value[i], &html_);
          }
        });
      }
    });
  }

  // Successes explain themselves; over time, below, they say more.
  static bool NeedsReason(const ReportEpisode& episode) {
    return !(episode.success && episode.complete) &&
           !(episode.failure_reason.empty() && episode.explanation.empty());
  }

  void Episodes() {
    std::set<int> drawn;
    for (const ReportCurves& curves : run_.curves) drawn.insert(curves.episode);
    const bool explained = std::ranges::any_of(run_.episode, NeedsReason);
    html_.Element("section", {}, [&] {
      Heading("Episodes", "episodes");
      html_.Element("div", {{"class", "scroll"}, {"tabindex", "0"}}, [&] {
        html_.Element("table", {{"class", "sortable episodes"}, {"id", id_ + "episode-table"}}, [&] {
          html_.Element("thead", {}, [&] {
            html_.Element("tr", {}, [&] {
              html_.Element("th", {{"class", "number"}}, "episode");
              html_.Element("th", {}, "end");
              if (explained) html_.Element("th", {}, "why");
              for (const char* title :
                   {"time, s", "stages", "slips", "collisions", "clearance, mm", "path, m"}) {
                html_.Element("th", {{"class", "number"}}, title);
              }
              html_.Element("th", {{"class", "unsorted"}}, "files");
              html_.Element("th", {{"class", "number"}}, "seed");
            });
          });
          html_.Element("tbody", {}, [&] {
            for (const ReportEpisode& episode : run_.episode) {
              EpisodeRow(episode, explained, drawn.contains(episode.episode));
            }
          });
        });
      });
    });
  }

  void EpisodeRow(const ReportEpisode& episode, bool explained, bool drawn) {
    const std::string number = std::to_string(episode.episode);
    html_.Element("tr", {{"id", id_ + "episode-" + number}}, [&] {
      html_.Element("th", {{"class", "number"}, {"scope", "row"}}, [&] {
        if (drawn) {
          html_.Element("a", {{"href", "#" + id_ + "curves-" + number}, {"title", "its curves"}}, number);
        } else {
          html_.Text(number);
        }
      });
      html_.Element("td", {{"class", "end"}}, [&] {
        html_.Element("span", {{"class", std::string("sign ") + Outcome(episode)}}, OutcomeSign(episode));
        html_.Text(" " + episode.end_reason + (episode.complete ? "" : ", not complete"));
      });
      if (explained) {
        html_.Element("td", {{"class", "why"}}, [&] {
          if (!NeedsReason(episode)) return;
          // The sentence may begin with the reason.
          const std::string& reason = episode.failure_reason;
          const bool begins = episode.explanation.starts_with(reason);
          if (!reason.empty()) html_.Element("b", {}, reason);
          if (episode.explanation.empty()) return;
          html_.Text(begins ? episode.explanation.substr(reason.size()) : ": " + episode.explanation);
        });
      }
      const double time = ValueOf(episode, "completion_time");
      NumberCell(time, fmt::format("{:.2f}", time), &html_);
      StageCell(episode);
      NumberCell(ValueOf(episode, "slip_count"), &html_);
      const double scene = ValueOf(episode, "env_collision_count");
      const double self = ValueOf(episode, "self_collision_count");
      NumberCell(scene + self, fmt::format("{} + {}", Number(scene), Number(self)), &html_);
      const double clearance = ValueOf(episode, "extended.min_clearance_m");
      NumberCell(clearance, fmt::format("{:.0f}", clearance * 1e3), &html_);
      const double path = FirstOf(episode, {"total_cartesian_path_length", "cartesian_path_length"});
      NumberCell(path, fmt::format("{:.2f}", path), &html_);
      html_.Element("td", {{"class", "files"}}, [&] {
        for (const auto* links : {&episode.films, &episode.logs}) {
          for (const ReportLink& link : *links) {
            html_.Element("a", {{"href", link.url}}, link.text);
            html_.Text(" ");
          }
        }
      });
      html_.Element("td", {{"class", "number seed"}}, std::to_string(episode.seed));
    });
  }

  void StageCell(const ReportEpisode& episode) {
    int stages = 0, reached = 0;
    for (const auto& [name, value] : episode.values) {
      if (!name.starts_with("task_stage_reached.")) continue;
      ++stages;
      reached += value != 0;
    }
    NumberCell(stages > 0 ? reached : kNaN, fmt::format("{}/{}", reached, stages), &html_);
  }

  void Curves() {
    if (run_.curves.empty()) return;
    html_.Element("section", {}, [&] {
      Heading("Episodes over time", "curves");
      html_.Element("p", {{"class", "note"}},
                    "Scores so far, tick by tick, computed from the logs. What does not change is left out.");
      for (const ReportCurves& curves : run_.curves) EpisodeCurves(curves);
    });
  }

  void EpisodeCurves(const ReportCurves& curves) {
    const auto episode = std::find_if(run_.episode.begin(), run_.episode.end(),
                                      [&](const ReportEpisode& e) { return e.episode == curves.episode; });
    html_.Element("article", {{"id", fmt::format("{}curves-{}", id_, curves.episode)}}, [&] {
      html_.Element(subheading_, {},
                    fmt::format("Episode {}: {}{}", curves.episode,
                                episode == run_.episode.end() ? "" : episode->end_reason,
                                curves.why.empty() ? "" : " (" + curves.why + ")"));
      if (episode != run_.episode.end() && !episode->explanation.empty()) {
        html_.Element("p", {}, episode->explanation);
      }
      const bool film = episode != run_.episode.end() && !episode->films.empty();
      html_.Element("div", {{"class", film ? "beside" : ""}}, [&] {
        if (film) {
          html_.Element("video", {{"controls", ""}, {"preload", "metadata"}, {"src", episode->films[0].url}},
                        "");
        }
        Events(curves.events, film);
      });
      std::vector<std::function<void()>> figures;
      for (const CurveFigure& figure : curves.figures) figures.push_back([&] { CurveCard(figure); });
      Folded(figures, kCurvesShown, "more curves", "curves");
    });
  }

  void Events(const std::vector<EpisodeEvent>& events, bool film) {
    html_.Element("ol", {{"class", "events"}}, [&] {
      for (const EpisodeEvent& event : events) {
        html_.Element("li", {}, [&] {
          DrawEventMark(event.kind, &html_);
          const std::string time = fmt::format("{:.2f} s", event.time);
          if (film) {
            html_.Element("button",
                          {{"type", "button"},
                           {"data-seek", fmt::format("{}", event.time)},
                           {"title", "show in the film"}},
                          time);
          } else {
            html_.Element("span", {{"class", "time"}}, time);
          }
          html_.Text(" " + event.text);
        });
      }
    });
  }

  void CurveCard(const CurveFigure& figure) {
    html_.Element("figure", {{"class", "card"}}, [&] {
      html_.Element("figcaption", {}, [&] {
        html_.Text(figure.name);
        if (!figure.unit.empty()) html_.Element("span", {{"class", "unit"}}, ", " + figure.unit);
        if (figure.lines.size() == 1 && figure.lines[0].name.empty()) return;
        html_.Element("span", {{"class", "lines"}}, [&] {
          for (size_t k = 0; k < figure.lines.size(); ++k) {
            html_.Element("span", {{"class", "key"}}, [&] {
              html_.Element(
                  "svg", {{"class", "swatch"}, {"viewBox", "0 0 18 8"}, {"aria-hidden", "true"}}, [&] {
                    html_.Empty("path", {{"class", fmt::format("line c{}", k % 6)}, {"d", "M0 4H18"}});
                  });
              html_.Text(figure.lines[k].name);
            });
          }
        });
      });
      DrawCurves(figure, &html_);
    });
  }

  void Made() {
    html_.Element("section", {}, [&] {
      Heading("How it was made", "made");
      html_.Element("table", {{"class", "made"}}, [&] {
        html_.Element("tbody", {}, [&] {
          for (const auto& made : run_.made) {
            html_.Element("tr", {}, [&] {
              html_.Element("th", {{"scope", "row"}}, made.first);
              html_.Element("td", {}, made.second);
            });
          }
        });
      });
    });
  }

  const ReportRun& run_;
  const std::string id_;
  const char* const heading_;
  const char* const subheading_;
  Markup& html_;
};

void Subtitle(const ReportRun& run, Markup* html) {
  html->Element("p", {{"class", "subtitle"}}, [&] {
    html->Text("policy ");
    html->Element("b", {}, run.policy);
    html->Text(", " + Plural(run.episodes, "episode") + ", run " + run.name);
  });
}

std::string Id(size_t run) { return fmt::format("run-{}-", run); }

void SuiteTable(const Report& report, Markup* html) {
  html->Element("div", {{"class", "scroll"}, {"tabindex", "0"}}, [&] {
    html->Element("table", {{"class", "sortable"}, {"id", "suite"}}, [&] {
      html->Element("thead", {}, [&] {
        html->Element("tr", {}, [&] {
          for (const char* title : {"task", "variation", "policy"}) html->Element("th", {}, title);
          html->Element("th", {{"class", "number"}}, "episodes");
          html->Element("th", {{"class", "number"}}, "success");
          html->Element("th", {{"class", "unsorted"}}, "95 % interval");
          for (const char* title : {"time, s", "progress", "slips", "collisions"}) {
            html->Element("th", {{"class", "number"}}, title);
          }
        });
      });
      html->Element("tbody", {}, [&] {
        for (size_t i = 0; i < report.runs.size(); ++i) {
          const ReportRun& run = report.runs[i];
          const ReportInterval interval = FirstInterval(run);
          const double rate = SuccessRate(run);
          html->Element("tr", {}, [&] {
            html->Element("th", {{"scope", "row"}}, [&] {
              html->Element("a", {{"href", "#" + Id(i)}}, run.task);
            });
            html->Element("td", {}, run.variation);
            html->Element("td", {}, run.policy);
            NumberCell(run.complete,
                       run.complete == run.episodes ? Number(run.episodes)
                                                    : fmt::format("{} of {}", run.complete, run.episodes),
                       html);
            NumberCell(rate, Percent(rate), html);
            html->Element("td", {{"class", "bar"}}, [&] {
              if (std::isfinite(rate)) DrawShare(rate, interval.lower, interval.upper, false, html);
            });
            const auto mean = [&](const char* name) { return Statistic(Find(run, name), "mean"); };
            const auto cell = [&](double value) {
              NumberCell(value, value == 0 ? "0" : fmt::format("{:.2f}", value), html);
            };
            cell(mean("completion_time"));
            NumberCell(mean("subtask_progress"), Percent(mean("subtask_progress")), html);
            cell(mean("slip_count"));
            cell(mean("env_collision_count") + mean("self_collision_count"));
          });
        }
      });
    });
  });
  html->Element("p", {{"class", "note"}},
                "Time, progress, slips and collisions are means over complete episodes.");
}

}  // namespace

std::string ReportPage(const Report& report) {
  return Page(report.title, report.made_by, [&](Markup* html) {
    const bool suite = report.runs.size() > 1;
    for (const std::string& remark : report.remarks) html->Element("p", {{"class", "warning"}}, remark);
    if (suite) SuiteTable(report, html);
    for (size_t i = 0; i < report.runs.size(); ++i) {
      const ReportRun& run = report.runs[i];
      RunSections sections(run, suite ? Id(i) : "", suite ? "h3" : "h2", suite ? "h4" : "h3", html);
      if (suite) html->Element("h2", {{"id", Id(i)}}, run.task + "/" + run.variation);
      Subtitle(run, html);
      sections.Summary();
      sections.Write();
    }
  });
}

}  // namespace evalbus::viz
