// Log of a component: lines for people. They are not part of any result and are not recorded.
//
//     2026-11-22 05:31:07.482 [warning] sim  e3 t127  two different actions for tick 127: is a second policy
//     on this bus?
//
// Lines go to stderr, which `evalbus run` redirects into RUN/logs/COMPONENT.log. If several components share
// a process, each writes directly to such a file. Lines of level info and above are also published on
// EVALBUS_LOG. A disabled level costs one comparison.
#pragma once

#include <fmt/core.h>

#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "evalbus/header_t.hpp"

namespace evalbus {

class Bus;

enum class LogLevel { kDebug, kInfo, kWarn, kError, kOff };

// Parses "debug", "info", "warn", "error" or "off". Throws InputError for any other word.
LogLevel ParseLogLevel(const std::string& word);

class Log {
 public:
  // bus: not null. Lines of level info and above are published there, at most ten per second, followed by the
  // number of suppressed lines. Publish errors are ignored. Throws EnvironmentError if the file cannot be
  // written, and InputError if EVALBUS_LOG_LEVEL is used and invalid.
  Log(std::string component, Bus* bus);
  ~Log();
  Log(const Log&) = delete;
  Log& operator=(const Log&) = delete;

  // Change the settings of all logs that this process constructs after the call. SetLevel() sets the lowest
  // level that is written; the default is EVALBUS_LOG_LEVEL of the environment or, if it is not set, info.
  // SetFiles() sets the log file of each component; the default is stderr.
  static void SetLevel(LogLevel level);
  static void SetFiles(std::function<std::filesystem::path(const std::string& component)> file);

  // Publishes the number of suppressed lines when the time window has ended.
  void Poll(std::chrono::steady_clock::time_point now);

  // Sets the episode, attempt and tick that every later line shows.
  void SetPlace(const header_t& header) { place_ = header; }

  template <class... Args>
  void Debug(fmt::format_string<Args...> format, Args&&... args) {
    Line(LogLevel::kDebug, format, std::forward<Args>(args)...);
  }
  template <class... Args>
  void Info(fmt::format_string<Args...> format, Args&&... args) {
    Line(LogLevel::kInfo, format, std::forward<Args>(args)...);
  }
  template <class... Args>
  void Warn(fmt::format_string<Args...> format, Args&&... args) {
    Line(LogLevel::kWarn, format, std::forward<Args>(args)...);
  }
  template <class... Args>
  void Error(fmt::format_string<Args...> format, Args&&... args) {
    Line(LogLevel::kError, format, std::forward<Args>(args)...);
  }

 private:
  struct Sinks;

  template <class... Args>
  void Line(LogLevel level, fmt::format_string<Args...> format, Args&&... args) {
    if (level >= level_) Write(level, fmt::format(format, std::forward<Args>(args)...));
  }
  void Write(LogLevel level, const std::string& text);

  LogLevel level_;
  header_t place_;
  std::unique_ptr<Sinks> sinks_;
};

// Returns the place as shown in log lines, such as "e3 t127" or "e3 attempt 2 t127"; empty before the first
// episode.
std::string PlaceText(const header_t& header);

}  // namespace evalbus
