#include "viz/terminal/monitor_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "base/text.h"
#include "bus/channels.h"
#include "bus/message.h"
#include "evalbus/episode_begin_t.hpp"
#include "evalbus/episode_end_t.hpp"
#include "evalbus/state_t.hpp"
#include "lcmtypes/extended_value.h"

namespace evalbus::viz {
namespace {

constexpr size_t kKeptEpisodes = 20;
// Channels and components beyond these many are not shown; whoever invents names cannot fill the memory.
constexpr size_t kMaxNames = 100;

double Seconds(SteadyTime::duration duration) { return std::chrono::duration<double>(duration).count(); }

// The fewest columns for text whose right edge must not move: as many decimals as leave four digits.
std::string Number(double value) {
  if (!std::isfinite(value)) return "-";
  const double magnitude = std::abs(value);
  if (magnitude < 0.0005) return "0.000";  // without a sign that comes and goes
  if (magnitude >= 99999.5) return fmt::format("{:.0f}k", value * 1e-3);
  const int decimals = magnitude >= 999.95 ? 0 : magnitude >= 99.995 ? 1 : magnitude >= 9.9995 ? 2 : 3;
  return fmt::format("{:.{}f}", value, decimals);
}

std::string Rate(double rate) {
  return rate >= 9.95 ? fmt::format("{:.0f}", rate) : fmt::format("{:.1f}", rate);
}

std::string Speed(double speed) {
  return fmt::format("{:.{}f}", speed, speed >= 99.95 ? 0 : speed >= 9.995 ? 1 : 2);
}

std::string Millimetres(double metres) {
  return std::isfinite(metres) ? fmt::format("{:.1f}", metres * 1e3) : "-";
}

// Extended metrics that have a place of their own on the screen.
constexpr const char* kExtendedWithPlace[] = {"min_clearance_",    "peak_penetration_m",
                                              "contact_time_s",    "min_joint_limit_margin_rad",
                                              "mechanical_work_J", "peak_wrist_speed_mps"};

// "peak_wrist_acceleration_mps2.left" -> "peak wrist acceleration, left": without the unit at its end, if
// any.
std::string ExtendedLabel(const std::string& name, bool has_no_unit) {
  const size_t dot = std::min(name.find('.'), name.size());
  const size_t end = has_no_unit ? dot : std::min(name.rfind('_', dot), dot);
  std::string label = name.substr(0, end);
  std::replace(label.begin(), label.end(), '_', ' ');
  return dot < name.size() ? label + ", " + name.substr(dot + 1) : label;
}

std::string Fit(const std::string& text, int width) {
  return Pad(Width(text) > width ? Cut(text, std::max(0, width - 1)) + "…" : text, -width);
}

void Shorten(int width, Line* line) {
  std::string* last = line->empty() ? nullptr : &line->back().text;
  if (last != nullptr) last->erase(last->find_last_not_of(' ') + 1);
  if (LineWidth(*line) <= width) return;
  --width;
  for (Span& span : *line) {
    span.text = Cut(span.text, std::max(0, width));
    width -= Width(span.text);
  }
  line->push_back({"…"});
}

Line Heading(const std::string& text) { return {{Fit(text, 12), Style::kQuiet}}; }

double Sum(const std::vector<double>& values) { return std::accumulate(values.begin(), values.end(), 0.0); }

std::string StageCount(const metric_values_t& metrics) {
  return fmt::format("{}/{}", std::count(metrics.stage_reached.begin(), metrics.stage_reached.end(), 1),
                     metrics.num_stages);
}

std::string ChannelName(const std::string& channel) {
  constexpr std::string_view kPrefix = "EVALBUS_";
  return channel.starts_with(kPrefix) ? channel.substr(kPrefix.size()) : channel;
}

Style StyleOf(const std::string& end_reason) {
  return end_reason == "success" ? Style::kGood : end_reason.empty() ? Style::kPlain : Style::kBad;
}

const char* StateName(const component_status_t& status) {
  switch (status.state) {
    case component_status_t::READY:
      return status.last_tick < 0 ? "ready" : "running";
    case component_status_t::FAILED:
      return "failed";
    case component_status_t::STOPPED:
      return "stopped";
    default:
      return "idle";
  }
}

}  // namespace

int LineWidth(const Line& line) {
  return std::accumulate(line.begin(), line.end(), 0,
                         [](int sum, const Span& span) { return sum + Width(span.text); });
}

std::string LineText(const Line& line) {
  std::string text;
  for (const Span& span : line) text += span.text;
  return text.erase(text.find_last_not_of(' ') + 1);
}

MonitorModel::MonitorModel(std::string url, int planned_episodes)
    : url_(std::move(url)), planned_episodes_(planned_episodes) {}

// --- listening ---

void MonitorModel::Hear(const std::string& channel, std::span<const uint8_t> data, SteadyTime now) {
  RollWindow(now);
  heard_at_ = now;
  if (channels_.size() < kMaxNames || channels_.contains(channel)) ++channels_[channel].count;
  const auto decode = [&](auto* message) {
    if (Decode(data, message)) return true;
    ++undecodable_;
    return false;
  };
  if (channel == channels::kState) {
    OnState(data);
  } else if (channel == channels::kPartial) {
    partial_metrics_t partial{};
    if (!decode(&partial) || partial.header.episode != episode_) return;
    partial_ = std::move(partial);
    partial_is_old_ = false;
  } else if (channel == channels::kContacts) {
    contacts_t contacts{};
    if (!decode(&contacts) || contacts.header.episode != episode_) return;
    if (contacts.has_clearance) clearance_ = contacts;
    contacts_ = std::move(contacts);
  } else if (channel == channels::kStatus) {
    component_status_t status{};
    if (decode(&status)) OnStatus(status, now);
  } else if (channel == channels::kModel) {
    // Repeated, and the largest of all messages.
    if (std::equal(data.begin(), data.end(), model_bytes_.begin(), model_bytes_.end())) return;
    model_info_t model{};
    if (!decode(&model)) return;
    model_bytes_.assign(data.begin(), data.end());
    model_.reset();
    other_version_.clear();
    if (model.message_version == model_info_t::VERSION) {
      model_ = std::move(model);
      return;
    }
    // Nothing of it is shown as if we knew what it means.
    other_version_ = fmt::format("made by message version {}, this evalbus reads {}", model.message_version,
                                 int{model_info_t::VERSION});
    events_.push_back("MODEL " + other_version_);
  } else if (channel == channels::kEpisodeBegin) {
    episode_begin_t begin{};
    if (!decode(&begin)) return;
    // Repeated, but only before the first STATE; after it the same episode begins anew (a replay).
    if (begin.header.episode == episode_ && begin.header.attempt == attempt_ && !state_) return;
    EnterEpisode(begin.header.episode, begin.header.attempt);
    events_.push_back(fmt::format("episode {} begins, seed {}{}", episode_, begin.seed,
                                  attempt_ > 0 ? fmt::format(", try {}", int64_t{attempt_} + 1) : ""));
  } else if (channel == channels::kEpisodeEnd) {
    episode_end_t end{};
    if (decode(&end) && end.header.episode == episode_) end_reason_ = Printable(end.end_reason);
  } else if (channel == channels::kEpisodeSummary) {
    episode_summary_t summary{};
    if (decode(&summary)) OnEpisodeDone(summary);
  } else if (channel == channels::kRunSummary) {
    run_summary_t run{};
    if (!decode(&run)) return;
    // Repeated once a second; news only when it counts more.
    const bool news = run.num_episodes > 0 && (!run_ || run.num_episodes != run_->num_episodes);
    run_ = std::move(run);
    if (news) events_.push_back(Success());
  }
}

void MonitorModel::EnterEpisode(int32_t episode, int32_t attempt) {
  episode_ = episode;
  attempt_ = attempt;
  summed_up_.reset();
  state_.reset();
  end_reason_.clear();
  partial_is_old_ = true;
  contacts_.reset();
  clearance_.reset();
}

// Only the header: STATE is long and nothing else of it is shown.
void MonitorModel::OnState(std::span<const uint8_t> data) {
  const int size = static_cast<int>(data.size());
  int64_t fingerprint = 0;
  header_t header{};
  const int begin = __int64_t_decode_array(data.data(), 0, size, &fingerprint, 1);
  if (begin < 0 || fingerprint != state_t::getHash() ||
      header._decodeNoHash(data.data(), begin, size - begin) < 0 || !IsPlausible(header)) {
    ++undecodable_;
    return;
  }
  // Of an episode whose begin we have not heard: we came in its middle.
  if (header.episode != episode_) EnterEpisode(header.episode, 0);
  if (state_ && header.sim_time_us > state_->sim_time_us) {
    window_simulated_us_ += header.sim_time_us - state_->sim_time_us;
  }
  state_ = header;
}

void MonitorModel::OnStatus(const component_status_t& status, SteadyTime now) {
  const std::string component = Printable(status.component);
  if (health_.size() >= kMaxNames && !health_.contains(component)) return;
  Health& health = health_[component];
  if (status.state == component_status_t::FAILED && health.status.state != component_status_t::FAILED) {
    events_.push_back(fmt::format("{} failed: {}", status.component, Printable(status.error)));
  }
  if (health.silent) events_.push_back(fmt::format("{} is back", status.component));
  health.silent = false;
  health.status = status;
  health.heard = now;
  // Now: what it says is of now, and so is the STATE heard last.
  health.lag = state_ && end_reason_.empty() && status.episode == episode_ && status.last_tick >= 0
                   ? std::max<int64_t>(0, state_->tick - status.last_tick)
                   : -1;
  if (status.component == "sim") {
    // Says where we are when we come while the policy thinks.
    if (episode_ < 0 && status.episode >= 0) EnterEpisode(status.episode, status.attempt);
    if (status.episode == episode_) attempt_ = status.attempt;
  }
}

void MonitorModel::OnEpisodeDone(const episode_summary_t& summary) {
  const std::pair<int32_t, int32_t> key(summary.header.episode, summary.header.attempt);
  if (summed_up_ == key) return;  // said again
  summed_up_ = key;
  done_.push_back(summary);
  if (done_.size() > kKeptEpisodes) done_.pop_front();
  const metric_values_t& m = summary.metrics;
  events_.push_back(
      fmt::format("episode {} {} after {:.2f} s, stages {}, slips {}, collisions {} scene {} self, wrist "
                  "path {:.2f} m{}{}",
                  summary.header.episode, Printable(summary.end_reason), m.completion_time_s, StageCount(m),
                  m.slip_count, m.env_collision_count, m.self_collision_count, Sum(m.cartesian_path_length_m),
                  summary.complete ? "" : ", incomplete",
                  summary.end_detail.empty() ? "" : ": " + Printable(summary.end_detail)));
}

void MonitorModel::RollWindow(SteadyTime now) {
  if (!started_) started_ = window_began_ = now;
  const double elapsed = Seconds(now - window_began_);
  if (elapsed < 1) return;
  for (auto& [name, channel] : channels_) {
    channel.rate = static_cast<double>(channel.count) / elapsed;
    channel.count = 0;
  }
  speed_ = static_cast<double>(window_simulated_us_) * 1e-6 / elapsed;
  window_simulated_us_ = 0;
  window_began_ = now;
  has_rates_ = true;
}

void MonitorModel::FindSilent(SteadyTime now) {
  for (auto& [name, health] : health_) {
    if (health.silent || now - health.heard <= kSilent ||
        health.status.state == component_status_t::STOPPED ||
        health.status.state == component_status_t::FAILED) {
      continue;
    }
    health.silent = true;
    events_.push_back(fmt::format("{} is silent since {:.1f} s", name, Seconds(now - health.heard)));
  }
}

double MonitorModel::SilentFor(SteadyTime now) {
  if (!started_) started_ = window_began_ = now;
  return Seconds(now - heard_at_.value_or(*started_));
}

// --- words ---

std::string MonitorModel::GeomName(int32_t geom) const {
  if (model_ && geom >= 0 && geom < model_->num_geoms) {
    const auto i = static_cast<size_t>(geom);
    if (!model_->geom_name[i].empty()) return Printable(model_->geom_name[i]);
    const int32_t body = model_->geom_body[i];
    if (body >= 0 && body < model_->num_bodies)
      return Printable(model_->body_name[static_cast<size_t>(body)]);
  }
  return fmt::format("geom {}", geom);
}

std::string MonitorModel::Success() const {
  std::string text = std::to_string(run_ ? run_->num_episodes : 0);
  if (planned_episodes_ > 0) text += fmt::format(" of {}", planned_episodes_);
  text += " done";
  if (!run_) return text;
  if (run_->num_complete > 0) {
    text += fmt::format(", success {:.0f} % (CI {:.0f} to {:.0f})", run_->success_rate * 100,
                        run_->success_rate_lower * 100, run_->success_rate_upper * 100);
  }
  const int64_t incomplete = int64_t{run_->num_episodes} - run_->num_complete;
  if (incomplete > 0) text += fmt::format(", {} incomplete", incomplete);
  return text;
}

std::string MonitorModel::Phase() const {
  if (!end_reason_.empty()) return end_reason_;
  if (episode_ < 0) return "";
  if (state_) return "running";
  const auto sim = health_.find("sim");
  // In the middle of an episode whose STATE we have not heard yet.
  const bool mid_episode = sim != health_.end() && sim->second.status.state == component_status_t::READY &&
                           sim->second.status.episode == episode_ && sim->second.status.attempt == attempt_;
  return mid_episode ? "waiting for the next tick" : "waiting for components";
}

std::string MonitorModel::ProgressLine(SteadyTime now) {
  RollWindow(now);
  if (!has_scores() || !end_reason_.empty()) return "";
  const metric_values_t& m = partial_->metrics;
  std::string line = fmt::format(
      "episode {}  {:.2f} s  {} x real time  stages {}  slips {}  collisions {} scene {} self  wrist "
      "path {:.2f} m",
      episode_, m.completion_time_s, Speed(speed_), StageCount(m), m.slip_count, m.env_collision_count,
      m.self_collision_count, Sum(m.cartesian_path_length_m));
  if (clearance_) line += fmt::format("  clearance {} mm", Millimetres(clearance_->clearance_m));
  return line;
}

std::vector<std::string> MonitorModel::TakeEvents(SteadyTime now) {
  FindSilent(now);
  return std::exchange(events_, {});
}

// --- the screen ---

std::vector<Line> MonitorModel::Lines(int width, int height, SteadyTime now) {
  RollWindow(now);
  FindSilent(now);
  if (width <= 0 || height <= 0) return {};
  std::vector<Ranked> screen = Screen(width, true, now);
  if (screen.size() > static_cast<size_t>(height)) screen = Screen(width, false, now);
  while (screen.size() > static_cast<size_t>(height)) {
    // The last one of the highest rank.
    screen.erase(
        std::prev(std::max_element(screen.rbegin(), screen.rend(), [](const Ranked& a, const Ranked& b) {
                    return a.rank < b.rank;
                  }).base()));
  }
  std::vector<Line> lines;
  for (Ranked& ranked : screen) {
    Shorten(width, &ranked.line);
    lines.push_back(std::move(ranked.line));
  }
  return lines;
}

// spacious: one line for each component, episode and so on.
std::vector<MonitorModel::Ranked> MonitorModel::Screen(int width, bool spacious, SteadyTime now) const {
  constexpr int kBlank = 8;
  std::vector<Ranked> screen = {{0, Title(width, now)}};
  if (!heard_at_) {
    screen.push_back({0, {}});
    screen.push_back({0, {{"No message yet from " + url_}}});
    if (started_ && now - *started_ > kSilent) {
      for (const char* text :
           {"Is the run over? Is this its URL? A run in a private network namespace cannot be",
            "heard from outside: 'evalbus monitor' without --url finds it and listens inside."}) {
        screen.push_back({1, {{text, Style::kQuiet}}});
      }
    }
    return screen;
  }
  screen.push_back({kBlank, {}});
  screen.push_back({0, EpisodeLine(width)});
  if (partial_) {
    AddStages(width, &screen);
    screen.push_back({kBlank, {}});
    AddMetrics(width, &screen);
    screen.push_back({kBlank, {}});
    AddContacts(width, &screen);
  }
  if (spacious) screen.push_back({kBlank, {}});
  AddEpisodes(width, spacious, &screen);
  if (spacious) screen.push_back({kBlank, {}});
  AddHealth(spacious, now, &screen);
  return screen;
}

Line MonitorModel::Title(int width, SteadyTime now) const {
  Line line = {{"evalbus monitor", Style::kStrong}};
  std::string where = url_;
  if (model_) {
    line = {
        {Printable(model_->task + "/" + model_->variation), Style::kStrong},
        {Printable("   " + model_->robot + "   " + (health_.contains("replay") ? "replay" : model_->clock)),
         Style::kQuiet}};
    where = Printable(model_->run_id);
  } else if (!other_version_.empty()) {
    line = {{other_version_, Style::kBad}};
  } else if (heard_at_) {
    line.push_back({"   waiting for the names (MODEL)", Style::kQuiet});
  }
  const double silent = heard_at_ ? Seconds(now - *heard_at_) : 0;
  if (silent > Seconds(kSilent))
    line.push_back({fmt::format("   nothing heard for {:.0f} s", silent), Style::kBad});
  const std::string keys = "   q ends";
  const int room = width - LineWidth(line) - Width(keys) - 2;
  if (room >= 8)
    line.push_back({Pad(Width(where) > room ? Cut(where, room - 1) + "…" : where, room + 2), Style::kQuiet});
  if (room >= 0) line.push_back({keys, Style::kQuiet});
  return line;
}

Line MonitorModel::EpisodeLine(int width) const {
  if (episode_ < 0) return {{"no episode yet", Style::kQuiet}};
  std::string name = fmt::format("episode {}", episode_);
  if (attempt_ > 0) name += fmt::format(", try {}", int64_t{attempt_} + 1);
  Line line = {{fmt::format("{:<12}", name + "  "), Style::kStrong}};
  line.push_back({fmt::format("{:<12}", Phase()), StyleOf(end_reason_)});
  const double time = state_ ? static_cast<double>(state_->sim_time_us) * 1e-6 : 0;
  line.push_back({Pad(state_ ? fmt::format("{:.2f}", time) : "-", 6) + " s"});
  if (model_) {
    const double limit = static_cast<double>(model_->time_limit_us) * 1e-6;
    line.push_back({fmt::format(" of {:g} s", limit), Style::kQuiet});
  }
  line.push_back({Pad(has_rates_ ? Speed(speed_) : "-", 8)});
  line.push_back({width < 76 ? " x" : " x real time", Style::kQuiet});
  if (has_scores() && partial_->metrics.num_stages > 0) {
    line.push_back({"   progress ", Style::kQuiet});
    line.push_back({fmt::format("{:.0f} %", partial_->metrics.subtask_progress * 100)});
  }
  return line;
}

void MonitorModel::AddStages(int width, std::vector<Ranked>* screen) const {
  const metric_values_t& m = partial_->metrics;
  const size_t columns = width >= 76 ? 2 : 1;
  const int room = std::min(46, width / static_cast<int>(columns));
  for (size_t row = 0; row * columns < m.stage_name.size(); ++row) {
    Line line;
    for (size_t k = row * columns; k < std::min((row + 1) * columns, m.stage_name.size()); ++k) {
      const bool reached = has_scores() && m.stage_reached[k];
      const double when =
          reached && k < partial_->extended.stage_time_s.size() ? partial_->extended.stage_time_s[k] : -1;
      line.push_back({reached ? "  ● " : "  ○ ", reached ? Style::kGood : Style::kQuiet});
      line.push_back({Fit(Printable(m.stage_name[k]), room - 16), reached ? Style::kPlain : Style::kQuiet});
      line.push_back({Fit(when >= 0 ? Pad(fmt::format("{:.2f} s", when), 9) : "", 12)});
    }
    screen->push_back({1, line});
  }
}

std::vector<MonitorModel::Scalar> MonitorModel::Scalars() const {
  const metric_values_t& m = partial_->metrics;
  const extended_metrics_t& e = partial_->extended;
  std::vector<Scalar> scalars;
  const auto add = [&](int rank, const std::string& label, const std::string& value, const std::string& unit,
                       bool alarming = false) {
    scalars.push_back({rank, label, has_scores() ? value : "-", unit, has_scores() && alarming});
  };
  if (m.tracks_collisions) {
    add(3, "collisions, scene", fmt::format("{}", m.env_collision_count), "", m.env_collision_count > 0);
    add(3, "collisions, self", fmt::format("{}", m.self_collision_count), "", m.self_collision_count > 0);
  }
  if (m.tracks_slippage) {
    add(3, "slips", fmt::format("{}", m.slip_count), "", m.slip_count > 0);
    for (size_t k = 0; m.object_name.size() > 1 && k < m.object_name.size(); ++k) {
      add(6, "slips, " + m.object_name[k], fmt::format("{}", m.slip_count_per_object[k]), "");
    }
  }
  for (size_t k = 0; k < m.target_distance_m.size(); ++k) {
    const std::string& name = m.target_distance_name[k];
    add(3, name.empty() ? "target distance" : name, Number(m.target_distance_m[k]), "m");
  }
  for (size_t k = 0; k < m.object_pose_error_rad.size(); ++k) {
    const std::string& name = m.pose_error_name[k];
    add(3, name.empty() ? "pose error" : name, Number(m.object_pose_error_rad[k]), "rad");
  }
  add(4, "deepest penetration", Millimetres(ExtendedValue(e, "peak_penetration_m")), "mm");
  add(5, "touching the scene", Number(ExtendedValue(e, "contact_time_s")), "s");
  if (m.tracks_vel_sync)
    add(5, "arm speed difference", Number(m.bimanual_arm_velocity_difference_radps), "rad/s");
  if (m.tracks_vertical_sync)
    add(5, "height difference", Millimetres(m.bimanual_gripper_vertical_difference_m), "mm");
  const double margin = ExtendedValue(e, "min_joint_limit_margin_rad");
  add(5, "joint limit margin", Number(margin), "rad", margin < 0);
  // Every other extended metric, as it is called, where there is room.
  for (size_t k = 0; k < e.name.size(); ++k) {
    const auto shown = [&](const char* name) { return e.name[k].starts_with(name); };
    if (std::any_of(std::begin(kExtendedWithPlace), std::end(kExtendedWithPlace), shown)) continue;
    const bool is_number = std::isfinite(e.value_mixed[k]);
    const bool is_count = e.unit[k] == "count";
    add(8, ExtendedLabel(e.name[k], is_count || e.unit[k] == "1"),
        !is_number ? "-"
        : is_count ? fmt::format("{:.0f}", e.value_mixed[k])
                   : Number(e.value_mixed[k]),
        is_count || e.unit[k] == "1" ? "" : e.unit[k]);
  }
  return scalars;
}

void MonitorModel::AddMetrics(int width, std::vector<Ranked>* screen) const {
  const metric_values_t& m = partial_->metrics;
  const extended_metrics_t& e = partial_->extended;
  constexpr int kArmLabel = 15, kValue = 7, kUnit = 7, kGap = 3;
  // Both arms together only where that is a metric of its own.
  const bool both = m.num_arms == 2;
  const std::vector<double> work = ExtendedValues(e, "mechanical_work_J");
  const std::vector<double> top_speed = ExtendedValues(e, "peak_wrist_speed_mps");
  struct Row {
    int rank;
    std::string label;
    const std::vector<double>& arms;
    std::optional<double> both;
    const char* unit;
    bool tracked;
  };
  const auto sum = [](const std::vector<double>& values) { return std::optional(Sum(values)); };
  const std::vector<Row> rows = {
      {3, "wrist path", m.cartesian_path_length_m, sum(m.cartesian_path_length_m), "m",
       m.tracks_cartesian_path_length != 0},
      {4, "joint path", m.joint_path_length_rad, sum(m.joint_path_length_rad), "rad",
       m.tracks_joint_path_length != 0},
      {5, "wrist rotation", m.orientation_path_length_rad, sum(m.orientation_path_length_rad), "rad",
       m.tracks_orientation_path_length != 0},
      {5, "wrist jerk rms", m.rms_cartesian_jerk_mps3, m.overall_rms_cartesian_jerk_mps3, "m/s³",
       m.tracks_cartesian_jerk != 0},
      {7, "wrist jerk mean", m.avg_cartesian_jerk_mps3, m.overall_avg_cartesian_jerk_mps3, "m/s³",
       m.tracks_cartesian_jerk != 0},
      {5, "joint jerk rms", m.rms_joint_jerk_radps3, m.overall_rms_joint_jerk_radps3, "rad/s³",
       m.tracks_joint_jerk != 0},
      {7, "joint jerk mean", m.avg_joint_jerk_radps3, m.overall_avg_joint_jerk_radps3, "rad/s³",
       m.tracks_joint_jerk != 0},
      {6, "work", work, sum(work), "J", true},
      {6, "top wrist speed", top_speed, std::nullopt, "m/s", true},
  };
  std::vector<Ranked> left, right;
  Line head = {{std::string(kArmLabel, ' ')}};
  for (const std::string& name : m.arm_name)
    head.push_back({Pad(Cut(Printable(name), kValue - 1), kValue), Style::kQuiet});
  if (both) head.push_back({Pad("both", kValue), Style::kQuiet});
  if (m.num_arms > 1) left.push_back({3, head});
  for (const Row& row : rows) {
    if (!row.tracked) continue;
    Line line = {{Fit(row.label, kArmLabel), Style::kQuiet}};
    for (const double value : row.arms) line.push_back({Pad(has_scores() ? Number(value) : "-", kValue)});
    if (both) line.push_back({Pad(row.both ? has_scores() ? Number(*row.both) : "-" : "", kValue)});
    line.push_back({Fit(" " + std::string(row.unit), kUnit), Style::kQuiet});
    left.push_back({row.rank, line});
  }
  const int left_width = kArmLabel + kValue * (m.num_arms + (both ? 1 : 0)) + kUnit;
  const bool two_columns = width >= left_width + kGap + 33;
  const int long_label = left_width - kValue - kUnit;
  const int label = two_columns ? std::min(30, width - left_width - kGap - kValue - kUnit + 1) : long_label;
  const auto add = [](const Scalar& scalar, int label_width, std::vector<Ranked>* column) {
    column->push_back({scalar.rank,
                       {{Fit(Printable(scalar.label), label_width), Style::kQuiet},
                        {Pad(scalar.value, kValue), scalar.alarming ? Style::kBad : Style::kPlain},
                        {Fit(scalar.unit.empty() ? "" : " " + scalar.unit, kUnit), Style::kQuiet}}});
  };
  std::vector<Scalar> scalars = Scalars();
  if (!two_columns) {
    for (const Scalar& scalar : scalars) add(scalar, long_label, screen);
    screen->insert(screen->end(), left.begin(), left.end());
    return;
  }
  // Beside each other, equally long; a row is worth what its better half is.
  const size_t height = std::max(left.size(), (left.size() + scalars.size() + 1) / 2);
  for (size_t i = 0; i < scalars.size(); ++i) {
    if (i < height) {
      add(scalars[i], label, &right);
    } else {
      add(scalars[i], long_label, &left);
    }
  }
  for (size_t i = 0; i < height; ++i) {
    Ranked row{9, {}};
    if (i < left.size()) row = left[i];
    row.line.push_back(
        {std::string(static_cast<size_t>(std::max(0, left_width + kGap - LineWidth(row.line))), ' ')});
    if (i < right.size()) {
      row.rank = std::min(row.rank, right[i].rank);
      row.line.insert(row.line.end(), right[i].line.begin(), right[i].line.end());
    }
    screen->push_back(std::move(row));
  }
}

void MonitorModel::AddContacts(int width, std::vector<Ranked>* screen) const {
  const extended_metrics_t& e = partial_->extended;
  Line line = Heading("contacts");
  if (!contacts_) {
    line.push_back({"-"});
  } else {
    line.push_back({Fit(std::to_string(contacts_->num_contacts), 6)});
    std::vector<const contact_t*> deepest;
    for (const contact_t& contact : contacts_->contact) deepest.push_back(&contact);
    std::sort(deepest.begin(), deepest.end(),
              [](const contact_t* a, const contact_t* b) { return a->distance_m < b->distance_m; });
    if (!deepest.empty()) line.push_back({"deepest ", Style::kQuiet});
    // As many as there is room for.
    for (size_t i = 0; i < deepest.size(); ++i) {
      const std::string text =
          fmt::format("{}{} – {} {} mm", i == 0 ? "" : ",  ", GeomName(deepest[i]->geom_a),
                      GeomName(deepest[i]->geom_b), Millimetres(std::max(0.0, -deepest[i]->distance_m)));
      if (i > 0 && LineWidth(line) + Width(text) > width) break;
      line.push_back({text});
    }
  }
  screen->push_back({2, line});
  line = Heading("clearance");
  if (!clearance_) {
    line.push_back({"-"});
  } else {
    line.push_back({Millimetres(clearance_->clearance_m) + " mm"});
    const double smallest = ExtendedValue(e, "min_clearance_m");
    if (has_scores() && std::isfinite(smallest)) {
      line.push_back({"   smallest ", Style::kQuiet});
      line.push_back({fmt::format("{} mm at {:.2f} s", Millimetres(smallest),
                                  ExtendedValue(e, "min_clearance_time_s"))});
    }
    line.push_back({fmt::format("   {} – {}", GeomName(clearance_->clearance_robot_geom),
                                GeomName(clearance_->clearance_scene_geom)),
                    Style::kQuiet});
  }
  screen->push_back({2, line});
  line = Heading("counted");
  const std::pair<const char*, int64_t> counts[] = {{"actions clipped", e.action_clips},
                                                    {"late", e.deadline_misses},
                                                    {"ticks missing", e.missing_ticks},
                                                    {"samples refused", e.refused_samples}};
  for (const auto& [name, count] : counts) {
    const bool bad = has_scores() && count > 0;
    line.push_back({(has_scores() ? std::to_string(count) : "-") + " " + name + "   ",
                    bad ? Style::kBad : Style::kQuiet});
  }
  screen->push_back({6, line});
}

void MonitorModel::AddEpisodes(int width, bool spacious, std::vector<Ranked>* screen) const {
  Line line = Heading("episodes");
  line.push_back({Success()});
  // How the last ones ended, the newest first, as many as there is room for.
  for (auto episode = done_.rbegin(); !spacious && episode != done_.rend(); ++episode) {
    const std::string before = episode == done_.rbegin() ? "  last " : ", ";
    const std::string reason = Printable(episode->end_reason);
    if (LineWidth(line) + Width(before) + Width(reason) > width) break;
    line.push_back({before, Style::kQuiet});
    line.push_back({reason, StyleOf(episode->end_reason)});
  }
  screen->push_back({1, line});
  if (!spacious) return;
  size_t shown = 0;
  for (auto episode = done_.rbegin(); episode != done_.rend() && shown < 5; ++episode, ++shown) {
    const metric_values_t& m = episode->metrics;
    screen->push_back(
        {9,
         {{fmt::format("{:>10}  ", episode->header.episode), Style::kQuiet},
          {Fit(Printable(episode->end_reason), 15), StyleOf(episode->end_reason)},
          {fmt::format("{:>6.2f} s  stages {}", m.completion_time_s, StageCount(m))},
          {fmt::format("   {}{}", episode->complete ? "" : "incomplete ", Printable(episode->end_detail)),
           Style::kQuiet}}});
  }
}

void MonitorModel::AddHealth(bool spacious, SteadyTime now, std::vector<Ranked>* screen) const {
  const auto is_bad = [](const Health& health) {
    return health.silent || health.status.state == component_status_t::FAILED;
  };
  if (spacious) {
    screen->push_back({7,
                       {{fmt::format("{:<12}{:<9}{:>6}{:>6}{:>7}{:>9}{:>9}{:>9}", "component", "state",
                                     "tick", "lag", "lost", "garbled", "foreign", "heard"),
                         Style::kQuiet}}});
    for (const auto& [name, health] : health_) {
      const component_status_t& status = health.status;
      const bool lost = status.missing_ticks + status.decode_errors > 0;
      screen->push_back(
          {2,
           {{Fit(name, 12)},
            {Fit(health.silent ? "✕ silent" : StateName(status), 9),
             is_bad(health) ? Style::kBad : Style::kPlain},
            {fmt::format("{:>6}{:>6}", status.last_tick < 0 ? "-" : std::to_string(status.last_tick),
                         health.lag < 0 ? "-" : std::to_string(health.lag))},
            {fmt::format("{:>7}{:>9}", status.missing_ticks, status.decode_errors),
             lost ? Style::kBad : Style::kPlain},
            {fmt::format("{:>9}", status.foreign_messages)},
            {fmt::format("{:>7.1f} s", Seconds(now - health.heard)),
             health.silent ? Style::kBad : Style::kPlain},
            {status.error.empty() ? "" : "  " + Printable(status.error), Style::kBad}}});
    }
  } else {
    // All is well in one line; who is not has one of its own.
    Line line = Heading("components");
    line.push_back({"", Style::kQuiet});  // the largest lag, below
    int64_t lag = 0;
    for (const auto& [name, health] : health_) {
      const component_status_t& status = health.status;
      lag = std::max(lag, health.lag);
      std::string counts;
      const std::pair<int64_t, const char*> kinds[] = {{status.missing_ticks, " lost"},
                                                       {status.decode_errors, " garbled"},
                                                       {status.foreign_messages, " foreign"}};
      for (const auto& [count, kind] : kinds) {
        if (count > 0) counts += (counts.empty() ? "" : ", ") + std::to_string(count) + kind;
      }
      line.push_back({is_bad(health) ? "✕ " : "● ", is_bad(health) ? Style::kBad : Style::kGood});
      line.push_back({name + (counts.empty() ? "" : " (" + counts + ")") + " "});
      if (!is_bad(health)) continue;
      Line own = {{Fit("", 12)}, {"✕ " + name, Style::kBad}};
      own.push_back({health.silent ? fmt::format(" silent for {:.0f} s", Seconds(now - health.heard))
                                   : " failed: " + Printable(status.error),
                     Style::kBad});
      own.push_back({fmt::format("   last tick {}", status.last_tick), Style::kQuiet});
      screen->push_back({1, own});
    }
    line[1].text = fmt::format("lag {:<5}", lag);
    screen->push_back({2, line});
  }
  Line line = Heading("per second");
  // In the order of an episode's tick, then the rest.
  std::vector<std::string> names;
  for (const std::string_view name : {std::string_view(channels::kState), std::string_view(channels::kContacts),
                                      std::string_view(channels::kAction), std::string_view(channels::kPartial),
                                      std::string_view(channels::kStatus), std::string_view(channels::kModel)}) {
    names.emplace_back(name);
  }
  for (const auto& [name, channel] : channels_) {
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }
  for (const std::string& name : names) {
    const auto channel = channels_.find(name);
    if (channel == channels_.end() || (has_rates_ && channel->second.rate < 0.05)) continue;
    line.push_back({ChannelName(Printable(name)) + " ", Style::kQuiet});
    line.push_back({(has_rates_ ? Rate(channel->second.rate) : "-") + "  "});
  }
  if (undecodable_ > 0) line.push_back({fmt::format("{} garbled", undecodable_), Style::kBad});
  screen->push_back({7, line});
}

}  // namespace evalbus::viz
