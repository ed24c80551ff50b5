// When each message was encoded, sent, received, decoded and handled: for pipeline_bench, which adds up where
// a tick's time goes. Kept in memory, written when the bus goes.
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
    // Of the steady clock, which all processes of a machine share.
    int64_t time_ns;
    // The first letters of its name behind EVALBUS_; NUL where it is shorter.
    char channel[8];
    Event event;
    int32_t episode;
    int32_t tick;
  };

  // A folder into which every bus of this process and its children writes PROCESS.trace.
  static constexpr char kVariable[] = "EVALBUS_TRACE";
  // Null where the environment names none.
  static std::unique_ptr<Trace> OfEnvironment();
  // All that was written.
  static std::vector<Record> Read(const std::filesystem::path& file);

  explicit Trace(std::filesystem::path file);
  ~Trace();
  Trace(const Trace&) = delete;
  Trace& operator=(const Trace&) = delete;

  // data: the message, of which the header says the tick; empty before it is encoded.
  void Add(Event event, std::string_view channel, std::span<const uint8_t> data);

 private:
  std::filesystem::path file_;
  std::vector<Record> records_;
};

}  // namespace evalbus
