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

void WebChild::Start(const std::filesystem::path& run, const std::filesystem::path& log_file,
                     const std::string& judged_by) {
  std::vector<std::string> command = {(Processes::BinaryFolder() / "evalbus").string()};
  if (judged_by.empty()) {
    command.push_back("web");
  } else {
    command.insert(command.end(), {"judge", "--operator=" + judged_by});
  }
  command.insert(command.end(),
                 {report::kWebChildOption, std::filesystem::absolute(run).lexically_normal().string()});
  processes_.Start("web", command, log_file, listener_->descriptor());
  listener_.reset();
}

void WebChild::Stay() {
  if (stop_requested()) return;
  fmt::print("\nthe page remains at {}; Ctrl-C ends it\n", url_);
  std::fflush(stdout);
  StayUntil([] { return false; });
}

void WebChild::StayUntil(const std::function<bool()>& is_done) {
  constexpr std::chrono::milliseconds kPoll{50};
  constexpr int kPollsPerCheck = 10;
  for (int polls = 0; !stop_requested(); ++polls) {
    if (polls % kPollsPerCheck == 0 && is_done()) return;
    if (const auto exit = processes_.Poll()) {
      fmt::print(stderr, "warning: the page's server ended: {}\n", Printable(exit->description));
      return;
    }
    std::this_thread::sleep_for(kPoll);
  }
}

}  // namespace evalbus::runner
