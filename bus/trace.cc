#include "bus/trace.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <string>

#include "bus/message.h"

namespace evalbus {

std::unique_ptr<Trace> Trace::OfEnvironment() {
  const char* folder = std::getenv(kVariable);
  if (folder == nullptr) return nullptr;
  return std::make_unique<Trace>(std::filesystem::path(folder) / (std::to_string(getpid()) + ".trace"));
}

std::vector<Trace::Record> Trace::Read(const std::filesystem::path& file) {
  std::vector<Record> records(std::filesystem::file_size(file) / sizeof(Record));
  std::ifstream(file, std::ios::binary)
      .read(reinterpret_cast<char*>(records.data()),
            static_cast<std::streamsize>(records.size() * sizeof(Record)));
  return records;
}

Trace::Trace(std::filesystem::path file) : file_(std::move(file)) { records_.reserve(1 << 20); }

Trace::~Trace() {
  std::ofstream stream(file_, std::ios::binary);
  stream.write(reinterpret_cast<const char*>(records_.data()),
               static_cast<std::streamsize>(records_.size() * sizeof(Record)));
  if (!stream.flush()) std::cerr << "error: cannot write " << file_.string() << std::endl;
}

void Trace::Add(Event event, std::string_view channel, std::span<const uint8_t> data) {
  Record record{};
  record.time_ns = std::chrono::steady_clock::now().time_since_epoch().count();
  record.event = event;
  constexpr std::string_view kOurs = "EVALBUS_";
  if (channel.starts_with(kOurs)) channel.remove_prefix(kOurs.size());
  std::ranges::copy(channel.substr(0, sizeof record.channel), record.channel);
  header_t header{};
  constexpr int kBegin = sizeof(int64_t);
  if (header._decodeNoHash(data.data(), kBegin, static_cast<int>(data.size()) - kBegin) > 0) {
    record.episode = header.episode;
    record.tick = static_cast<int32_t>(header.tick);
  }
  records_.push_back(record);
}

}  // namespace evalbus
