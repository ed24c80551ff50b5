// The sim's options that `evalbus run` and `evalbus-sim` share, so that both spell them alike.
#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <string>
#include <vector>

#include "sim/sim_component.h"

namespace evalbus::sim {

// Checks of numbers, in words.
inline std::string Positive(const std::string& text) {
  return std::atof(text.c_str()) > 0 ? "" : "expected a number above 0, not " + text;
}
inline std::string NotNegative(const std::string& text) {
  return std::atof(text.c_str()) >= 0 ? "" : "expected 0 or a number above 0, not " + text;
}

inline void AddSimOptions(CLI::App* app, SimOptions* options) {
  app->add_option("--robot", options->robot,
                  "robot of models/robots or robot description (YAML) instead of the task's own");
  app->add_option("--model-path", options->model_path,
                  "folder to look for MJCF files in, e.g. a MuJoCo Menagerie");
  app->add_option("--control-hz", options->control_hz, "control ticks per simulated second, 20 to 500")
      ->check([](const std::string& text) {
        const double hz = std::atof(text.c_str());
        return hz >= 20 && hz <= 500 ? "" : "expected 20 to 500, not " + text;
      })
      ->capture_default_str();
  app->add_option("--clearance-hz", options->clearance_hz, "clearance checks per simulated second, 0 = none")
      ->check(NotNegative)
      ->capture_default_str();
  CLI::Option* const realtime =
      app->add_flag("--realtime", options->realtime, "pace by the wall clock; default: lockstep");
  app->add_option("--rtf", options->rtf, "simulated seconds per second, with --realtime")
      ->needs(realtime)
      ->check(Positive)
      ->capture_default_str();
  app->add_option("--policy-timeout-s", options->policy_timeout_s,
                  "wait for an action at most this long (lockstep)")
      ->check(Positive)
      ->capture_default_str();
}

// These options as arguments, for a process that is to have the same.
inline std::vector<std::string> SimArguments(const SimOptions& options) {
  std::vector<std::string> arguments = {"--control-hz",       fmt::format("{}", options.control_hz),
                                        "--clearance-hz",     fmt::format("{}", options.clearance_hz),
                                        "--policy-timeout-s", fmt::format("{}", options.policy_timeout_s)};
  if (options.realtime) {
    arguments.insert(arguments.end(), {"--realtime", "--rtf", fmt::format("{}", options.rtf)});
  }
  if (!options.robot.empty()) arguments.insert(arguments.end(), {"--robot", options.robot});
  for (const auto& folder : options.model_path) {
    arguments.insert(arguments.end(), {"--model-path", folder.string()});
  }
  return arguments;
}

}  // namespace evalbus::sim
