// Implements `evalbus web`, which shows active and finished runs in a browser.
#include "report/web/web.h"

#include <memory>

#include "cli/commands/commands.h"

namespace evalbus::commands {

Action AddWeb(CLI::App* app) {
  const auto options = std::make_shared<report::WebOptions>();
  app->add_option(
      "run", options->runs,
      "folders of runs, suites or plans, active or finished, or a log that is being replayed; default: the\n"
      "bus of EVALBUS_URL, or the one run or replay on this machine");
  app->add_option("--episode", options->episode,
                  "number of the episode that the page opens first, one second before its decisive moment;\n"
                  "requires exactly one run folder");
  app->add_option("--url", options->url, "bus to listen to, udpm://ADDRESS:PORT?ttl=0");
  app->add_option("--port", options->port,
                  "port to listen on; 0: any free port; default: 8080, or any free port if it is in use");
  app->add_option("--listen", options->listen,
                  "address to listen on, 0.0.0.0 for all; a client then needs the token in the page's "
                  "URL;\ndefault: 127.0.0.1 without a token, where every user of this machine can watch");
  app->add_flag(report::kWebChildOption, options->is_child)->group("");
  return [options] { return report::Web(*options); };
}

}  // namespace evalbus::commands
