// Logs packed with zstd, as written by `evalbus run --log zstd`. `zstd -d` unpacks them for lcm-logplayer.
// EventLogReader reads packed and plain logs alike.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace evalbus {

// Form in which a run leaves its logs.
enum class LogForm { kPlain, kZstd };
// Parses "plain" or "zstd". Throws InputError that names the option --log.
LogForm ParseLogForm(const std::string& text);

// Limit of the unpacked size. It also limits the memory for reading a packed log. Longer logs are not packed.
inline constexpr size_t kMaxUnpackedBytes = size_t{1} << 30;

// Returns true if a file that begins with these bytes is packed.
bool IsPacked(std::span<const uint8_t> bytes);

// Packs a log into a new file, in one frame with its size and checksum, and syncs it. Equal logs result in
// equal files. Throws EnvironmentError, or InputError if the log cannot be read.
void PackLog(const std::filesystem::path& log, const std::filesystem::path& file);

// Unpacks data that were packed by PackLog() or the zstd program. Throws InputError, which names `file`, if
// the data are truncated, damaged or longer than `most` bytes.
std::vector<uint8_t> UnpackLog(std::span<const uint8_t> packed, const std::filesystem::path& file,
                               size_t most = kMaxUnpackedBytes);

}  // namespace evalbus
