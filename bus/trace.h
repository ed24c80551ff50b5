// Records when each message was encoded, sent, received, decoded and handled. From these records,
// pipeline_bench computes where the time of a tick is spent. They are kept in memory and written to a file
// when the bus is destroyed.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

namespace evalbus {

class Trace {
 public:
  enum class Event : int32_t { kEncode, kSend, kSent, kReceived, kDecoded, kHandled };
  struct Record {
    // Time of the steady clock, which all processes of a machine share.
    int64_t time_ns;
    // First letters of the channel's name after "EVALBUS_", padded with NUL.
    char channel[8];
    Event event;
    int32_t episode;
    int32_t tick;
  };

  // Environment variable: folder in which every bus of this process and its children writes PROCESS.trace.
  static constexpr char kVariable[] = "EVALBUS_TRACE";
  // Returns a trace as requested by the environment variable; null if it is not set.
  static std::unique_ptr<Trace> OfEnvironment();
  // Reads all records of a file.
  static std::vector<Record> Read(const std::filesystem::path& file);

  explicit Trace(std::filesystem::path file);
  ~Trace();
  Trace(const Trace&) = delete;
  Trace& operator=(const Trace&) = delete;

  // data: the encoded message, whose header contains the tick; empty before encoding.
  void Add(Event event, std::string_view channel, std::span<const uint8_t> data);

 private:
  std::filesystem::path file_;
  std::vector<Record> records_;
};

}  // namespace evalbus
