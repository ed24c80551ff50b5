#include "results/rescorer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/errors.h"
#include "base/json_file.h"
#include "bus/bus.h"
#include "bus/channels.h"
#include "bus/message.h"
#include "lcmtypes/end_reason.h"
#include "lcmtypes/source.h"
#include "results/episode_json.h"

namespace evalbus::results {

bool RescoredEpisode::equal() const { return recorded && SameBits(*recorded, summary); }

RescoredLog Rescorer::Rescore(const std::filesystem::path& file) {
  EventLogReader reader(file);
  RescoredLog log;
  running_ = false;
  model_.reset();
  next_model_.reset();
  other_type_.clear();
  try {
    for (LogEvent event; reader.Next(&event);) OnEvent(event, &log);
    Finish(std::nullopt, &log);
    if (log.episodes.empty() && !other_type_.empty()) {
      throw InputError("made by another version of evalbus: " + other_type_ +
                       " has a type that this version cannot read");
    }
  } catch (const InputError& error) {
    throw InputError(file.string() + ": " + error.what());
  }
  log.damaged_bytes = reader.damaged_bytes();
  log.damaged_places = reader.damaged_places();
  return log;
}

void Rescorer::OnEvent(const LogEvent& event, RescoredLog* log) {
  const auto decode = [&](auto* message) {
    bool good = Decode(event.data, message);
    if constexpr (requires { message->header; }) good = good && IsPlausible(message->header);
    log->decode_errors += !good;
    const int64_t found = Fingerprint(event.data);
    if (!good && found != 0 && found != message->getHash()) other_type_ = event.channel;
    return good;
  };
  if (event.channel == channels::kState) {
    OnTickMessage(event, &state_, log);
  } else if (event.channel == channels::kContacts) {
    OnTickMessage(event, &contacts_, log);
  } else if (event.channel == channels::kModel) {
    if ((model_ || next_model_) && std::ranges::equal(event.data, model_bytes_)) return;
    auto model = std::make_shared<model_info_t>();
    if (!decode(model.get())) return;
    model_bytes_.assign(event.data.begin(), event.data.end());
    next_model_ = std::move(model);
  } else if (event.channel == channels::kEpisodeBegin) {
    episode_begin_t begin{};
    if (!decode(&begin)) return;
    // EPISODE_BEGIN is repeated until all components are ready.
    if (running_ && IsOurs(begin.header)) return;
    Finish(std::nullopt, log);
    Begin(begin);
  } else if (event.channel == channels::kEpisodeEnd) {
    episode_end_t end{};
    if (!decode(&end) || !running_ || !IsOurs(end.header)) return;
    conflicts_.Check(event.channel, 0, event.data);
    if (end_) return;
    end_ = end;
    merger_.EndAt(end.header.tick);
    ScoreTicks();
  } else if (event.channel == channels::kEpisodeSummary) {
    episode_summary_t recorded{};
    if (!decode(&recorded) || !running_ || !IsOurs(recorded.header)) return;
    // The metrics process did not wait for messages after its EPISODE_SUMMARY.
    Finish(recorded, log);
  }
}

void Rescorer::Begin(const episode_begin_t& begin) {
  if (next_model_) {
    model_ = std::move(next_model_);
    if (scorer_bytes_ != model_bytes_) scorer_.reset();
  }
  if (!model_) return;
  if (!scorer_) {
    TaskDescription task = task_ ? *task_ : ParseTask(model_->task_yaml, model_->task_file, false);
    task.Apply(model_->variation);
    task.ApplyRobot(model_->robot, ArmNames(*model_));
    scorer_ = std::make_unique<metrics::EpisodeScorer>(*model_, task);
    scorer_bytes_ = model_bytes_;
  }
  begin_ = begin;
  last_ = begin.header;
  end_.reset();
  own_end_.reset();
  scorer_->Start();
  merger_.Start();
  conflicts_.Start();
  running_ = true;
  if (on_begin_) on_begin_(model_, begin_);
}

template <class Message>
void Rescorer::OnTickMessage(const LogEvent& event, Message* message, RescoredLog* log) {
  if (!running_ || own_end_) return;
  if (!Decode(event.data, message)) {
    ++log->decode_errors;
    return;
  }
  const header_t& header = message->header;
  if (!IsOurs(header) || !merger_.IsNear(header.tick)) return;
  const auto answer = conflicts_.Check(event.channel, header.tick, event.data);
  if (answer != ConflictDetector::Answer::kNew || !merger_.Add(*message)) return;
  if (message->header.tick > last_.tick) last_ = message->header;
  ScoreTicks();
}

void Rescorer::ScoreTicks() {
  metrics::TickMerger::Pair pair;
  while (!own_end_ && merger_.Next(&pair)) {
    scorer_->Tick(*pair.state, *pair.contacts);
    if (on_tick_) on_tick_(*scorer_, *pair.state, *pair.contacts);
    if (!task_) continue;
    episode_end_t end{};
    end.header = pair.state->header;
    if (scorer_->verdict() != partial_metrics_t::UNDECIDED) {
      // A real-time episode continues until the sim receives the verdict.
      if (model_->clock == clock_name::kRealtime) continue;
      if (scorer_->verdict() == partial_metrics_t::SUCCESS && !IsAfterSuccess(end.header)) continue;
      end.end_reason = end_reason::Of(scorer_->verdict());
    } else if (end.header.sim_time_us >= std::llround(task_->time_limit * 1e6)) {
      end.end_reason = end_reason::kTimeLimit;
    } else {
      continue;
    }
    own_end_ = end;
  }
}

void Rescorer::Finish(const std::optional<episode_summary_t>& recorded, RescoredLog* log) {
  if (!running_) return;
  running_ = false;
  RescoredEpisode episode;
  episode.model = model_;
  if (model_->source == source_name::kSim) episode.begin = begin_;
  episode.recorded = recorded;
  episode.has_end = end_.has_value();
  if (!end_) {
    end_.emplace();
    end_->header = recorded ? recorded->header : last_;
    end_->end_reason = recorded ? recorded->end_reason : end_reason::kAborted;
    end_->detail = recorded ? recorded->end_detail : "the log ends before the episode";
  }
  merger_.EndAt(end_->header.tick);
  merger_.GiveUp();
  ScoreTicks();
  // Other ends, such as a policy error, set `detail`. They would also have occurred with this task.
  const bool ended_by_itself = !end_->detail.empty() && end_->end_reason != end_reason::kAborted;
  if (own_end_) {
    end_ = own_end_;
  } else if (task_ && scorer_->verdict() == partial_metrics_t::SUCCESS && !ended_by_itself &&
             !IsAfterSuccess(end_->header)) {
    end_->end_reason = end_reason::kAborted;
    end_->detail = "the log ends before after_success_s have passed since this description's success";
  } else if (task_ && scorer_->verdict() != partial_metrics_t::UNDECIDED &&
             end_->end_reason != end_reason::kServerError) {
    end_->end_reason = end_reason::Of(scorer_->verdict());
  } else if (task_ && end_->end_reason == end_reason::kTimeLimit) {
    end_->end_reason = end_reason::kAborted;
    end_->detail = "the log ends before this description's time limit";
  }
  if (!conflicts_.conflict().empty()) {
    end_->end_reason = end_reason::kAborted;
    end_->detail = conflicts_.conflict();
  }
  scorer_->EndAt(end_->header.tick);
  episode.summary = scorer_->Summary(begin_, *end_);
  log->episodes.push_back(std::move(episode));
}

std::vector<Difference> Differences(const episode_summary_t& before, const episode_summary_t& after) {
  return Differences(EpisodeJson("", "", before), EpisodeJson("", "", after));
}

std::vector<Difference> Differences(const nlohmann::ordered_json& before,
                                    const nlohmann::ordered_json& after) {
  const auto a = before.flatten(), b = after.flatten();
  std::vector<Difference> differences;
  const auto add = [&](const std::string& key, const std::string& x, const std::string& y) {
    std::string name = key.substr(1);
    std::replace(name.begin(), name.end(), '/', '.');
    // "~1" is a slash within a key, such as "lift_pot/base".
    for (size_t at; (at = name.find("~1")) != std::string::npos;) name.replace(at, 2, "/");
    differences.push_back({std::move(name), x, y});
  };
  for (const auto& [key, value] : a.items()) {
    const auto other = b.find(key);
    if (other == b.end()) {
      add(key, ToText(value), kAbsent);
    } else if (*other != value) {
      add(key, ToText(value), ToText(*other));
    }
  }
  for (const auto& [key, value] : b.items()) {
    if (!a.contains(key)) add(key, kAbsent, ToText(value));
  }
  return differences;
}

bool SameBits(const episode_summary_t& a, const episode_summary_t& b) { return Encode(a) == Encode(b); }

std::string DifferencesText(const std::vector<Difference>& differences) {
  constexpr size_t kShown = 3;
  std::string text;
  for (size_t i = 0; i < std::min(differences.size(), kShown); ++i) {
    text += fmt::format("{}{} {} -> {}", i == 0 ? "" : ", ", differences[i].name, differences[i].before,
                        differences[i].after);
  }
  if (differences.size() > kShown) text += fmt::format(" and {} more", differences.size() - kShown);
  return text;
}

std::string DescribeDifference(const std::optional<episode_summary_t>& recorded,
                               const episode_summary_t& score) {
  if (!recorded) return "no score was recorded";
  if (SameBits(*recorded, score)) return "equal to the recorded score";
  const std::string text = DifferencesText(Differences(*recorded, score));
  return "DIFFERS: " + (text.empty() ? "in a field that episodes.jsonl does not have" : text);
}

}  // namespace evalbus::results
