// A component's voice: lines for people about what it noticed. Never part of a result, never recorded.
//
//   2026-11-22 05:31:07.482 [warning] sim  e3 t127  two different actions for tick 127: is a second policy on
//   this bus?
//
// Lines go to stderr, which `evalbus run` directs into RUN/logs/COMPONENT.log, or straight to such a file
// where many components share a process; from info up also on EVALBUS_LOG. A level that is off costs a
// comparison.
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

// "debug", "info", "warn", "error" or "off". Throws InputError for another word.
LogLevel ParseLogLevel(const std::string& word);

class Log {
 public:
  // bus: where lines from info up are published, at most ten a second, then how many more there were; what
  // the bus says to that is not heard. Not null. Throws EnvironmentError if the file cannot be written.
  Log(std::string component, Bus* bus);
  ~Log();
  Log(const Log&) = delete;
  Log& operator=(const Log&) = delete;

  // For all logs of this process that begin after the call: the lowest level that is written; info by
  // default, or the environment's EVALBUS_LOG_LEVEL. The file of each component; stderr by default.
  static void SetLevel(LogLevel level);
  static void SetFiles(std::function<std::filesystem::path(const std::string& component)> file);

  // Publishes how many lines were held back, once it is time.
  void Poll(std::chrono::steady_clock::time_point now);

  // Stands in every line from now on.
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

// "e3 t127", "e3 try 2 t127"; empty before the first episode. As it stands in lines.
std::string PlaceText(const header_t& header);

}  // namespace evalbus
