#include "report/web/web_jobs.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/errors.h"
#include "base/run_layout.h"
#include "bus/event_log.h"
#include "bus/message.h"
#include "results/no_return.h"
#include "results/notes.h"
#include "viz/viewer/scene_blocks.h"

namespace evalbus::report {
namespace {

namespace fs = std::filesystem;

constexpr std::chrono::milliseconds kHistoryPause{200};
constexpr int kHistoryTries = 10;

// Returns the messages that an episode's log contains so far. Sets last_tick to the last tick that has a
// STATE.
std::vector<viz::LiveFeed::Message> ReadHistory(const fs::path& log, int64_t* last_tick) {
  std::vector<viz::LiveFeed::Message> messages;
  EventLogReader reader(log);
  for (LogEvent event; reader.Next(&event);) {
    if (event.channel == channels::kModel || event.channel == channels::kStatus ||
        !viz::LiveFeed::Uses(event.channel)) {
      continue;
    }
    header_t header{};
    if (event.channel == channels::kState && DecodeHeader<state_t>(event.data, &header))
      *last_tick = header.tick;
    messages.push_back({std::string(event.channel), {event.data.begin(), event.data.end()}});
  }
  return messages;
}

}  // namespace

void WebJobs::AnswerLater(Answer answer) {
  const std::lock_guard lock(mutex_);
  answers_.push_back(std::move(answer));
}

void WebJobs::Add(std::function<Answer()> work, Answer given_up) {
  const auto give_up = [this, given_up = std::move(given_up)] { AnswerLater(given_up); };
  const bool is_added = threads_.Add(
      [this, work = std::move(work)]() -> ReaderThreads::Report {
        return [this, answer = work()](bool is_late) {
          if (!is_late) AnswerLater(answer);
        };
      },
      give_up);
  if (!is_added) give_up();
}

void WebJobs::DeliverAnswers() {
  threads_.Poll(std::chrono::steady_clock::now());
  std::vector<Answer> answers;
  {
    const std::lock_guard lock(mutex_);
    answers.swap(answers_);
  }
  for (const Answer& answer : answers) answer();
}

void WebJobs::SetRun(int run, const fs::path& folder, const std::string& policy) {
  const std::lock_guard lock(mutex_);
  if (runs_.size() <= static_cast<size_t>(run)) runs_.resize(static_cast<size_t>(run) + 1);
  runs_[static_cast<size_t>(run)] = {folder, policy};
}

void WebJobs::AddBlind(const fs::path& folder, int episode) {
  const std::lock_guard lock(mutex_);
  blind_.emplace_back(folder, episode);
}

void WebJobs::RequestEpisode(int run, int episode, viz::WebServer::Reply reply) {
  const Key key{run, episode};
  const viz::WebAnswer stuck =
      viz::WebAnswer::Text(504, "this episode's log was not read in time: a disk does not respond");
  {
    const std::lock_guard lock(mutex_);
    const auto [asked, is_new] = asked_.try_emplace(key);
    if (!is_new && asked->second.is_stuck) return reply(stuck);
    asked->second.replies.push_back(std::move(reply));
    if (!is_new) return;
  }
  const bool is_added = threads_.Add(
      [this, key]() -> ReaderThreads::Report {
        return [this, key, answer = MakeEpisode(key)](bool) { Reply(key, answer, false); };
      },
      [this, key, stuck] { Reply(key, stuck, true); });
  if (!is_added)
    Reply(key, viz::WebAnswer::Text(503, "too many episodes are being read; retry later"), false);
}

void WebJobs::Reply(const Key& key, const viz::WebAnswer& answer, bool is_stuck) {
  std::vector<viz::WebServer::Reply> replies;
  {
    const std::lock_guard lock(mutex_);
    const auto asked = asked_.find(key);
    if (asked == asked_.end()) return;
    replies.swap(asked->second.replies);
    asked->second.is_stuck = is_stuck;
    if (!is_stuck) asked_.erase(asked);
  }
  for (const auto& reply : replies) reply(answer);
}

viz::WebAnswer WebJobs::MakeEpisode(const Key& key) {
  fs::path folder;
  std::string policy;
  int episode = key.episode;
  bool is_blind = false;
  {
    const std::lock_guard lock(mutex_);
    is_blind = !blind_.empty();
    if (is_blind && key.run == 0 && static_cast<size_t>(key.episode) < blind_.size()) {
      std::tie(folder, episode) = blind_[static_cast<size_t>(key.episode)];
    } else if (static_cast<size_t>(key.run) < runs_.size()) {
      std::tie(folder, policy) = runs_[static_cast<size_t>(key.run)];
    }
  }
  const fs::path log = folder.empty() ? fs::path() : EpisodeLog(folder, episode);
  std::error_code error;
  fs::file_time_type time = fs::last_write_time(log, error);
  if (error) return viz::WebAnswer::Text(404, "no log of this episode");
  // The block contains the point of no return.
  if (const auto points = fs::last_write_time(folder / results::kNoReturnJson, error); !error)
    time = std::max(time, points);
  viz::WebAnswer answer;
  answer.type = "application/octet-stream";
  {
    const std::lock_guard lock(mutex_);
    const auto found = std::ranges::find(kept_, key, &Kept::key);
    if (found != kept_.end() && found->time == time) {
      kept_.splice(kept_.begin(), kept_, found);
      answer.body = found->block;
      return answer;
    }
  }
  try {
    if (is_blind) {
      answer.body =
          std::make_shared<const std::string>(BlindTrack(log, key.episode, &scenes_)->EpisodeBlock());
      Keep({key, time, answer.body});
      return answer;
    }
    // Scores can be read even if the models are missing.
    const auto track = [&](Scenes* scenes) {
      return TrackEpisode(log, {.run = key.run, .policy = policy, .scene = "", .bodies = {}}, scenes);
    };
    std::unique_ptr<viz::EpisodeTrack> made;
    try {
      made = track(&scenes_);
    } catch (const InputError&) {
      made = track(nullptr);
    }
    answer.body = std::make_shared<const std::string>(made->EpisodeBlock());
    Keep({key, time, answer.body});
    return answer;
  } catch (const std::exception& failure) {
    return viz::WebAnswer::Text(500, Printable(failure.what()));
  }
}

void WebJobs::Keep(Kept kept) {
  const std::lock_guard lock(mutex_);
  std::erase_if(kept_, [&](const Kept& other) {
    if (other.key != kept.key) return false;
    kept_bytes_ -= other.block->size();
    return true;
  });
  kept_bytes_ += kept.block->size();
  kept_.push_front(std::move(kept));
  while (kept_bytes_ > kMaxKept && kept_.size() > 1) {
    kept_bytes_ -= kept_.back().block->size();
    kept_.pop_back();
  }
}

std::filesystem::path WebJobs::FolderOf(int run) {
  const std::lock_guard lock(mutex_);
  return static_cast<size_t>(run) < runs_.size() ? runs_[static_cast<size_t>(run)].first : fs::path();
}

void WebJobs::RequestNote(viz::WebNote note, std::function<void(const std::string&)> answer) {
  Add(
      [this, note = std::move(note), answer]() -> Answer {
        const fs::path folder = FolderOf(note.run);
        std::string error;
        try {
          if (folder.empty() || !fs::exists(EpisodeFolder(folder, note.episode))) {
            throw InputError("this episode has no folder");
          }
          results::WriteNote(folder, note.episode, Printable(note.text));
        } catch (const std::exception& failure) {
          error = fmt::format("the note on episode {} was not saved: {}", note.episode,
                              Printable(failure.what()));
        }
        return [answer, error] { answer(error); };
      },
      [answer] {
        answer("the note may not have been saved: a disk does not respond, or the server is busy");
      });
}

void WebJobs::RequestScene(std::shared_ptr<const model_info_t> model, const fs::path& folder,
                           std::function<void(viz::LiveFeed::Scene, const std::string&)> answer) {
  Add(
      [this, model = std::move(model), folder, answer]() -> Answer {
        try {
          const viz::SceneBlocks& made = scenes_.Of(*model, folder);
          const viz::LiveFeed::Scene scene = {made.id(), made.moving_bodies(),
                                              [&made](int64_t seed) { return made.Appearance(seed); }};
          return [answer, scene] { answer(scene, ""); };
        } catch (const std::exception& failure) {
          return [answer, error = Printable(failure.what())] { answer({}, error); };
        }
      },
      [answer] { answer({}, "the models were not read in time"); });
}

void WebJobs::RequestHistory(const fs::path& folder, int episode, int64_t tick,
                             std::function<void(std::vector<viz::LiveFeed::Message>)> answer) {
  Add(
      [this, folder, episode, tick, answer]() -> Answer {
        std::vector<viz::LiveFeed::Message> messages;
        for (int i = 0; i < kHistoryTries; ++i) {
          int64_t last_tick = -1;
          try {
            const fs::path unfinished = UnfinishedEpisodeFolder(folder, episode) / kEventLog;
            messages =
                ReadHistory(fs::exists(unfinished) ? unfinished : EpisodeLog(folder, episode), &last_tick);
          } catch (const InputError&) {
            // The log does not exist yet, or was removed.
          }
          // The recorder may not have written the latest messages yet.
          if (last_tick >= tick || !threads_.Pause(kHistoryPause)) break;
        }
        return [answer, moved = std::move(messages)] { answer(moved); };
      },
      [answer] { answer({}); });
}

}  // namespace evalbus::report
