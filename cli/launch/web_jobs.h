// Work of the web server that reads files, on threads of its own: neither viewers of what goes on nor
// requests for other files wait for it.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <list>
#include <map>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "cli/launch/reader_threads.h"
#include "cli/results/episode_tracks.h"
#include "viz/web/live_feed.h"
#include "viz/web/server.h"

namespace evalbus::launch {

class WebJobs {
 public:
  // Bytes of finished episodes that are kept.
  static constexpr size_t kMaxKept = size_t{64} << 20;

  // False if some are still reading after `timeout`; then this object must stay.
  bool Stop(std::chrono::milliseconds timeout) { return threads_.Stop(timeout); }

  // Where the episodes of a run of the page are. Of a run without a folder there are none.
  void SetRun(int run, const std::filesystem::path& folder, const std::string& policy);
  // The block of an episode that is over, from its log; made once for all who ask meanwhile.
  void AskEpisode(int run, int episode, viz::WebServer::Reply reply);
  // A block of a scene by its id; null: unknown.
  viz::SharedBytes Block(const std::string& id) const { return scenes_.FindBlock(id); }

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
  // Work whose answer is called on the thread that calls TakeAnswers(); `given_up`: the answer where it takes
  // too long.
  using Answer = std::function<void()>;
  void Add(std::function<Answer()> work, Answer given_up);
  void AnswerLater(Answer answer);
  viz::WebAnswer MakeEpisode(const Key& key);
  // is_stuck: the episode is still being read.
  void Reply(const Key& key, const viz::WebAnswer& answer, bool is_stuck);
  void Keep(Kept kept);

  std::mutex mutex_;
  std::vector<Answer> answers_;
  std::vector<std::pair<std::filesystem::path, std::string>> runs_;
  // Episodes that are being read, and for whom.
  struct Asked {
    std::vector<viz::WebServer::Reply> replies;
    bool is_stuck = false;
  };
  std::map<Key, Asked> asked_;
  // The one used last in front.
  std::list<Kept> kept_;
  size_t kept_bytes_ = 0;
  results::Scenes scenes_;

  // Last: its work uses all of the above.
  ReaderThreads threads_{ReaderThreads::Limits{}};
};

}  // namespace evalbus::launch
