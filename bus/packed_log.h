// Logs packed by zstd, as `evalbus run --log zstd` leaves them; `zstd -d` makes of one what lcm-logplayer
// reads. Who opens a log need not know: EventLogReader unpacks it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace evalbus {

// What a run does with its logs.
enum class LogForm { kPlain, kZstd };
// Of "plain" or "zstd". Throws InputError, in the words of the option --log.
LogForm ParseLogForm(const std::string& text);

// A packed log takes this much memory at most when it is read, and a longer one is not packed.
inline constexpr size_t kMaxUnpackedBytes = size_t{1} << 30;

// True where a file that begins so is packed.
bool IsPacked(std::span<const uint8_t> bytes);

// Packs a log into a file that is not there yet, in one frame with its size and checksum, and syncs it. Equal
// logs give equal files. Throws EnvironmentError, and InputError where the log cannot be read.
void PackLog(const std::filesystem::path& log, const std::filesystem::path& file);

// What PackLog or the zstd program packed. Throws InputError, which names `file`, where it is cut off,
// damaged, or of more than `most` bytes.
std::vector<uint8_t> UnpackLog(std::span<const uint8_t> packed, const std::filesystem::path& file,
                               size_t most = kMaxUnpackedBytes);

}  // namespace evalbus
