#include "runner/web_child.h"

#include <fmt/format.h>

#include <thread>

#include "base/errors.h"
#include "bus/host.h"
#include "report/web/web.h"

namespace evalbus::runner {

WebChild::WebChild()
    : listener_(report::ListenForPages("", std::nullopt, std::make_shared<viz::UpdateBroadcaster>())) {
  url_ = listener_->url();
  fmt::print("page {}\n", url_);
  std::fflush(stdout);
}

void WebChild::Start(const std::filesystem::path& run, const std::filesystem::path& log_file) {
  processes_.Start("web",
                   {(Processes::BinaryFolder() / "evalbus").string(), "web", report::kWebChildOption,
                    std::filesystem::absolute(run).lexically_normal().string()},
                   log_file, listener_->descriptor());
  listener_.reset();
}

void WebChild::Stay() {
  if (stop_requested()) return;
  fmt::print("\nthe page remains at {}; Ctrl-C ends it\n", url_);
  std::fflush(stdout);
  while (!stop_requested()) {
    if (const auto exit = processes_.Poll()) {
      fmt::print(stderr, "warning: the page's server ended: {}\n", Printable(exit->description));
      return;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
}

}  // namespace evalbus::runner
