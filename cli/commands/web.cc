// evalbus web: runs in a browser, while they go on or afterwards.
#include "report/web/web.h"

#include <memory>

#include "cli/commands/commands.h"

namespace evalbus::commands {

Action AddWeb(CLI::App* app) {
  const auto options = std::make_shared<report::WebOptions>();
  app->add_option("run", options->runs,
                  "folders of runs or suites, finished or not, or what is replayed; default: the bus of\n"
                  "EVALBUS_URL, or the one run or replay on this machine");
  app->add_option("--url", options->url, "bus to listen to, udpm://ADDRESS:PORT?ttl=0");
  app->add_option("--port", options->port, "0: any that is free; default: 8080 if it is");
  app->add_option(
      "--listen", options->listen,
      "address to listen at, 0.0.0.0 for all; the page's URL then has a token, and whoever knows it\n"
      "can look. Default: 127.0.0.1, where every user of this machine can look");
  app->add_flag(report::kWebChildOption, options->is_child)->group("");
  return [options] { return report::Web(*options); };
}

}  // namespace evalbus::commands
