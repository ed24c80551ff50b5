// Reads and writes standard LCM event logs. lcm-logplayer can read the written logs. The reader skips only
// damaged events. It also reads packed logs (bus/packed_log.h) and returns their unpacked events.
//
// Record format (LCM, "log file format"): magic 0xEDA1DA01, event number i64, time i64 [us], channel length
// u32, data length u32, channel, data; all big-endian.
#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/input_file.h"

namespace evalbus {

class EventLogWriter {
 public:
  // Creates the file, which must not exist. All functions throw EnvironmentError on failure (ClosePacked()
  // the errors of PackLog()), so that an incomplete log is never taken for a complete one.
  explicit EventLogWriter(const std::filesystem::path& file);
  ~EventLogWriter();
  EventLogWriter(const EventLogWriter&) = delete;
  EventLogWriter& operator=(const EventLogWriter&) = delete;

  void Write(std::string_view channel, std::span<const uint8_t> data, int64_t time_us);
  // Flushes and syncs to disk.
  void Close();
  // Alternative to Close(): replaces FILE by the packed log FILE.zst and syncs it. A log that is too long to
  // be packed remains as FILE.
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
  // Views into the reader. They are valid until it reads the next event.
  std::string_view channel;
  std::span<const uint8_t> data;
};

// Reads a log in windows, so that logs of any length take little memory. Packed logs are unpacked into
// memory. The file is not mapped: truncating a mapped file would crash the process that reads it.
class EventLogReader {
 public:
  // Throws the errors of InputFile, and InputError if the file is a damaged packed log.
  explicit EventLogReader(const std::filesystem::path& file);

  // Reads the next undamaged event and skips damaged bytes. Returns false at the position that was the end of
  // the file when it was opened. Throws InputError if the file has been truncated since.
  bool Next(LogEvent* event);

  // Returns the total size of the unpacked log in bytes.
  uint64_t size() const { return size_; }
  bool is_packed() const { return is_packed_; }
  // Returns the unpacked contents of a packed log.
  std::span<const uint8_t> unpacked() const { return window_; }

  // Return the number of bytes, and of contiguous regions, skipped so far.
  int64_t damaged_bytes() const { return damaged_bytes_; }
  int64_t damaged_places() const { return damaged_places_; }

 private:
  // Returns `size` bytes of the log, which must exist. Valid until the next call.
  const uint8_t* At(uint64_t offset, size_t size);
  bool IsInWindow(uint64_t offset, size_t size) const {
    return offset >= window_begin_ && offset + size <= window_begin_ + window_.size();
  }
  // Fills `to` from the file.
  void Read(uint64_t offset, std::span<uint8_t> to);
  // Returns the first offset, not before `offset`, at which an event may begin, because the first byte of the
  // magic is there; the end if there is none.
  uint64_t FindStart(uint64_t offset);
  // Returns the size of the event that begins at offset; 0 if no undamaged event begins there.
  size_t EventSize(uint64_t offset);
  // Returns the size of the event at offset according to the lengths in its header; 0 if they are
  // implausible.
  size_t ClaimedSize(uint64_t offset);
  // Returns true if an event or the end of the log begins here.
  bool IsBoundary(uint64_t offset);
  // Returns the first offset, not before `offset`, of an event that is followed by a boundary. The result is
  // cached, so that reading takes linear time for any input.
  uint64_t NextWhole(uint64_t offset);

  std::string name_;
  InputFile file_;
  bool is_packed_ = false;
  uint64_t size_ = 0;
  // Bytes in memory; for a packed log, the whole log.
  std::vector<uint8_t> window_;
  uint64_t window_begin_ = 0;
  uint64_t offset_ = 0;
  // Cache of NextWhole(): no event that is followed by a boundary begins between these two offsets.
  uint64_t searched_from_ = 0, whole_at_ = 0;
  int64_t damaged_bytes_ = 0;
  int64_t damaged_places_ = 0;
};

}  // namespace evalbus
