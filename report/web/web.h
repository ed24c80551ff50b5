// Implements `evalbus web`: a web page that shows active runs and the runs in folders. Apart from writing
// users' notes, it only reads folders and receives bus messages, so runs never wait for it. It lowers its own
// priority.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "viz/web/server.h"

namespace evalbus::report {

class WebJobs;

struct WebOptions {
  // Folders of runs, suites or plans, or a log that is being played; empty: the active run or replay on this
  // machine.
  std::vector<std::filesystem::path> runs;
  // Episode of the one run in `runs` that the page opens first, one second before its decisive moment.
  std::optional<int> episode;
  // Bus of a run without a known folder, instead of `runs`.
  std::string url;
  // Address to listen on; clients need the token. Empty: 127.0.0.1, without a token.
  std::string listen;
  // Port of the page; nullopt: 8080, or a free port if 8080 is in use.
  std::optional<int> port;
  // True if a run or replay of `runs` started this process. That run may not have begun yet. The listening
  // socket is passed as stdin.
  bool is_child = false;
};

inline constexpr char kWebChildOption[] = "--on-stdin";

// Listens on this address (empty: loopback) and port, as in WebOptions. Throws InputError.
std::unique_ptr<viz::WebServer> ListenForPages(const std::string& host, std::optional<int> port,
                                               std::shared_ptr<viz::UpdateBroadcaster> broadcaster);

// Answers a page's request for its files, blocks of scenes or finished episodes.
void AnswerPage(const viz::WebTarget& target, WebJobs* jobs, viz::WebServer::Reply reply);

// Prints the page's URL and serves until SIGINT or SIGTERM. Returns the exit code. Throws InputError,
// EnvironmentError.
int Web(const WebOptions& options);

}  // namespace evalbus::report
