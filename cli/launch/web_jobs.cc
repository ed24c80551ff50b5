#include "cli/launch/web_jobs.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "base/errors.h"
#include "base/run_layout.h"
#include "bus/event_log.h"
#include "bus/message.h"
#include "viz/viewer/scene_blocks.h"

namespace evalbus::launch {
namespace {

namespace fs = std::filesystem;

constexpr auto kHistoryPause = std::chrono::milliseconds(200);
constexpr int kHistoryTries = 10;

// The messages of an episode in its log so far, and the last tick of STATE.
std::vector<viz::LiveFeed::Message> ReadHistory(const fs::path& log, int64_t* last_tick) {
  std::vector<viz::LiveFeed::Message> messages;
  EventLogReader reader(log);
  for (LogEvent event; reader.Next(&event);) {
    if (event.channel == channels::kModel || event.channel == channels::kStatus ||
        !viz::LiveFeed::Wants(event.channel)) {
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

WebJobs::~WebJobs() {
  {
    const std::lock_guard lock(mutex_);
    stops_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void WebJobs::Start() {
  thread_ = std::thread([this] { Work(); });
}

void WebJobs::Work() {
  std::unique_lock lock(mutex_);
  while (!stops_) {
    if (jobs_.empty()) {
      changed_.wait(lock);
      continue;
    }
    const std::function<void()> job = std::move(jobs_.front());
    jobs_.pop_front();
    lock.unlock();
    job();
    lock.lock();
  }
}

void WebJobs::Add(std::function<void()> job) {
  {
    const std::lock_guard lock(mutex_);
    jobs_.push_back(std::move(job));
  }
  changed_.notify_all();
}

void WebJobs::Answer(std::function<void()> answer) {
  const std::lock_guard lock(mutex_);
  answers_.push_back(std::move(answer));
}

void WebJobs::TakeAnswers() {
  std::vector<std::function<void()>> answers;
  {
    const std::lock_guard lock(mutex_);
    answers.swap(answers_);
  }
  for (const auto& answer : answers) answer();
}

void WebJobs::SetRun(int run, const fs::path& folder, const std::string& policy) {
  const std::lock_guard lock(mutex_);
  if (runs_.size() <= static_cast<size_t>(run)) runs_.resize(static_cast<size_t>(run) + 1);
  runs_[static_cast<size_t>(run)] = {folder, policy};
}

viz::SharedBytes WebJobs::Block(const std::string& id) {
  const std::lock_guard lock(mutex_);
  const auto found = blocks_.find(id);
  return found == blocks_.end() ? nullptr : found->second;
}

void WebJobs::PublishBlocks() {
  const std::lock_guard lock(mutex_);
  for (const auto& [id, block] : scenes_.blocks()) {
    viz::SharedBytes& shared = blocks_[id];
    if (!shared) shared = std::make_shared<const std::string>(block);
  }
}

void WebJobs::AskEpisode(int run, int episode, viz::WebServer::Reply reply) {
  const Key key{run, episode};
  {
    const std::lock_guard lock(mutex_);
    const auto asked = asked_.find(key);
    if (asked != asked_.end()) {
      asked->second.push_back(std::move(reply));
      return;
    }
    if (asked_.size() < kMaxWaiting) {
      asked_[key].push_back(std::move(reply));
      jobs_.push_back([this, key] {
        const viz::WebAnswer answer = MakeEpisode(key);
        std::vector<viz::WebServer::Reply> replies;
        {
          const std::lock_guard inner(mutex_);
          replies = std::move(asked_[key]);
          asked_.erase(key);
        }
        for (const auto& tell : replies) tell(answer);
      });
      changed_.notify_all();
      return;
    }
  }
  reply(viz::WebAnswer::Text(503, "too many episodes are being read; again, please"));
}

viz::WebAnswer WebJobs::MakeEpisode(const Key& key) {
  fs::path folder;
  std::string policy;
  {
    const std::lock_guard lock(mutex_);
    if (static_cast<size_t>(key.run) < runs_.size()) {
      std::tie(folder, policy) = runs_[static_cast<size_t>(key.run)];
    }
  }
  const fs::path log = folder.empty() ? fs::path() : EpisodeLog(folder, key.episode);
  std::error_code error;
  const auto time = fs::last_write_time(log, error);
  if (error) return viz::WebAnswer::Text(404, "no log of such an episode");
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
    // A log whose models are gone still has its numbers.
    const auto track = [&](results::Scenes* scenes) {
      return results::TrackEpisode(log, {.run = key.run, .policy = policy, .scene = "", .bodies = {}},
                                   scenes);
    };
    std::unique_ptr<viz::EpisodeTrack> made;
    try {
      made = track(&scenes_);
    } catch (const InputError&) {
      made = track(nullptr);
    }
    PublishBlocks();
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

void WebJobs::AskScene(std::shared_ptr<const model_info_t> model, const fs::path& folder,
                       std::function<void(viz::LiveFeed::Scene, const std::string&)> answer) {
  Add([this, model = std::move(model), folder, answer = std::move(answer)] {
    viz::LiveFeed::Scene scene;
    std::string error;
    try {
      const viz::SceneBlocks& made = scenes_.Of(*model, folder);
      PublishBlocks();
      scene = {made.id(), made.moving_bodies(), [&made](int64_t seed) { return made.Appearance(seed); }};
    } catch (const std::exception& failure) {
      error = Printable(failure.what());
    }
    Answer([answer, scene, error] { answer(scene, error); });
  });
}

void WebJobs::AskHistory(const fs::path& folder, int episode, int64_t tick,
                         std::function<void(std::vector<viz::LiveFeed::Message>)> answer) {
  Add([this, folder, episode, tick, answer = std::move(answer)] {
    std::vector<viz::LiveFeed::Message> messages;
    for (int i = 0; i < kHistoryTries; ++i) {
      int64_t last_tick = -1;
      try {
        const fs::path unfinished = UnfinishedEpisodeFolder(folder, episode) / kEventLog;
        messages = ReadHistory(fs::exists(unfinished) ? unfinished : EpisodeLog(folder, episode), &last_tick);
      } catch (const InputError&) {
        // Not there (any more).
      }
      if (last_tick >= tick) break;
      // The recorder has some that it has not written yet.
      std::unique_lock lock(mutex_);
      if (changed_.wait_for(lock, kHistoryPause, [this] { return stops_; })) return;
    }
    Answer([answer, moved = std::move(messages)] { answer(moved); });
  });
}

}  // namespace evalbus::launch
