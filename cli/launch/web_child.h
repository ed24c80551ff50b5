// `--web` of a run or a replay: `evalbus web` beside it, as a process of its own that nobody waits for.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include "cli/launch/processes.h"
#include "viz/web/server.h"

namespace evalbus::launch {

class WebChild {
 public:
  // Listens, so that the page's address is known, and says it; before the network of the run is entered.
  // Throws InputError where this machine has no port left.
  WebChild();
  // Starts it, on what is written into this folder or, a log, played of it. It says what it has to say into
  // log_file.
  void Start(const std::filesystem::path& run, const std::filesystem::path& log_file);
  // The page stays until the user has seen enough (Ctrl-C), or it ends by itself.
  void Stay();

 private:
  // Until it is started.
  std::unique_ptr<viz::WebServer> listener_;
  std::string url_;
  Processes processes_;
};

}  // namespace evalbus::launch
