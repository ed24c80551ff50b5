// Reads files for the web server on separate threads, so that reads delay neither live viewers nor requests
// for other files.
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

#include "report/episode_tracks.h"
#include "report/web/reader_threads.h"
#include "viz/web/live_feed.h"
#include "viz/web/server.h"

namespace evalbus::report {

class WebJobs {
 public:
  // Maximum total size of cached episodes, in bytes. The newest one is kept even if it is larger.
  static constexpr size_t kMaxKept = size_t{64} << 20;

  // Returns false if jobs are still reading after `timeout`; this object must then not be destroyed.
  bool Stop(std::chrono::milliseconds timeout) { return threads_.Stop(timeout); }

  // Sets the folder of a run of the page. A run without a folder has no recorded episodes.
  void SetRun(int run, const std::filesystem::path& folder, const std::string& policy);
  // Adds an episode to run 0, which is served blind (BlindTrack): /episode/0/K is the K-th episode that was
  // added. Must not be combined with SetRun().
  void AddBlind(const std::filesystem::path& folder, int episode);
  // Reads the block of a finished episode from its log. Concurrent requests for an episode share one read.
  void RequestEpisode(int run, int episode, viz::WebServer::Reply reply);
  // Writes a user's note into the run's folder. Afterwards calls `answer` on the thread that calls
  // DeliverAnswers(); `error` is empty on success. May be called on any thread.
  void RequestNote(viz::WebNote note, std::function<void(const std::string& error)> answer);
  // Returns a block of a scene; null if the id is unknown.
  viz::SharedBytes Block(const std::string& id) const { return scenes_.FindBlock(id); }

  // The answers below are delivered on the thread that calls DeliverAnswers(). RequestScene() builds the
  // scene of a MODEL; `error` is empty on success.
  void RequestScene(std::shared_ptr<const model_info_t> model, const std::filesystem::path& folder,
                    std::function<void(viz::LiveFeed::Scene, const std::string& error)> answer);
  // Reads the log of a current or just finished episode. Retries for a limited time until the log contains
  // the STATE of `tick`.
  void RequestHistory(const std::filesystem::path& folder, int episode, int64_t tick,
                      std::function<void(std::vector<viz::LiveFeed::Message>)> answer);
  void DeliverAnswers();

 private:
  struct Key {
    int run, episode;
    auto operator<=>(const Key&) const = default;
  };
  struct Kept {
    Key key;
    // Modification time of the newest file from which the block was made: the log or no_return.json.
    std::filesystem::file_time_type time;
    viz::SharedBytes block;
  };
  // Runs `work` on a thread. The answer that it returns is called on the thread that calls
  // DeliverAnswers(); `given_up` is called instead if the work takes too long.
  using Answer = std::function<void()>;
  void Add(std::function<Answer()> work, Answer given_up);
  void AnswerLater(Answer answer);
  viz::WebAnswer MakeEpisode(const Key& key);
  // is_stuck: the episode is still being read.
  void Reply(const Key& key, const viz::WebAnswer& answer, bool is_stuck);
  void Keep(Kept kept);
  std::filesystem::path FolderOf(int run);

  std::mutex mutex_;
  std::vector<Answer> answers_;
  std::vector<std::pair<std::filesystem::path, std::string>> runs_;
  // Run folder and number of each episode that is served blind.
  std::vector<std::pair<std::filesystem::path, int>> blind_;
  // Episodes that are being read, and the requests that wait for them.
  struct Asked {
    std::vector<viz::WebServer::Reply> replies;
    bool is_stuck = false;
  };
  std::map<Key, Asked> asked_;
  // Cached episodes, the most recently used first.
  std::list<Kept> kept_;
  size_t kept_bytes_ = 0;
  Scenes scenes_;

  // Declared last, because its jobs use all other members.
  ReaderThreads threads_{ReaderThreads::Limits{}};
};

}  // namespace evalbus::report
