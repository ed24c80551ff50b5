// What a listener knows of a run from its messages, and how that looks as text: no bus, no terminal, no clock
// of its own.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "bus/bus.h"
#include "evalbus/component_status_t.hpp"
#include "evalbus/contacts_t.hpp"
#include "evalbus/episode_summary_t.hpp"
#include "evalbus/header_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "evalbus/partial_metrics_t.hpp"
#include "evalbus/run_summary_t.hpp"

namespace evalbus::viz {

// Meaning of a piece of text. Colours only repeat what symbols and words say.
enum class Style { kPlain, kStrong, kQuiet, kGood, kBad };

struct Span {
  std::string text;
  Style style = Style::kPlain;
};
using Line = std::vector<Span>;

// Length in characters and text of a line.
int LineWidth(const Line& line);
std::string LineText(const Line& line);

class MonitorModel {
 public:
  // A component that says nothing for longer is shown as silent (they all speak every 0.4 s).
  static constexpr std::chrono::seconds kSilent{2};

  // url: what to show as the place we listen at. planned_episodes: 0 = not known.
  explicit MonitorModel(std::string url, int planned_episodes = 0);

  // Any message of the run, in the order of arrival. What does not decode is counted.
  void Hear(const std::string& channel, std::span<const uint8_t> data, SteadyTime now);

  // The screen: at most height lines, none wider than width. What matters least is left out where there is
  // less room.
  std::vector<Line> Lines(int width, int height, SteadyTime now);

  // For output that is not a terminal: the state in one line, empty while no episode runs; and what happened
  // since the last call.
  std::string ProgressLine(SteadyTime now);
  std::vector<std::string> TakeEvents(SteadyTime now);

  // Time since the last message; since the first call of anything if there was none.
  double SilentFor(SteadyTime now);
  bool heard_anything() const { return heard_at_.has_value(); }

 private:
  struct Channel {
    int64_t count = 0;  // since the window began
    double rate = 0;    // 1/s
  };
  struct Health {
    component_status_t status{};
    SteadyTime heard{};
    // Ticks behind the sim when this was said; -1 where that cannot be told.
    int64_t lag = -1;
    bool silent = false;
  };
  // A line of the screen and how soon it may go: the highest rank goes first.
  struct Ranked {
    int rank;
    Line line;
  };
  // A value of the table.
  struct Scalar {
    int rank;
    std::string label, value, unit;
    bool alarming = false;
  };

  void EnterEpisode(int32_t episode, int32_t attempt);
  void OnState(std::span<const uint8_t> data);
  void OnStatus(const component_status_t& status, SteadyTime now);
  void OnEpisodeDone(const episode_summary_t& summary);
  // Message rates and speed over the last second.
  void RollWindow(SteadyTime now);
  void FindSilent(SteadyTime now);

  bool has_scores() const { return partial_ && partial_->header.episode == episode_ && !partial_is_old_; }
  std::string GeomName(int32_t geom) const;
  std::string Success() const;
  std::string Phase() const;

  std::vector<Ranked> Screen(int width, bool spacious, SteadyTime now) const;
  Line Title(int width, SteadyTime now) const;
  Line EpisodeLine(int width) const;
  void AddStages(int width, std::vector<Ranked>* screen) const;
  void AddMetrics(int width, std::vector<Ranked>* screen) const;
  void AddContacts(int width, std::vector<Ranked>* screen) const;
  void AddEpisodes(int width, bool spacious, std::vector<Ranked>* screen) const;
  void AddHealth(bool spacious, SteadyTime now, std::vector<Ranked>* screen) const;
  std::vector<Scalar> Scalars() const;

  std::string url_;
  int planned_episodes_;
  std::optional<SteadyTime> started_, heard_at_;

  std::optional<model_info_t> model_;
  std::vector<uint8_t> model_bytes_;
  std::string other_version_;  // what MODEL says it is, where its messages mean something else
  int32_t episode_ = -1, attempt_ = 0;
  // Episode and attempt of the last EPISODE_SUMMARY since one began.
  std::optional<std::pair<int32_t, int32_t>> summed_up_;
  std::optional<header_t> state_;  // of the latest STATE of this episode
  std::string end_reason_;         // empty while the episode goes on
  std::optional<partial_metrics_t> partial_;
  bool partial_is_old_ = true;  // of an attempt before; kept for the layout
  std::optional<contacts_t> contacts_, clearance_;
  std::deque<episode_summary_t> done_;  // newest last
  std::optional<run_summary_t> run_;

  std::map<std::string, Health> health_;
  std::map<std::string, Channel> channels_;
  SteadyTime window_began_{};
  int64_t window_simulated_us_ = 0;
  double speed_ = 0;  // simulated seconds per second
  bool has_rates_ = false;
  int64_t undecodable_ = 0;
  std::vector<std::string> events_;
};

}  // namespace evalbus::viz
