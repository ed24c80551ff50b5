// The option `--web` of a run or a replay: starts `evalbus web` as a separate process, which never delays the
// run.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include "runner/processes.h"
#include "viz/web/server.h"

namespace evalbus::runner {

class WebChild {
 public:
  // Opens the port and prints the page's URL. Must be constructed before the process enters the run's
  // network. Throws InputError if this machine has no free port.
  WebChild();
  // Starts the page for the run folder or log `run`. The output of `evalbus web` goes to log_file.
  void Start(const std::filesystem::path& run, const std::filesystem::path& log_file);
  // Returns when the user presses Ctrl-C or the page's process ends.
  void Stay();

 private:
  // Null after Start().
  std::unique_ptr<viz::WebServer> listener_;
  std::string url_;
  Processes processes_;
};

}  // namespace evalbus::runner
