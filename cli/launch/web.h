// `evalbus web`: the runs of folders, and those that go on, on a page for browsers. Only listens to their
// buses and only reads their folders: nobody waits for it. It is no process of high priority.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "viz/web/server.h"

namespace evalbus::launch {

struct WebOptions {
  // Folders of runs or suites, or a log that is played; empty: the run or replay that goes on on this
  // machine.
  std::vector<std::filesystem::path> runs;
  // A bus instead, of a run whose folder is not known.
  std::string url;
  // Address to listen at, for whoever knows the token. Empty: 127.0.0.1, for this machine, without a token.
  std::string listen;
  // Without one: 8080, or one that is free.
  std::optional<int> port;
  // Started by a run or replay of `runs`, which may not have begun yet; listens on the socket that is its
  // stdin.
  bool is_child = false;
};

inline constexpr char kWebChildOption[] = "--on-stdin";

// Listens at this address (empty: the loopback) and port, as WebOptions has them. Throws InputError.
std::unique_ptr<viz::WebServer> ListenForPages(const std::string& host, std::optional<int> port,
                                               std::shared_ptr<viz::UpdateBroadcaster> broadcaster);

// Serves until SIGINT or SIGTERM; says the page's URL first. Returns the exit code. Throws InputError,
// EnvironmentError.
int Web(const WebOptions& options);

}  // namespace evalbus::launch
