// Generates MCAP files (https://mcap.dev/spec) in memory, with zstd-compressed chunks, message indexes,
// statistics and CRCs. Messages are JSON with a JSON schema.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace evalbus::exports {

class McapWriter {
 public:
  // A chunk is closed when its records reach this size before compression.
  static constexpr size_t kChunkBytes = size_t{1} << 20;

  // library: name and version of the writing program.
  explicit McapWriter(const std::string& library);

  // Returns the channel's id; ids begin at 0. Schemas with the same name and text are written once.
  uint16_t AddChannel(const std::string& topic, const std::string& schema_name, const std::string& schema);
  void Add(uint16_t channel, int64_t time_ns, std::string_view json);

  // Returns the complete file. No other method must be called afterwards.
  std::string Finish();

 private:
  struct Chunk {
    uint64_t begin_ns = 0, end_ns = 0, offset = 0, length = 0, index_length = 0;
    std::map<uint16_t, uint64_t> index_offsets;
    uint64_t compressed = 0, uncompressed = 0;
  };
  void CloseChunk();

  std::string file_;
  // Records of the current chunk, and the times and offsets of each channel's messages in this chunk.
  std::string records_;
  std::map<uint16_t, std::vector<std::pair<uint64_t, uint64_t>>> index_;
  std::vector<Chunk> chunks_;
  // Records that are repeated in the summary section.
  std::vector<std::string> schemas_, channels_;
  std::map<std::pair<std::string, std::string>, uint16_t> schema_ids_;
  std::map<uint16_t, uint64_t> counts_;
  uint64_t messages_ = 0, begin_ns_ = 0, end_ns_ = 0;
};

}  // namespace evalbus::exports
