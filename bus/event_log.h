// Standard LCM event logs: written so that lcm-logplayer reads them, read so that damage costs
// only the damaged events; packed ones (bus/packed_log.h) are read as what they were packed from. Record
// format (LCM, "log file format"): magic 0xEDA1DA01, event number i64, time i64 [us], channel length u32,
// data length u32, channel, data; all big-endian.
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
  // Views into the reader; valid until it reads the next event.
  std::string_view channel;
  std::span<const uint8_t> data;
};

// Reads a log piece by piece, so that one of any length takes little memory, or unpacks it into memory. Not
// mapped: a mapped file that becomes shorter ends the process that reads it.
class EventLogReader {
 public:
  // Throws InputError if it cannot be read, is no file, or what is packed is damaged.
  explicit EventLogReader(const std::filesystem::path& file);

  // The next whole event; false at the end, which is where the file ended when it was opened. Bytes that are
  // no event are skipped up to the next one that is. Throws InputError if the file has become shorter.
  bool Next(LogEvent* event);

  // Bytes of all events: the file's, or those that it was packed from.
  uint64_t size() const { return size_; }
  bool is_packed() const { return is_packed_; }
  // The bytes that a packed log was packed from.
  std::span<const uint8_t> unpacked() const { return window_; }

  // What was skipped so far.
  int64_t damaged_bytes() const { return damaged_bytes_; }
  int64_t damaged_places() const { return damaged_places_; }

 private:
  // So many bytes of the log, which are there; valid until the next call.
  const uint8_t* At(uint64_t offset, size_t size);
  bool IsInWindow(uint64_t offset, size_t size) const {
    return offset >= window_begin_ && offset + size <= window_begin_ + window_.size();
  }
  // Reads bytes of the file, all of them.
  void Read(uint64_t offset, std::span<uint8_t> to);
  // The next byte from this offset on that may begin an event; the end if there is none.
  uint64_t FindStart(uint64_t offset);
  // Size of the event that starts at offset, 0 if none does.
  size_t EventSize(uint64_t offset);
  // The same by what the event's header says.
  size_t ClaimedSize(uint64_t offset);
  // An event or the end of the log begins here.
  bool IsBoundary(uint64_t offset);
  // Where, from this offset on, an event begins that a boundary follows. Found once, so that reading takes
  // linear time whatever the bytes are.
  uint64_t NextWhole(uint64_t offset);

  std::string name_;
  InputFile file_;
  bool is_packed_ = false;
  uint64_t size_ = 0;
  // What is in memory; of a packed log all.
  std::vector<uint8_t> window_;
  uint64_t window_begin_ = 0;
  uint64_t offset_ = 0;
  // No event of which NextWhole() speaks begins between these two.
  uint64_t searched_from_ = 0, whole_at_ = 0;
  int64_t damaged_bytes_ = 0;
  int64_t damaged_places_ = 0;
};

}  // namespace evalbus
