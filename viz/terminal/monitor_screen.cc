#include "viz/terminal/monitor_screen.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/text.h"
#include "bus/channels.h"
#include "bus/log.h"
#include "lcmtypes/end_reason.h"
#include "lcmtypes/extended_value.h"
#include "lcmtypes/source.h"
#include "viz/terminal/metric_table.h"
#include "viz/watch/score_rows.h"

namespace evalbus::viz {
namespace {

double Seconds(SteadyTime::duration duration) { return std::chrono::duration<double>(duration).count(); }

std::string Rate(double rate) {
  return rate >= 9.95 ? fmt::format("{:.0f}", rate) : fmt::format("{:.1f}", rate);
}

std::string Millimeters(double meters) { return Number(meters * 1e3) + " mm"; }

Line Heading(const std::string& text) { return {{Fit(text, 12), Style::kQuiet}}; }

std::string ChannelName(const std::string& channel) {
  constexpr std::string_view kPrefix = "EVALBUS_";
  return channel.starts_with(kPrefix) ? channel.substr(kPrefix.size()) : channel;
}

Style StyleOf(const std::string& outcome) {
  return outcome == end_reason::kSuccess ? Style::kGood : outcome.empty() ? Style::kPlain : Style::kBad;
}

Line Title(const RunWatch& watch, const std::string& url, int width, SteadyTime now) {
  Line line = {{"evalbus monitor", Style::kStrong}};
  std::string where = url;
  if (watch.model()) {
    line = {{Printable(watch.model()->task + "/" + watch.model()->variation), Style::kStrong},
            {Printable("   " + watch.model()->robot + "   " +
                       (watch.health().contains("replay") ? "replay" : watch.model()->clock)),
             Style::kQuiet}};
    where = Printable(watch.model()->run_id);
  } else if (!watch.other_version().empty()) {
    line = {{watch.other_version(), Style::kBad}};
  } else if (watch.received_at()) {
    line.push_back({"   waiting for the MODEL message", Style::kQuiet});
  }
  const double silent = watch.received_at() ? Seconds(now - *watch.received_at()) : 0;
  if (watch.is_over()) {
    line.push_back({"   ended", Style::kQuiet});
  } else if (silent > Seconds(RunWatch::kSilent)) {
    line.push_back({fmt::format("   no message for {:.0f} s", silent), Style::kBad});
  }
  const std::string keys = "   q ends";
  const int room = width - LineWidth(line) - Width(keys) - 2;
  if (room >= 8)
    line.push_back({Pad(Width(where) > room ? Cut(where, room - 1) + "…" : where, room + 2), Style::kQuiet});
  if (room >= 0) line.push_back({keys, Style::kQuiet});
  return line;
}

Line EpisodeLine(const RunWatch& watch, int width) {
  if (watch.episode() < 0) return {{"no episode yet", Style::kQuiet}};
  std::string name = fmt::format("episode {}", watch.episode());
  if (watch.attempt() > 0) name += fmt::format(", attempt {}", int64_t{watch.attempt()} + 1);
  Line line = {{fmt::format("{:<12}", name + "  "), Style::kStrong}};
  line.push_back({fmt::format("{:<12}", watch.Phase()), StyleOf(watch.end_reason())});
  const double time = watch.state() ? static_cast<double>(watch.state()->sim_time_us) * 1e-6 : 0;
  line.push_back({Pad(watch.state() ? fmt::format("{:.2f}", time) : "-", 6) + " s"});
  if (watch.model()) {
    const double limit = static_cast<double>(watch.model()->time_limit_us) * 1e-6;
    line.push_back({fmt::format(" of {:g} s", limit), Style::kQuiet});
  }
  line.push_back({Pad(watch.has_rates() ? SpeedText(watch.speed()) : "-", 8)});
  line.push_back({width < 76 ? " x" : " x real time", Style::kQuiet});
  if (watch.has_scores() && watch.scores()->metrics.num_stages > 0) {
    line.push_back({"   progress ", Style::kQuiet});
    line.push_back({Percent(watch.scores()->metrics.subtask_progress)});
  }
  return line;
}

void AddStages(const RunWatch& watch, int width, std::vector<RankedLine>* screen) {
  const std::vector<StageRow> stages = StageRows(watch.scores()->metrics, watch.scores()->extended);
  const size_t columns = width >= 76 ? 2 : 1;
  const int room = std::min(46, width / static_cast<int>(columns));
  for (size_t row = 0; row * columns < stages.size(); ++row) {
    Line line;
    for (size_t k = row * columns; k < std::min((row + 1) * columns, stages.size()); ++k) {
      const bool reached = watch.has_scores() && stages[k].reached;
      line.push_back({std::string("  ") + StageMark(reached) + " ", reached ? Style::kGood : Style::kQuiet});
      line.push_back({Fit(stages[k].name, room - 16), reached ? Style::kPlain : Style::kQuiet});
      const bool has_time = reached && stages[k].time >= 0;
      line.push_back({Fit(has_time ? Pad(fmt::format("{:.2f} s", stages[k].time), 9) : "", 12)});
    }
    screen->push_back({1, line});
  }
}

void AddContacts(const RunWatch& watch, int width, std::vector<RankedLine>* screen) {
  Line line = Heading("contacts");
  if (!watch.contacts()) {
    line.push_back({"-"});
  } else {
    line.push_back({Fit(std::to_string(watch.contacts()->num_contacts), 6)});
    std::vector<const contact_t*> deepest;
    for (const contact_t& contact : watch.contacts()->contact) deepest.push_back(&contact);
    std::sort(deepest.begin(), deepest.end(),
              [](const contact_t* a, const contact_t* b) { return a->distance_m < b->distance_m; });
    if (!deepest.empty()) line.push_back({"deepest ", Style::kQuiet});
    // Adds as many contacts as fit.
    for (size_t i = 0; i < deepest.size(); ++i) {
      const std::string text = fmt::format(
          "{}{} – {} {}", i == 0 ? "" : ",  ", watch.GeomName(deepest[i]->geom_a),
          watch.GeomName(deepest[i]->geom_b), Millimeters(std::max(0.0, -deepest[i]->distance_m)));
      if (i > 0 && LineWidth(line) + Width(text) > width) break;
      line.push_back({text});
    }
  }
  screen->push_back({2, line});
}

void AddClearance(const RunWatch& watch, std::vector<RankedLine>* screen) {
  Line line = Heading("clearance");
  if (!watch.clearance()) {
    line.push_back({"-"});
  } else {
    line.push_back({Millimeters(watch.clearance()->clearance_m)});
    const extended_metrics_t& e = watch.scores()->extended;
    const double smallest = ExtendedValue(e, "min_clearance_m");
    if (watch.has_scores() && std::isfinite(smallest)) {
      line.push_back({"   smallest ", Style::kQuiet});
      line.push_back(
          {fmt::format("{} at {:.2f} s", Millimeters(smallest), ExtendedValue(e, "min_clearance_time_s"))});
    }
    line.push_back({fmt::format("   {} – {}", watch.GeomName(watch.clearance()->clearance_robot_geom),
                                watch.GeomName(watch.clearance()->clearance_scene_geom)),
                    Style::kQuiet});
  }
  screen->push_back({2, line});
}

void AddCounters(const RunWatch& watch, int width, std::vector<RankedLine>* screen) {
  Line line = Heading("counted");
  for (const MetricInfo& metric : Metrics()) {
    if (!metric.counter) continue;
    const int64_t count = watch.scores()->extended.*metric.counter;
    const bool is_known = watch.has_scores() && count != kUnavailableCount;
    const std::string shown = is_known ? std::to_string(count) : "-";
    line.push_back({fmt::format("{} {}  ", shown, metric.label),
                    watch.has_scores() && count > 0 ? Style::kBad : Style::kQuiet});
  }
  // If the line is too wide, removes the counts that are zero.
  for (size_t k = line.size(); k-- > 1 && LineWidth(line) > width;) {
    if (line[k].style == Style::kQuiet) line.erase(line.begin() + static_cast<std::ptrdiff_t>(k));
  }
  screen->push_back({6, line});
}

void AddEpisodes(const RunWatch& watch, int width, bool spacious, std::vector<RankedLine>* screen) {
  Line line = Heading("episodes");
  line.push_back({DoneText(watch.run() ? *watch.run() : run_summary_t{}, watch.planned_episodes())});
  // Adds the outcomes of the last episodes, newest first, as many as fit.
  for (auto episode = watch.done().rbegin(); !spacious && episode != watch.done().rend(); ++episode) {
    const std::string before = episode == watch.done().rbegin() ? "  last " : ", ";
    const std::string reason = Printable(end_reason::Outcome(episode->failure_reason));
    if (LineWidth(line) + Width(before) + Width(reason) > width) break;
    line.push_back({before, Style::kQuiet});
    line.push_back({reason, StyleOf(reason)});
  }
  screen->push_back({1, line});
  if (!spacious) return;
  size_t shown = 0;
  for (auto episode = watch.done().rbegin(); episode != watch.done().rend() && shown < 5;
       ++episode, ++shown) {
    const metric_values_t& m = episode->metrics;
    const std::string reason = Printable(end_reason::Outcome(episode->failure_reason));
    screen->push_back(
        {9,
         {{fmt::format("{:>10}  ", episode->header.episode), Style::kQuiet},
          {Fit(reason, 25), StyleOf(reason)},
          {fmt::format("{:>6.2f} s  stages {}", m.completion_time_s, StageCount(m))},
          {fmt::format("   {}{}", episode->complete ? "" : "incomplete ", Printable(episode->end_detail)),
           Style::kQuiet}}});
  }
}

// Adds the latencies from STATE to ACTION and from STATE to PARTIAL in the last real-time episode.
void AddPacing(const RunWatch& watch, std::vector<RankedLine>* screen) {
  const episode_end_t* end = watch.pacing();
  if (!end) return;
  const auto add = [&](const char* heading, const char* name, const time_distribution_t& times) {
    Line line = Heading(heading);
    line.push_back({fmt::format("STATE to {:<8}", name), Style::kQuiet});
    line.push_back({fmt::format("p50 {:.2f}  p99 {:.2f}  p99.9 {:.2f}  max {:.2f} ms", times.p50_s * 1e3,
                                times.p99_s * 1e3, times.p999_s * 1e3, times.max_s * 1e3)});
    screen->push_back({4, line});
  };
  add("real time", "ACTION", end->action_latency);
  add("", "score", end->partial_latency);
}

// Adds one line per component.
void AddComponents(const RunWatch& watch, SteadyTime now, std::vector<RankedLine>* screen) {
  screen->push_back({7,
                     {{fmt::format("{:<12}{:<9}{:>6}{:>6}{:>7}{:>13}{:>9}{:>9}", "component", "state", "tick",
                                   "lag", "lost", "undecodable", "foreign", "silent"),
                       Style::kQuiet}}});
  for (const auto& [name, health] : watch.health()) {
    const component_status_t& status = health.status;
    const bool lost = status.missing_ticks + status.decode_errors > 0;
    screen->push_back(
        {2,
         {{Fit(name, 12)},
          {Fit(health.silent ? "✕ silent" : StateWord(status), 9),
           health.is_bad() ? Style::kBad : Style::kPlain},
          {fmt::format("{:>6}{:>6}", status.last_tick < 0 ? "-" : std::to_string(status.last_tick),
                       health.lag < 0 ? "-" : std::to_string(health.lag))},
          {fmt::format("{:>7}{:>13}", status.missing_ticks, status.decode_errors),
           lost ? Style::kBad : Style::kPlain},
          {fmt::format("{:>9}", status.foreign_messages)},
          {fmt::format("{:>7.1f} s", Seconds(now - health.received)),
           health.silent ? Style::kBad : Style::kPlain},
          {status.error.empty() ? "" : "  " + Printable(status.error), Style::kBad}}});
  }
}

// Adds one line for all components, and one more line for each component with a problem.
void AddComponentsInBrief(const RunWatch& watch, SteadyTime now, std::vector<RankedLine>* screen) {
  Line line = Heading("components");
  line.push_back({"", Style::kQuiet});  // placeholder for the largest lag, filled in below
  int64_t lag = 0;
  for (const auto& [name, health] : watch.health()) {
    const component_status_t& status = health.status;
    lag = std::max(lag, health.lag);
    std::string counts;
    const std::pair<int64_t, const char*> kinds[] = {{status.missing_ticks, " lost"},
                                                     {status.decode_errors, " undecodable"},
                                                     {status.foreign_messages, " foreign"}};
    for (const auto& [count, kind] : kinds) {
      if (count > 0) counts += (counts.empty() ? "" : ", ") + std::to_string(count) + kind;
    }
    line.push_back({health.is_bad() ? "✕ " : "● ", health.is_bad() ? Style::kBad : Style::kGood});
    line.push_back({name + (counts.empty() ? "" : " (" + counts + ")") + " "});
    if (!health.is_bad()) continue;
    Line own = {{Fit("", 12)}, {"✕ " + name, Style::kBad}};
    own.push_back({health.silent ? fmt::format(" silent for {:.0f} s", Seconds(now - health.received))
                                 : " failed: " + Printable(status.error),
                   Style::kBad});
    own.push_back({fmt::format("   last tick {}", status.last_tick), Style::kQuiet});
    screen->push_back({1, own});
  }
  line[1].text = fmt::format("lag {:<5}", lag);
  screen->push_back({2, line});
}

void AddRates(const RunWatch& watch, std::vector<RankedLine>* screen) {
  Line line = Heading("per second");
  // These channels come first, in this order. All others follow.
  std::vector<std::string> names = {channels::kState.name,   channels::kContacts.name, channels::kAction.name,
                                    channels::kPartial.name, channels::kStatus.name,   channels::kModel.name};
  for (const auto& [name, channel] : watch.channels()) {
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }
  for (const std::string& name : names) {
    const auto channel = watch.channels().find(name);
    if (channel == watch.channels().end() || (watch.has_rates() && channel->second.rate < 0.05)) continue;
    line.push_back({ChannelName(Printable(name)) + " ", Style::kQuiet});
    line.push_back({(watch.has_rates() ? Rate(channel->second.rate) : "-") + "  "});
  }
  if (watch.undecodable() > 0)
    line.push_back({fmt::format("{} undecodable", watch.undecodable()), Style::kBad});
  screen->push_back({7, line});
}

// Adds log lines of the components: the last few lines if there is room, otherwise only the last warning.
void AddLog(const RunWatch& watch, bool spacious, std::vector<RankedLine>* screen) {
  constexpr size_t kShown = 5;
  const auto add = [&](const log_t& line, int rank) {
    screen->push_back({rank,
                       {{fmt::format("{:>10}  ", line.component), Style::kQuiet},
                        {fmt::format("{:<12}", PlaceText(line.header)), Style::kQuiet},
                        {line.text, line.level >= log_t::WARN_LEVEL ? Style::kBad : Style::kQuiet}}});
  };
  if (spacious) {
    const size_t first = watch.log().size() - std::min(kShown, watch.log().size());
    for (size_t i = first; i < watch.log().size(); ++i) add(watch.log()[i], 9);
    return;
  }
  const auto warning = std::find_if(watch.log().rbegin(), watch.log().rend(),
                                    [](const log_t& line) { return line.level >= log_t::WARN_LEVEL; });
  if (warning != watch.log().rend()) add(*warning, 6);
}

// Returns the lines of the screen. spacious: each component and each recent episode has its own line, and the
// last lines of the log are shown; otherwise these parts are shortened.
std::vector<RankedLine> Screen(const RunWatch& watch, const std::string& url, int width, bool spacious,
                               SteadyTime now) {
  constexpr int kBlank = 8;
  std::vector<RankedLine> screen = {{0, Title(watch, url, width, now)}};
  if (!watch.received_at()) {
    screen.push_back({0, {}});
    screen.push_back({0, {{"No message yet from " + url}}});
    if (watch.started() && now - *watch.started() > RunWatch::kSilent) {
      for (const char* text :
           {"Has the run ended? Is this its URL? A run in a private network namespace cannot be",
            "received from outside: 'evalbus monitor' without --url finds it and joins its namespace."}) {
        screen.push_back({1, {{text, Style::kQuiet}}});
      }
    }
    return screen;
  }
  screen.push_back({kBlank, {}});
  screen.push_back({0, EpisodeLine(watch, width)});
  if (watch.scores()) {
    AddStages(watch, width, &screen);
    screen.push_back({kBlank, {}});
    for (RankedLine& line : MetricTable(*watch.scores(), watch.has_scores(), width)) {
      screen.push_back(std::move(line));
    }
    screen.push_back({kBlank, {}});
    AddContacts(watch, width, &screen);
    AddClearance(watch, &screen);
    AddCounters(watch, width, &screen);
  }
  if (spacious) screen.push_back({kBlank, {}});
  AddEpisodes(watch, width, spacious, &screen);
  AddPacing(watch, &screen);
  if (spacious) screen.push_back({kBlank, {}});
  spacious ? AddComponents(watch, now, &screen) : AddComponentsInBrief(watch, now, &screen);
  AddRates(watch, &screen);
  if (spacious && !watch.log().empty()) screen.push_back({kBlank, Heading("log")});
  AddLog(watch, spacious, &screen);
  return screen;
}

}  // namespace

std::vector<Line> MonitorScreen(const RunWatch& watch, const std::string& url, int width, int height,
                                SteadyTime now) {
  if (width <= 0 || height <= 0) return {};
  std::vector<RankedLine> screen = Screen(watch, url, width, true, now);
  if (screen.size() > static_cast<size_t>(height)) screen = Screen(watch, url, width, false, now);
  while (screen.size() > static_cast<size_t>(height)) {
    // Removes the last line with the highest rank.
    const auto by_rank = [](const RankedLine& a, const RankedLine& b) { return a.rank < b.rank; };
    screen.erase(std::prev(std::max_element(screen.rbegin(), screen.rend(), by_rank).base()));
  }
  std::vector<Line> lines;
  for (RankedLine& ranked : screen) {
    Shorten(width, &ranked.line);
    lines.push_back(std::move(ranked.line));
  }
  return lines;
}

std::string ProgressLine(const RunWatch& watch) {
  if (!watch.has_scores() || !watch.end_reason().empty()) return "";
  const partial_metrics_t& scores = *watch.scores();
  std::string line = fmt::format("episode {}  {:.2f} s  {} x real time  {}", watch.episode(),
                                 scores.metrics.completion_time_s, SpeedText(watch.speed()),
                                 ScoreLine(scores.metrics, scores.extended));
  if (watch.clearance()) line += "  clearance " + Millimeters(watch.clearance()->clearance_m);
  return line;
}

}  // namespace evalbus::viz
