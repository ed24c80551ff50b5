#include "bus/packed_log.h"

#include <fmt/format.h>
#include <unistd.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

#include "base/errors.h"
#include "base/input_file.h"

namespace evalbus {
namespace {

constexpr std::array<uint8_t, 4> kZstdMagic = {0x28, 0xB5, 0x2F, 0xFD};
// Higher levels make logs 2 % smaller and take three times as long.
constexpr int kLevel = 3;

struct Free {
  void operator()(ZSTD_CCtx* context) const { ZSTD_freeCCtx(context); }
  void operator()(ZSTD_DCtx* context) const { ZSTD_freeDCtx(context); }
  void operator()(FILE* file) const { std::fclose(file); }
};

}  // namespace

LogForm ParseLogForm(const std::string& text) {
  if (text == "plain") return LogForm::kPlain;
  if (text == "zstd") return LogForm::kZstd;
  throw InputError("--log: expected plain or zstd, got '" + text + "'");
}

bool IsPacked(std::span<const uint8_t> bytes) {
  return bytes.size() >= kZstdMagic.size() && std::equal(kZstdMagic.begin(), kZstdMagic.end(), bytes.begin());
}

void PackLog(const std::filesystem::path& log, const std::filesystem::path& file) {
  const auto check = [&](bool good) {
    if (!good) throw EnvironmentError("cannot write log " + file.string() + ": " + std::strerror(errno));
  };
  const InputFile input(log, "log");
  const std::unique_ptr<FILE, Free> stream(std::fopen(file.c_str(), "wbx"));
  check(stream != nullptr);
  const std::unique_ptr<ZSTD_CCtx, Free> context(ZSTD_createCCtx());
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_compressionLevel, kLevel);
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_checksumFlag, 1);
  ZSTD_CCtx_setPledgedSrcSize(context.get(), input.size());
  std::vector<char> read_bytes(ZSTD_CStreamInSize()), buffer(ZSTD_CStreamOutSize());
  uint64_t position = 0;
  ZSTD_inBuffer in{read_bytes.data(), 0, 0};
  for (size_t left = 1; left > 0 || position < input.size();) {
    if (in.pos == in.size && position < input.size()) {
      const size_t size = std::min<uint64_t>(read_bytes.size(), input.size() - position);
      const size_t n = input.ReadAt(position, {read_bytes.data(), size});
      if (n == 0) input.Fail(EIO);
      in = {read_bytes.data(), n, 0};
      position += n;
    }
    ZSTD_outBuffer out{buffer.data(), buffer.size(), 0};
    left = ZSTD_compressStream2(context.get(), &out, &in,
                                position < input.size() ? ZSTD_e_continue : ZSTD_e_end);
    if (ZSTD_isError(left)) throw EnvironmentError(std::string("zstd: ") + ZSTD_getErrorName(left));
    check(std::fwrite(buffer.data(), 1, out.pos, stream.get()) == out.pos);
  }
  check(std::fflush(stream.get()) == 0 && fsync(fileno(stream.get())) == 0);
}

std::vector<uint8_t> UnpackLog(std::span<const uint8_t> packed, const std::filesystem::path& file,
                               size_t most) {
  const auto fail = [&](const std::string& why) {
    throw InputError("cannot read log " + file.string() + ": " + why);
  };
  const auto too_large = [&] {
    fail(fmt::format("it unpacks to more than {} MB; unpack it with 'zstd -d' and use that file",
                     most / 1'000'000));
  };
  const auto declared = ZSTD_getFrameContentSize(packed.data(), packed.size());
  const bool is_declared = declared != ZSTD_CONTENTSIZE_UNKNOWN && declared != ZSTD_CONTENTSIZE_ERROR;
  if (is_declared && declared > most) too_large();
  // The declared size is not trusted. The buffer begins with a likely size and grows as data are unpacked.
  constexpr size_t kUsualRatio = 16;
  const size_t likely = std::max<size_t>(kUsualRatio * packed.size(), 4096);
  std::vector<uint8_t> log(std::min(is_declared ? static_cast<size_t>(declared) : most, likely));
  const std::unique_ptr<ZSTD_DCtx, Free> context(ZSTD_createDCtx());
  ZSTD_inBuffer in{packed.data(), packed.size(), 0};
  size_t size = 0;
  // Concatenated frames form one log.
  for (size_t left = 0; in.pos < in.size || left > 0;) {
    ZSTD_outBuffer out{log.data(), log.size(), size};
    const size_t read = in.pos;
    left = ZSTD_decompressStream(context.get(), &out, &in);
    if (ZSTD_isError(left)) fail(std::string("damaged zstd data: ") + ZSTD_getErrorName(left));
    if (out.pos == size && in.pos == read && size < log.size()) fail("it is truncated");
    size = out.pos;
    if (size < log.size()) continue;
    if (in.pos == in.size && left == 0) break;
    if (log.size() > most) too_large();
    // The buffer may become one byte larger than the limit, so that a log beyond the limit is detected.
    log.resize(std::min(2 * log.size() + 4096, most + 1));
  }
  log.resize(size);
  if (log.size() > most) too_large();
  return log;
}

}  // namespace evalbus
