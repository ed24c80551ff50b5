// Compares MCAP files with the specification, using bytes written out by hand and a reader that checks
// everything.
#include "export/mcap_writer.h"

#include <gmock/gmock.h>
#include <zstd.h>

#include <cstring>
#include <map>
#include <string>
#include <tuple>
#include <vector>

namespace evalbus::exports::mcap_writer_test {

using testing::ElementsAre;
using testing::StartsWith;
using namespace std::string_literals;

// CRC-32 of IEEE 802.3, computed bit by bit and independently of zlib.
uint32_t Crc(std::string_view bytes) {
  uint32_t crc = 0xFFFFFFFF;
  for (const char byte : bytes) {
    crc ^= static_cast<uint8_t>(byte);
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ (crc & 1 ? 0xEDB88320 : 0);
  }
  return ~crc;
}

class Reader {
 public:
  explicit Reader(std::string_view bytes) : bytes_(bytes) {}
  template <class T>
  T Int() {
    T value{};
    EXPECT_GE(bytes_.size(), sizeof value);
    if (bytes_.size() >= sizeof value) std::memcpy(&value, bytes_.data(), sizeof value);
    bytes_.remove_prefix(std::min(bytes_.size(), sizeof value));
    return value;
  }
  std::string_view Bytes(size_t size) {
    EXPECT_LE(size, bytes_.size());
    const std::string_view taken = bytes_.substr(0, size);
    bytes_.remove_prefix(std::min(size, bytes_.size()));
    return taken;
  }
  std::string Text() { return std::string(Bytes(Int<uint32_t>())); }
  std::map<uint16_t, uint64_t> Map() {
    std::map<uint16_t, uint64_t> map;
    Reader entries(Bytes(Int<uint32_t>()));
    while (!entries.empty()) {
      const auto key = entries.Int<uint16_t>();
      map[key] = entries.Int<uint64_t>();
    }
    return map;
  }
  bool empty() const { return bytes_.empty(); }
  size_t left() const { return bytes_.size(); }

