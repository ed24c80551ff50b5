#include "bus/log.h"

#include <fmt/format.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/sinks/basic_file_sink.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <optional>

#include "base/errors.h"
#include "base/text.h"
#include "bus/bus.h"

namespace evalbus {
namespace {

using std::chrono::steady_clock;

constexpr int kLinesPerWindow = 10;
constexpr auto kWindow = std::chrono::seconds(1);

constexpr std::array<const char*, 5> kLevels = {"debug", "info", "warn", "error", "off"};

spdlog::level::level_enum Of(LogLevel level) {
  constexpr std::array kOf = {spdlog::level::debug, spdlog::level::info, spdlog::level::warn,
                              spdlog::level::err, spdlog::level::off};
  return kOf[static_cast<size_t>(level)];
}

int8_t WireLevel(spdlog::level::level_enum level) {
  if (level >= spdlog::level::err) return log_t::ERROR_LEVEL;
  if (level >= spdlog::level::warn) return log_t::WARN_LEVEL;
  return level >= spdlog::level::info ? log_t::INFO_LEVEL : log_t::DEBUG_LEVEL;
}

// Log settings of this process.
struct Settings {
  std::optional<LogLevel> level;
  std::function<std::filesystem::path(const std::string&)> file;
};
Settings& ProcessSettings() {
  static Settings settings;
  return settings;
}

LogLevel CurrentLevel() {
  if (ProcessSettings().level) return *ProcessSettings().level;
  const char* word = std::getenv("EVALBUS_LOG_LEVEL");
  return word == nullptr || *word == '\0' ? LogLevel::kInfo : ParseLogLevel(word);
}

// The flag %* in a log pattern prints the episode, attempt and tick of the component.
class PlaceFlag : public spdlog::custom_flag_formatter {
 public:
  explicit PlaceFlag(const header_t* place) : place_(place) {}
  void format(const spdlog::details::log_msg&, const std::tm&, spdlog::memory_buf_t& out) override {
    const std::string text = PlaceText(*place_);
    if (!text.empty()) fmt::format_to(std::back_inserter(out), "  {}", text);
  }
  std::unique_ptr<custom_flag_formatter> clone() const override {
    return std::make_unique<PlaceFlag>(place_);
  }

 private:
  const header_t* place_;
};

// Publishes a limited number of lines per time window, then the number of suppressed ones.
class BusSink : public spdlog::sinks::base_sink<spdlog::details::null_mutex> {
 public:
  BusSink(Bus* bus, std::string component, const header_t* place) : bus_(bus), place_(place) {
    message_.component = std::move(component);
  }

  // Publishes the number of suppressed lines once the window has ended.
  void Poll(steady_clock::time_point now) {
    if (held_back_ == 0 || now - window_began_ < kWindow) return;
    PublishLine(held_back_level_, Plural(held_back_, "more line") + " suppressed");
    held_back_ = 0;
  }

 private:
  void sink_it_(const spdlog::details::log_msg& line) override {
    const auto now = steady_clock::now();
    Poll(now);
    if (now - window_began_ >= kWindow) {
      window_began_ = now;
      num_published_ = 0;
    }
    if (++num_published_ > kLinesPerWindow) {
      ++held_back_;
      held_back_level_ = WireLevel(line.level);
      return;
    }
    PublishLine(WireLevel(line.level), std::string(line.payload.data(), line.payload.size()));
  }
  void flush_() override {}

  void PublishLine(int8_t level, std::string text) {
    message_.header = *place_;
    message_.level = level;
    message_.text = std::move(text);
    try {
      bus_->Publish(channels::kLog, message_);
    } catch (const EnvironmentError&) {
      // The bus itself failed, so a log line about the failure could not be published either. Components that
      // need the bus report the failure.
    }
  }

  Bus* bus_;
  const header_t* place_;
  log_t message_{};
  steady_clock::time_point window_began_{};
  int num_published_ = 0;
  int held_back_ = 0;
  int8_t held_back_level_ = log_t::INFO_LEVEL;
};

spdlog::sink_ptr FileSink(const std::string& component) {
  if (!ProcessSettings().file) return std::make_shared<spdlog::sinks::stderr_sink_st>();
  const std::filesystem::path file = ProcessSettings().file(component);
  try {
    return std::make_shared<spdlog::sinks::basic_file_sink_st>(file.string());
  } catch (const spdlog::spdlog_ex&) {
    throw EnvironmentError("cannot write " + file.string() + ": " + std::strerror(errno));
  }
}

}  // namespace

struct Log::Sinks {
  std::shared_ptr<BusSink> bus;
  spdlog::logger logger;
};

LogLevel ParseLogLevel(const std::string& word) {
  for (size_t i = 0; i < kLevels.size(); ++i) {
    if (word == kLevels[i]) return static_cast<LogLevel>(i);
  }
  throw InputError("log level '" + word + "': expected debug, info, warn, error or off");
}

Log::Log(std::string component, Bus* bus) : level_(CurrentLevel()) {
  place_.episode = place_.attempt = -1;
  place_.tick = -1;
  place_.sim_time_us = 0;
  const auto to_file = FileSink(component);
  auto formatter = std::make_unique<spdlog::pattern_formatter>();
  formatter->add_flag<PlaceFlag>('*', &place_).set_pattern("%Y-%m-%d %H:%M:%S.%e [%l] %n%*  %v");
  to_file->set_formatter(std::move(formatter));
  const auto to_bus = std::make_shared<BusSink>(bus, component, &place_);
  to_bus->set_level(spdlog::level::info);
  sinks_ = std::make_unique<Sinks>(Sinks{to_bus, spdlog::logger(std::move(component), {to_file, to_bus})});
  sinks_->logger.set_level(Of(level_));
  sinks_->logger.flush_on(spdlog::level::trace);
  // Errors are ignored: if the disk is full, log lines are lost. Components that must write files report the
  // error themselves.
  sinks_->logger.set_error_handler([](const std::string&) {});
}

Log::~Log() = default;

void Log::SetLevel(LogLevel level) { ProcessSettings().level = level; }

void Log::SetFiles(std::function<std::filesystem::path(const std::string&)> file) {
  ProcessSettings().file = std::move(file);
}

void Log::Write(LogLevel level, const std::string& text) {
  sinks_->logger.log(Of(level), "{}", Printable(text));
}

void Log::Poll(steady_clock::time_point now) { sinks_->bus->Poll(now); }

std::string PlaceText(const header_t& header) {
  if (header.episode < 0) return "";
  std::string text = fmt::format("e{}", header.episode);
  if (header.attempt > 0) text += fmt::format(" attempt {}", int64_t{header.attempt} + 1);
  if (header.tick >= 0) text += fmt::format(" t{}", header.tick);
  return text;
}

}  // namespace evalbus
