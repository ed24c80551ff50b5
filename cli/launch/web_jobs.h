// Work of the web server that takes a while, one piece after the other in a thread of its own: viewers of
// what goes on do not wait for it.
#pragma once

#include <condition_variable>
#include <deque>
#include <filesystem>
#include <functional>
#include <list>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "cli/results/episode_tracks.h"
#include "viz/web/live_feed.h"
#include "viz/web/server.h"

namespace evalbus::launch {

class WebJobs {
 public:
  // Episodes asked for that wait at the same time, and finished ones that are kept, bytes.
  static constexpr size_t kMaxWaiting = 32, kMaxKept = size_t{64} << 20;

  WebJobs() = default;
  ~WebJobs();
  WebJobs(const WebJobs&) = delete;
  WebJobs& operator=(const WebJobs&) = delete;

  void Start();

  // Where the episodes of a run of the page are. Of a run without a folder there are none.
  void SetRun(int run, const std::filesystem::path& folder, const std::string& policy);
  // The block of an episode that is over, from its log; made once for all who ask meanwhile.
  void AskEpisode(int run, int episode, viz::WebServer::Reply reply);
  // A block of a scene by its id; null: unknown.
  viz::SharedBytes Block(const std::string& id);

  // These are answered on the thread that calls TakeAnswers(). The scene of a MODEL; its error where there is
  // none.
  void AskScene(std::shared_ptr<const model_info_t> model, const std::filesystem::path& folder,
                std::function<void(viz::LiveFeed::Scene, const std::string& error)> answer);
  // What the log of an episode under way, or just over, has so far, at the latest when its last STATE is of
  // `tick` or later.
  void AskHistory(const std::filesystem::path& folder, int episode, int64_t tick,
                  std::function<void(std::vector<viz::LiveFeed::Message>)> answer);
  void TakeAnswers();

 private:
  struct Key {
    int run, episode;
    auto operator<=>(const Key&) const = default;
  };
  struct Kept {
    Key key;
    // Of the log that it was made of.
    std::filesystem::file_time_type time;
    viz::SharedBytes block;
  };
  void Add(std::function<void()> job);
  void Answer(std::function<void()> answer);
  void Work();
  viz::WebAnswer MakeEpisode(const Key& key);
  void Keep(Kept kept);
  void PublishBlocks();

  std::mutex mutex_;
  std::condition_variable changed_;
  bool stops_ = false;
  std::deque<std::function<void()>> jobs_;
  std::vector<std::function<void()>> answers_;
  std::vector<std::pair<std::filesystem::path, std::string>> runs_;
  std::map<Key, std::vector<viz::WebServer::Reply>> asked_;
  // The one used last in front.
  std::list<Kept> kept_;
  size_t kept_bytes_ = 0;
  std::map<std::string, viz::SharedBytes> blocks_;
  // Of the thread alone.
  results::Scenes scenes_;

  std::thread thread_;
};

}  // namespace evalbus::launch