 private:
  std::string_view bytes_;
};

struct Record {
  uint8_t op;
  size_t offset, size;
  std::string_view content;
};
std::vector<Record> Records(std::string_view bytes, size_t from = 0) {
  std::vector<Record> records;
  Reader reader(bytes.substr(from));
  while (!reader.empty()) {
    const size_t offset = bytes.size() - reader.left();
    const auto op = reader.Int<uint8_t>();
    const std::string_view content = reader.Bytes(reader.Int<uint64_t>());
    records.push_back({op, offset, 9 + content.size(), content});
  }
  return records;
}

TEST(Mcap, AnEmptyFileIsTheseBytes) {
  const std::string bytes = McapWriter("me").Finish();
  const std::string magic = "\x89MCAP0\r\n"s;
  // The header has profile "" and library "me". DataEnd has no CRC.
  const std::string head = magic + "\x01\x0a\0\0\0\0\0\0\0"s + "\0\0\0\0\x02\0\0\0me"s;
  const std::string data_end = "\x0f\x04\0\0\0\0\0\0\0\0\0\0\0"s;
  // The summary is at 8 + 19 + 13 = 40. It has statistics of 46 bytes, whose offset record is: op 0x0b, at
  // 40, length 55.
  const std::string statistics = "\x0b\x2e\0\0\0\0\0\0\0"s + std::string(46, '\0');
  const std::string offset = "\x0e\x11\0\0\0\0\0\0\0\x0b\x28\0\0\0\0\0\0\0\x37\0\0\0\0\0\0\0"s;
  const std::string footer = "\x02\x14\0\0\0\0\0\0\0\x28\0\0\0\0\0\0\0\x5f\0\0\0\0\0\0\0"s;
  const uint32_t crc = Crc(statistics + offset + footer);
  std::string crc_bytes;
  for (int i = 0; i < 4; ++i) crc_bytes += static_cast<char>(crc >> (8 * i));
  EXPECT_EQ(bytes, head + data_end + statistics + offset + footer + crc_bytes + magic);
}

// The file has two chunks and three channels, and its times are out of order.
std::string File() {
  McapWriter writer("test");
  EXPECT_EQ(writer.AddChannel("/a", "A", R"({"type":"object"})"), 0);
  EXPECT_EQ(writer.AddChannel("/b", "B", R"({"type":"object","title":"b"})"), 1);
  EXPECT_EQ(writer.AddChannel("/c", "A", R"({"type":"object"})"), 2);
  const std::string large(McapWriter::kChunkBytes / 2, 'x');
  writer.Add(0, 3'000'000'000, "{}");
  writer.Add(1, 1'000'000'000, "\"" + large + "\"");
  writer.Add(0, 2'000'000'000, "\"" + large + "\"");
  writer.Add(2, 5'000'000'000, "[1]");
  return writer.Finish();
}

TEST(Mcap, EveryMessageIsFoundByTheIndex) {
  const std::string bytes = File();
  const std::string_view inner = std::string_view(bytes).substr(8, bytes.size() - 16);
  EXPECT_THAT(bytes, StartsWith("\x89MCAP0\r\n"));
  const std::vector<Record> records = Records(std::string_view(bytes).substr(0, bytes.size() - 8), 8);
  ASSERT_EQ(records.front().op, 0x01);
  ASSERT_EQ(records.back().op, 0x02);
  EXPECT_EQ(inner.size() + 8, records.back().offset + records.back().size);

  // The footer refers to the summary, whose CRC is correct.
  Reader footer(records.back().content);
  const auto summary = footer.Int<uint64_t>(), offsets = footer.Int<uint64_t>();
  const auto crc = footer.Int<uint32_t>();
  EXPECT_EQ(crc, Crc(std::string_view(bytes).substr(summary, bytes.size() - 12 - summary)));

  std::vector<std::tuple<int, uint64_t, std::string>> messages;
  std::map<uint8_t, int> count;
  int chunks = 0;
  for (const Record& record : records) {
    ++count[record.op];
    if (record.offset >= offsets && record.op == 0x0e) {
      Reader offset(record.content);
      const auto op = offset.Int<uint8_t>();
      const auto at = offset.Int<uint64_t>(), length = offset.Int<uint64_t>();
      EXPECT_GE(at, summary);
      for (const Record& grouped : Records(std::string_view(bytes).substr(0, at + length), at)) {
        EXPECT_EQ(grouped.op, op);
      }
    }
    if (record.op != 0x08) continue;
    ++chunks;
    Reader index(record.content);
    const auto begin = index.Int<uint64_t>(), end = index.Int<uint64_t>();
    const auto at = index.Int<uint64_t>(), length = index.Int<uint64_t>();
    const std::map<uint16_t, uint64_t> places = index.Map();
    const auto index_length = index.Int<uint64_t>();
    EXPECT_EQ(index.Text(), "zstd");
    const auto compressed = index.Int<uint64_t>(), uncompressed = index.Int<uint64_t>();

    const Record chunk = Records(std::string_view(bytes).substr(0, at + length), at).at(0);
    EXPECT_EQ(chunk.op, 0x06);
    Reader fields(chunk.content);
    EXPECT_EQ(fields.Int<uint64_t>(), begin);
    EXPECT_EQ(fields.Int<uint64_t>(), end);
    EXPECT_EQ(fields.Int<uint64_t>(), uncompressed);
    const auto chunk_crc = fields.Int<uint32_t>();
    EXPECT_EQ(fields.Text(), "zstd");
    const std::string_view packed = fields.Bytes(fields.Int<uint64_t>());
    EXPECT_EQ(packed.size(), compressed);
    std::string unpacked(uncompressed, '\0');
    ASSERT_EQ(ZSTD_decompress(unpacked.data(), unpacked.size(), packed.data(), packed.size()), uncompressed);
    EXPECT_EQ(Crc(unpacked), chunk_crc);

    uint64_t seen_index = 0;
    for (const auto& [channel, place] : places) {
      const Record found =
          Records(std::string_view(bytes).substr(0, at + length + index_length), place).at(0);
      ASSERT_EQ(found.op, 0x07);
      seen_index += found.size;
      Reader entries(found.content);
      EXPECT_EQ(entries.Int<uint16_t>(), channel);
      const auto entries_bytes = entries.Int<uint32_t>();
      EXPECT_EQ(entries_bytes, entries.left());
      for (uint64_t last = 0; !entries.empty();) {
        const auto time = entries.Int<uint64_t>(), offset = entries.Int<uint64_t>();
        EXPECT_GE(time, last);
        EXPECT_GE(time, begin);
        EXPECT_LE(time, end);
        last = time;
        const Record message = Records(unpacked, offset).at(0);
        EXPECT_EQ(message.op, 0x05);
        Reader text(message.content);
        EXPECT_EQ(text.Int<uint16_t>(), channel);
        text.Int<uint32_t>();
        EXPECT_EQ(text.Int<uint64_t>(), time);
        EXPECT_EQ(text.Int<uint64_t>(), time);
        messages.emplace_back(channel, time, std::string(text.Bytes(text.left()).substr(0, 3)));
      }
    }
    EXPECT_EQ(seen_index, index_length);
  }
  EXPECT_EQ(chunks, 2);
  EXPECT_THAT(messages,
              ElementsAre(std::tuple(0, 2'000'000'000, "\"xx"), std::tuple(0, 3'000'000'000, "{}"),
                          std::tuple(1, 1'000'000'000, "\"xx"), std::tuple(2, 5'000'000'000, "[1]")));
  // The summary stores a schema only once if two channels share it.
  EXPECT_EQ(count[0x03], 2);
  EXPECT_EQ(count[0x04], 3);
  EXPECT_EQ(count[0x06], 2);

  for (const Record& record : records) {
    if (record.op != 0x0b) continue;
    Reader statistics(record.content);
    EXPECT_EQ(statistics.Int<uint64_t>(), 4U);
    EXPECT_EQ(statistics.Int<uint16_t>(), 2U);
    EXPECT_EQ(statistics.Int<uint32_t>(), 3U);
    EXPECT_EQ(statistics.Int<uint32_t>(), 0U);
    EXPECT_EQ(statistics.Int<uint32_t>(), 0U);
    EXPECT_EQ(statistics.Int<uint32_t>(), 2U);
    EXPECT_EQ(statistics.Int<uint64_t>(), 1'000'000'000U);
    EXPECT_EQ(statistics.Int<uint64_t>(), 5'000'000'000U);
    EXPECT_THAT(statistics.Map(), ElementsAre(std::pair(0, 2), std::pair(1, 1), std::pair(2, 1)));
  }
}

}  // namespace evalbus::exports::mcap_writer_test
