#include "export/mcap_writer.h"

#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <type_traits>

#include "base/errors.h"

namespace evalbus::exports {
namespace {

constexpr std::string_view kMagic{"\x89MCAP0\r\n", 8};
constexpr char kCompression[] = "zstd";
// zstd level. It is fast, and the files are only a few percent larger than at the highest levels.
constexpr int kLevel = 3;

enum class Op : uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kStatistics = 0x0B,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F,
};

// Serializes the fields of a record, little-endian.
class Fields {
 public:
  template <class T>
  Fields& Int(std::type_identity_t<T> value) {
    for (size_t i = 0; i < sizeof(T); ++i)
      bytes_ += static_cast<char>(static_cast<uint64_t>(value) >> (8 * i));
    return *this;
  }
  Fields& U16(uint16_t value) { return Int<uint16_t>(value); }
  Fields& U32(uint32_t value) { return Int<uint32_t>(value); }
  Fields& U64(uint64_t value) { return Int<uint64_t>(value); }
  Fields& Bytes(std::string_view bytes) {
    bytes_ += bytes;
    return *this;
  }
  Fields& Text(std::string_view text) { return U32(static_cast<uint32_t>(text.size())).Bytes(text); }
  Fields& Counts(const std::map<uint16_t, uint64_t>& map) {
    U32(static_cast<uint32_t>(10 * map.size()));
    for (const auto& [key, value] : map) U16(key).U64(value);
    return *this;
  }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

std::string Record(Op op, const Fields& fields) {
  return Fields().Int<uint8_t>(static_cast<uint8_t>(op)).U64(fields.bytes().size()).bytes() + fields.bytes();
}

uint32_t Crc(std::string_view bytes) {
  return static_cast<uint32_t>(crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

std::string Compressed(const std::string& bytes) {
  std::string compressed(ZSTD_compressBound(bytes.size()), '\0');
  const size_t size = ZSTD_compress(compressed.data(), compressed.size(), bytes.data(), bytes.size(), kLevel);
  if (ZSTD_isError(size)) throw EnvironmentError(std::string("zstd: ") + ZSTD_getErrorName(size));
  compressed.resize(size);
  return compressed;
}

}  // namespace

McapWriter::McapWriter(const std::string& library) : file_(kMagic) {
  file_ += Record(Op::kHeader, Fields().Text("").Text(library));
}

uint16_t McapWriter::AddChannel(const std::string& topic, const std::string& schema_name,
                                const std::string& schema) {
  const auto [place, is_new] =
      schema_ids_.emplace(std::pair(schema_name, schema), static_cast<uint16_t>(schema_ids_.size() + 1));
  if (is_new) {
    schemas_.push_back(
        Record(Op::kSchema, Fields().U16(place->second).Text(schema_name).Text("jsonschema").Text(schema)));
    records_ += schemas_.back();
  }
  const auto id = static_cast<uint16_t>(channels_.size());
  channels_.push_back(
      Record(Op::kChannel, Fields().U16(id).U16(place->second).Text(topic).Text("json").U32(0)));
  records_ += channels_.back();
  return id;
}

void McapWriter::Add(uint16_t channel, int64_t time_ns, std::string_view json) {
  const auto time = static_cast<uint64_t>(time_ns);
  index_[channel].emplace_back(time, records_.size());
  const uint64_t sequence = counts_[channel]++;
  records_ +=
      Record(Op::kMessage,
             Fields().U16(channel).U32(static_cast<uint32_t>(sequence)).U64(time).U64(time).Bytes(json));
  begin_ns_ = messages_ == 0 ? time : std::min(begin_ns_, time);
  end_ns_ = std::max(end_ns_, time);
  ++messages_;
  if (records_.size() >= kChunkBytes) CloseChunk();
}

void McapWriter::CloseChunk() {
  if (records_.empty()) return;
  Chunk chunk;
  bool is_first = true;
  for (const auto& [channel, entries] : index_) {
    for (const auto& [time, offset] : entries) {
      chunk.begin_ns = is_first ? time : std::min(chunk.begin_ns, time);
      chunk.end_ns = std::max(chunk.end_ns, time);
      is_first = false;
    }
  }
  const std::string compressed = Compressed(records_);
  chunk.offset = file_.size();
  chunk.compressed = compressed.size();
  chunk.uncompressed = records_.size();
  file_ += Record(Op::kChunk, Fields()
                                  .U64(chunk.begin_ns)
                                  .U64(chunk.end_ns)
                                  .U64(chunk.uncompressed)
                                  .U32(Crc(records_))
                                  .Text(kCompression)
                                  .U64(compressed.size())
                                  .Bytes(compressed));
  chunk.length = file_.size() - chunk.offset;
  const size_t index_begin = file_.size();
  for (auto& [channel, entries] : index_) {
    std::ranges::stable_sort(entries, {}, &std::pair<uint64_t, uint64_t>::first);
    chunk.index_offsets[channel] = file_.size();
    Fields fields;
    fields.U16(channel).U32(static_cast<uint32_t>(16 * entries.size()));
    for (const auto& [time, offset] : entries) fields.U64(time).U64(offset);
    file_ += Record(Op::kMessageIndex, fields);
  }
  chunk.index_length = file_.size() - index_begin;
  chunks_.push_back(chunk);
  records_.clear();
  index_.clear();
}

std::string McapWriter::Finish() {
  CloseChunk();
  // The CRC of the data section is 0, which means that there is none. Each chunk has its own CRC.
  file_ += Record(Op::kDataEnd, Fields().U32(0));

  const size_t summary = file_.size();
  std::string offsets;
  const auto group = [&](Op op, const std::vector<std::string>& records) {
    if (records.empty()) return;
    const size_t begin = file_.size();
    for (const std::string& record : records) file_ += record;
    offsets += Record(Op::kSummaryOffset,
                      Fields().Int<uint8_t>(static_cast<uint8_t>(op)).U64(begin).U64(file_.size() - begin));
  };
  group(Op::kSchema, schemas_);
  group(Op::kChannel, channels_);
  group(Op::kStatistics, {Record(Op::kStatistics, Fields()
                                                      .U64(messages_)
                                                      .U16(static_cast<uint16_t>(schemas_.size()))
                                                      .U32(static_cast<uint32_t>(channels_.size()))
                                                      .U32(0)
                                                      .U32(0)
                                                      .U32(static_cast<uint32_t>(chunks_.size()))
                                                      .U64(begin_ns_)
                                                      .U64(end_ns_)
                                                      .Counts(counts_))});
  std::vector<std::string> indexes;
  for (const Chunk& chunk : chunks_) {
    indexes.push_back(Record(Op::kChunkIndex, Fields()
                                                  .U64(chunk.begin_ns)
                                                  .U64(chunk.end_ns)
                                                  .U64(chunk.offset)
                                                  .U64(chunk.length)
                                                  .Counts(chunk.index_offsets)
                                                  .U64(chunk.index_length)
                                                  .Text(kCompression)
                                                  .U64(chunk.compressed)
                                                  .U64(chunk.uncompressed)));
  }
  group(Op::kChunkIndex, indexes);

  const size_t summary_offset = file_.size();
  file_ += offsets;
  // The CRC also covers the footer up to the CRC field.
  Fields footer;
  footer.U64(summary).U64(summary_offset);
  const std::string head = Fields().Int<uint8_t>(static_cast<uint8_t>(Op::kFooter)).U64(20).bytes();
  file_ += head + footer.bytes();
  const uint32_t crc = Crc(std::string_view(file_).substr(summary));
  file_ += Fields().U32(crc).bytes();
  file_ += kMagic;
  return std::move(file_);
}

}  // namespace evalbus::exports
