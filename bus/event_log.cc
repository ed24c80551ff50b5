#include "bus/event_log.h"

#include <lcm/eventlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "base/errors.h"
#include "base/run_layout.h"
#include "bus/packed_log.h"
#include "bus/udpm/lcm_wire.h"

namespace evalbus {
namespace {

constexpr std::array<uint8_t, 4> kEventMagic = {0xED, 0xA1, 0xDA, 0x01};
constexpr size_t kHeaderSize = 28;

// Number of bytes that are read in one call; they fit into a processor's cache.
constexpr size_t kWindowBytes = 256 << 10;

int64_t BigEndian64(const uint8_t* p) {
  return static_cast<int64_t>(uint64_t{BigEndian32(p)} << 32 | BigEndian32(p + 4));
}

}  // namespace

EventLogWriter::EventLogWriter(const std::filesystem::path& file)
    : file_(file), stream_(std::fopen(file.c_str(), "wbx")) {
  if (!stream_) Throw("cannot create");
  // The buffer holds several ticks. Single messages may already be larger than the default buffer.
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
  if (static_cast<size_t>(info.st_size) > kMaxUnpackedBytes) return Close();
  End(false);
  PackLog(file_, file_.string() + kPackedEnding);
  if (unlink(file_.c_str()) != 0) Throw("cannot remove");
}

EventLogReader::EventLogReader(const std::filesystem::path& file)
    : name_(file.string()), file_(file, "log"), size_(file_.size()) {
  is_packed_ = IsPacked({At(0, std::min<size_t>(size_, kWindowBytes)), window_.size()});
  if (!is_packed_) return;
  // A file longer than the unpacked limit is read only up to that limit.
  std::vector<uint8_t> packed(std::min<uint64_t>(size_, kMaxUnpackedBytes + kWindowBytes));
  Read(0, packed);
  window_ = UnpackLog(packed, file);
  size_ = window_.size();
}

void EventLogReader::Read(uint64_t offset, std::span<uint8_t> to) {
  for (size_t done = 0; done < to.size();) {
    const ssize_t n =
        pread(file_.fd(), to.data() + done, to.size() - done, static_cast<off_t>(offset + done));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) file_.Fail(errno);
    if (n == 0) {
      throw InputError(name_ + ": cannot read the log: it shrank while it was read, from " +
                       std::to_string(size_) + " to " + std::to_string(offset + done) + " bytes or less");
    }
    done += static_cast<size_t>(n);
  }
}

const uint8_t* EventLogReader::At(uint64_t offset, size_t size) {
  if (!IsInWindow(offset, size)) {
    // Leaves the window empty if reading fails.
    std::vector<uint8_t> window = std::exchange(window_, {});
    window.resize(static_cast<size_t>(std::min<uint64_t>(std::max(size, kWindowBytes), size_ - offset)));
    Read(offset, window);
    window_ = std::move(window);
    window_begin_ = offset;
  }
  return window_.data() + (offset - window_begin_);
}

bool EventLogReader::IsBoundary(uint64_t offset) {
  if (offset == size_) return true;
  if (size_ - offset < kEventMagic.size()) return false;
  // Outside the window, At() is not used, because it would move the window, and the event before this
  // boundary is read next.
  std::array<uint8_t, kEventMagic.size()> bytes{};
  if (IsInWindow(offset, bytes.size())) {
    std::copy_n(At(offset, bytes.size()), bytes.size(), bytes.begin());
  } else {
    Read(offset, bytes);
  }
  return bytes == kEventMagic;
}

size_t EventLogReader::EventSize(uint64_t offset) {
  const size_t size = ClaimedSize(offset);
  if (size == 0 || IsBoundary(offset + size)) return size;
  // Either the next event is damaged, or the lengths of this event are. In the second case, this event
  // appears to contain undamaged events.
  return NextWhole(offset + kEventMagic.size()) < offset + size ? 0 : size;
}

uint64_t EventLogReader::FindStart(uint64_t offset) {
  while (offset < size_) {
    At(offset, 1);
    const auto begin = window_.begin() + static_cast<std::ptrdiff_t>(offset - window_begin_);
    const auto found = std::find(begin, window_.end(), kEventMagic[0]);
    offset += static_cast<uint64_t>(found - begin);
    if (found != window_.end()) return offset;
  }
  return size_;
}

uint64_t EventLogReader::NextWhole(uint64_t offset) {
  if (offset >= searched_from_ && offset <= whole_at_) return whole_at_;
  searched_from_ = whole_at_ = offset;
  while (whole_at_ < size_) {
    const size_t size = ClaimedSize(whole_at_);
    if (size > 0 && IsBoundary(whole_at_ + size)) break;
    whole_at_ = FindStart(whole_at_ + 1);
  }
  return whole_at_;
}

size_t EventLogReader::ClaimedSize(uint64_t offset) {
  if (size_ - offset < kHeaderSize) return 0;
  const uint8_t* p = At(offset, kHeaderSize);
  if (std::memcmp(p, kEventMagic.data(), kEventMagic.size()) != 0) return 0;
  const uint32_t channel_size = BigEndian32(p + 20);
  const uint32_t data_size = BigEndian32(p + 24);
  if (channel_size == 0 || channel_size > kMaxChannelBytes || data_size > kMaxMessageBytes) return 0;
  const size_t size = kHeaderSize + channel_size + data_size;
  return size <= size_ - offset ? size : 0;
}

bool EventLogReader::Next(LogEvent* event) {
  const uint64_t start = offset_;
  size_t size = 0;
  while (offset_ < size_ && (size = EventSize(offset_)) == 0) offset_ = FindStart(offset_ + 1);
  if (offset_ != start) {
    damaged_bytes_ += static_cast<int64_t>(offset_ - start);
    ++damaged_places_;
  }
  if (offset_ == size_) return false;
  const uint8_t* p = At(offset_, size);
  const size_t channel_size = BigEndian32(p + 20);
  event->number = BigEndian64(p + 4);
  event->time_us = BigEndian64(p + 12);
  event->channel = {reinterpret_cast<const char*>(p + kHeaderSize), channel_size};
  event->data = {p + kHeaderSize + channel_size, size - kHeaderSize - channel_size};
  offset_ += size;
  return true;
}

}  // namespace evalbus
