#include "cli/commands/video_timing_options.h"

#include <fmt/format.h>

#include <string>

namespace evalbus::commands {

void AddVideoTiming(CLI::App* app, viz::VideoTiming* timing) {
  app->add_option(
      "--highlight", timing->highlight_s,
      fmt::format("seconds around the decisive moment (docs/failures.md) that are shown at --speed; the rest "
                  "is {} times faster",
                  viz::kFastForward));
  app->add_option("--speed", timing->speed, "simulated seconds per second of video")->capture_default_str();
  app->add_option_function<std::string>(
      "--trim", [timing](const std::string& text) { viz::ParseTrim(text, timing); },
      "FROM..TO, the part of the episode in seconds; without FROM from its start, without TO to its end");
}

}  // namespace evalbus::commands
