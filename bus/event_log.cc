#include "bus/event_log.h"

#include <fcntl.h>
#include <lcm/eventlog.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "base/errors.h"
#include "base/run_layout.h"
#include "bus/lcm_wire.h"
#include "bus/message.h"
#include "bus/packed_log.h"

namespace evalbus {
namespace {

constexpr std::array<uint8_t, 4> kEventMagic = {0xED, 0xA1, 0xDA, 0x01};
constexpr size_t kHeaderSize = 28;

// Ends the mapping of a file.
struct Unmapped {
  std::span<const uint8_t> bytes;
  ~Unmapped() {
    if (!bytes.empty()) munmap(const_cast<uint8_t*>(bytes.data()), bytes.size());
  }
};

int64_t BigEndian64(const uint8_t* p) {
  return static_cast<int64_t>(uint64_t{BigEndian32(p)} << 32 | BigEndian32(p + 4));
}

}  // namespace

EventLogWriter::EventLogWriter(const std::filesystem::path& file)
    : file_(file), stream_(std::fopen(file.c_str(), "wbx")) {
  if (!stream_) Throw("cannot create");
  // Some ticks at a time: each of their messages may be larger than the usual buffer.
  std::setvbuf(stream_, nullptr, _IOFBF, 64 << 10);
}

EventLogWriter::~EventLogWriter() {
  if (stream_) std::fclose(stream_);
}

void EventLogWriter::Throw(const char* what) {
  throw EnvironmentError(std::string(what) + " log " + file_.string() + ": " + std::strerror(errno));
}

void EventLogWriter::Write(std::string_view channel, std::span<const uint8_t> data, int64_t time_us) {
  lcm_eventlog_t log{stream_, num_events_++};
  // lcm_eventlog_write_event does not modify what the event points to.
  lcm_eventlog_event_t event{log.eventcount,
                             time_us,
                             static_cast<int32_t>(channel.size()),
                             static_cast<int32_t>(data.size()),
                             const_cast<char*>(channel.data()),
                             const_cast<uint8_t*>(data.data())};
  if (lcm_eventlog_write_event(&log, &event) != 0) Throw("cannot write");
}

void EventLogWriter::End(bool is_synced) {
  const bool written = std::fflush(stream_) == 0 && (!is_synced || fsync(fileno(stream_)) == 0);
  const bool closed = std::fclose(std::exchange(stream_, nullptr)) == 0;
  if (!written || !closed) Throw("cannot write");
}

void EventLogWriter::Close() {
  if (stream_) End(true);
}

void EventLogWriter::ClosePacked() {
  struct stat info {};
  if (std::fflush(stream_) != 0 || fstat(fileno(stream_), &info) != 0) Throw("cannot write");
  if (static_cast<size_t>(info.st_size) > kMostUnpackedBytes) return Close();
  End(false);
  PackLog(EventLogReader(file_).bytes(), file_.string() + kPackedEnding);
  if (unlink(file_.c_str()) != 0) Throw("cannot remove");
}

EventLogReader::EventLogReader(const std::filesystem::path& file) {
  const int fd = open(file.c_str(), O_RDONLY | O_CLOEXEC);
  struct stat info {};
  if (fd < 0 || fstat(fd, &info) != 0 || !S_ISREG(info.st_mode)) {
    const std::string why = fd < 0 ? std::strerror(errno) : "not a file";
    if (fd >= 0) close(fd);
    throw InputError("cannot read log " + file.string() + ": " + why);
  }
  const auto size = static_cast<size_t>(info.st_size);
  void* mapped = size == 0 ? nullptr : mmap(nullptr, size, PROT_READ, MAP_PRIVATE, fd, 0);
  close(fd);
  if (mapped == MAP_FAILED)
    throw InputError("cannot read log " + file.string() + ": " + std::strerror(errno));
  bytes_ = {static_cast<const uint8_t*>(mapped), size};
  if (!IsPacked(bytes_)) return;
  const Unmapped packed{bytes_};
  unpacked_ = UnpackLog(bytes_, file);
  bytes_ = unpacked_;
}

EventLogReader::~EventLogReader() {
  if (is_packed()) return;
  const Unmapped whole{bytes_};
}

bool EventLogReader::IsBoundary(size_t offset) const {
  return offset == bytes_.size() ||
         (bytes_.size() - offset >= kEventMagic.size() &&
          std::memcmp(bytes_.data() + offset, kEventMagic.data(), kEventMagic.size()) == 0);
}

size_t EventLogReader::EventSize(size_t offset) {
  const size_t size = ClaimedSize(offset);
  if (size == 0 || IsBoundary(offset + size)) return size;
  // Either the next event is damaged, or this one's lengths are: then it claims events that are whole.
  return NextWhole(offset + kEventMagic.size()) < offset + size ? 0 : size;
}

size_t EventLogReader::NextWhole(size_t offset) {
  if (offset >= searched_from_ && offset <= whole_at_) return whole_at_;
  searched_from_ = whole_at_ = offset;
  while (whole_at_ < bytes_.size()) {
    const size_t size = ClaimedSize(whole_at_);
    if (size > 0 && IsBoundary(whole_at_ + size)) break;
    const void* next = memchr(bytes_.data() + whole_at_ + 1, kEventMagic[0], bytes_.size() - whole_at_ - 1);
    whole_at_ = next ? static_cast<size_t>(static_cast<const uint8_t*>(next) - bytes_.data()) : bytes_.size();
  }
  return whole_at_;
}

size_t EventLogReader::ClaimedSize(size_t offset) const {
  if (bytes_.size() - offset < kHeaderSize) return 0;
  const uint8_t* p = bytes_.data() + offset;
  if (std::memcmp(p, kEventMagic.data(), kEventMagic.size()) != 0) return 0;
  const uint32_t channel_size = BigEndian32(p + 20);
  const uint32_t data_size = BigEndian32(p + 24);
  if (channel_size == 0 || channel_size > kMaxChannelBytes || data_size > kMaxMessageBytes) return 0;
  const size_t size = kHeaderSize + channel_size + data_size;
  return size <= bytes_.size() - offset ? size : 0;
}

bool EventLogReader::Next(LogEvent* event) {
  const size_t start = offset_;
  size_t size = 0;
  while (offset_ < bytes_.size() && (size = EventSize(offset_)) == 0) {
    const void* next = memchr(bytes_.data() + offset_ + 1, kEventMagic[0], bytes_.size() - offset_ - 1);
    offset_ = next ? static_cast<size_t>(static_cast<const uint8_t*>(next) - bytes_.data()) : bytes_.size();
  }
  if (offset_ != start) {
    damaged_bytes_ += static_cast<int64_t>(offset_ - start);
    ++damaged_places_;
  }
  if (offset_ == bytes_.size()) return false;
  const uint8_t* p = bytes_.data() + offset_;
  const size_t channel_size = BigEndian32(p + 20);
  event->number = BigEndian64(p + 4);
  event->time_us = BigEndian64(p + 12);
  event->channel = {reinterpret_cast<const char*>(p + kHeaderSize), channel_size};
  event->data = {p + kHeaderSize + channel_size, size - kHeaderSize - channel_size};
  offset_ += size;
  return true;
}

}  // namespace evalbus
