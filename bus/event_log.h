// Standard LCM event logs: written so that lcm-logplayer reads them, read so that damage costs
// only the damaged events; packed ones (bus/packed_log.h) are read as what they were packed from. Record
// format (LCM, "log file format"): magic 0xEDA1DA01, event number i64, time i64 [us], channel length u32,
// data length u32, channel, data; all big-endian.
#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace evalbus {

class EventLogWriter {
 public:
  // Creates the file. Throws EnvironmentError, as do the other functions: a log is complete or known not to
  // be.
  explicit EventLogWriter(const std::filesystem::path& file);
  ~EventLogWriter();
  EventLogWriter(const EventLogWriter&) = delete;
  EventLogWriter& operator=(const EventLogWriter&) = delete;

  void Write(std::string_view channel, std::span<const uint8_t> data, int64_t time_us);
  // Writes out and syncs to disk.
  void Close();
  // Instead: leaves FILE.zst, synced, in the place of FILE; of a log that is too long for that, FILE.
  void ClosePacked();
  int64_t num_events() const { return num_events_; }

 private:
  [[noreturn]] void Throw(const char* what);
  void End(bool is_synced);

  std::filesystem::path file_;
  FILE* stream_ = nullptr;
  int64_t num_events_ = 0;
};

struct LogEvent {
  int64_t number = 0;
  int64_t time_us = 0;
  // Views into the reader; valid as long as it lives.
  std::string_view channel;
  std::span<const uint8_t> data;
};

class EventLogReader {
 public:
  // Maps the file, or unpacks it into memory. Throws InputError if it cannot be read.
  explicit EventLogReader(const std::filesystem::path& file);
  ~EventLogReader();
  EventLogReader(const EventLogReader&) = delete;
  EventLogReader& operator=(const EventLogReader&) = delete;

  // The next whole event; false at the end. Bytes that are no event are skipped up to the next one that is.
  bool Next(LogEvent* event);

  // Of all events: the file's, or those that it was packed from.
  std::span<const uint8_t> bytes() const { return bytes_; }
  bool is_packed() const { return !unpacked_.empty(); }

  // What was skipped so far.
  int64_t damaged_bytes() const { return damaged_bytes_; }
  int64_t damaged_places() const { return damaged_places_; }

 private:
  // Size of the event that starts at offset, 0 if none does.
  size_t EventSize(size_t offset);
  // The same by what the event's header says.
  size_t ClaimedSize(size_t offset) const;
  // An event or the end of the log begins here.
  bool IsBoundary(size_t offset) const;
  // Where, from this offset on, an event begins that a boundary follows. Found once, so that reading takes
  // linear time whatever the bytes are.
  size_t NextWhole(size_t offset);

  std::vector<uint8_t> unpacked_;
  std::span<const uint8_t> bytes_;
  size_t offset_ = 0;
  // No event of which NextWhole() speaks begins between these two.
  size_t searched_from_ = 0, whole_at_ = 0;
  int64_t damaged_bytes_ = 0;
  int64_t damaged_places_ = 0;
};

}  // namespace evalbus
