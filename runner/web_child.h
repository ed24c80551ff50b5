// Implements the option `--web` of a run or a replay. Starts `evalbus web` as a separate process, which never
// delays the run.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "runner/processes.h"
#include "viz/web/server.h"

namespace evalbus::runner {

class WebChild {
 public:
  // Opens the port and prints the page's URL. Must be constructed before the process enters the run's
  // network. Throws InputError if this machine has no free port.
  WebChild();
  // Starts the page for the run folder or log `run`: `evalbus web` or, for an operator, `evalbus judge`. Its
  // output goes to log_file.
  void Start(const std::filesystem::path& run, const std::filesystem::path& log_file,
             const std::string& judged_by = "");
  // Returns when the user presses Ctrl-C or the page's process ends.
  void Stay();
  // Calls is_done() twice per second, and also returns when it is true.
  void StayUntil(const std::function<bool()>& is_done);

 private:
  // Listening socket; null after Start().
  std::unique_ptr<viz::WebServer> listener_;
  std::string url_;
  Processes processes_;
};

}  // namespace evalbus::runner
