// Tests logs compressed with zstd. Decompressing restores them, and incomplete files are reported.
#include "bus/packed_log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "base/errors.h"
#include "bus/event_log.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::packed_log_test {

using Bytes = std::vector<uint8_t>;

Bytes ReadBytes(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

// Returns test data that compresses about as well as a log.
Bytes SomeLog(size_t size) {
  Bytes log(size);
  uint32_t x = 1;
  for (uint8_t& byte : log) byte = static_cast<uint8_t>((x = x * 1664525 + 1013904223) >> 29);
  return log;
}

class PackedLog : public testing::Test {
 protected:
  Bytes Pack(const Bytes& log) {
    const auto plain = folder_.path() / "plain", file = folder_.path() / std::to_string(files_++);
    std::ofstream(plain, std::ios::binary)
        .write(reinterpret_cast<const char*>(log.data()), static_cast<std::streamsize>(log.size()));
    PackLog(plain, file);
    return ReadBytes(file);
  }
  static std::string WhyNot(const Bytes& packed, size_t most = kMaxUnpackedBytes) {
    try {
      UnpackLog(packed, "a.zst", most);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }

  TemporaryFolder folder_;
  int files_ = 0;
};

TEST_F(PackedLog, ComesBackAsItWas) {
  for (const size_t size : {size_t{0}, size_t{1}, size_t{4096}, size_t{3'000'000}}) {
    const Bytes log = SomeLog(size), packed = Pack(log);
    EXPECT_TRUE(IsPacked(packed));
    EXPECT_FALSE(IsPacked(log));
    EXPECT_EQ(UnpackLog(packed, "a.zst"), log) << size;
    EXPECT_EQ(Pack(log), packed) << size;
  }
  EXPECT_LT(Pack(SomeLog(3'000'000)).size(), 1'500'000u);
}

TEST_F(PackedLog, SeveralFramesAreOneLog) {
  const Bytes a = SomeLog(1000), b = SomeLog(70'000);
  Bytes packed = Pack(a), both = a;
  const Bytes second = Pack(b);
  packed.insert(packed.end(), second.begin(), second.end());
  both.insert(both.end(), b.begin(), b.end());
  EXPECT_EQ(UnpackLog(packed, "a.zst"), both);
}

TEST_F(PackedLog, CutOffOrDamagedIsOneClearLine) {
  const Bytes packed = Pack(SomeLog(300'000));
  for (const size_t size : {size_t{4}, size_t{7}, size_t{100}, packed.size() / 2, packed.size() - 1}) {
    EXPECT_EQ(WhyNot({packed.begin(), packed.begin() + static_cast<ptrdiff_t>(size)}),
              "cannot read log a.zst: it is truncated")
        << size;
  }
  Bytes damaged = packed;
  damaged[damaged.size() / 2] ^= 1;
  EXPECT_THAT(WhyNot(damaged), testing::StartsWith("cannot read log a.zst: damaged zstd data: "));
  Bytes more = packed;
  more.insert(more.end(), {'m', 'o', 'r', 'e'});
  EXPECT_THAT(WhyNot(more), testing::HasSubstr("damaged"));
}

// Two files are written by hand according to RFC 8878. The frame of the first states its size in eight bytes.
// The second has no size, and blocks that repeat one byte and need four bytes for 128 kB.
TEST_F(PackedLog, OversizedLogsAreNotUnpacked) {
  const std::string too_much =
      "cannot read log a.zst: it unpacks to more than 1 MB; unpack it with 'zstd -d' and use that file";
  const Bytes magic = {0x28, 0xB5, 0x2F, 0xFD};
  Bytes says = magic;
  says.insert(says.end(), {0xE0, 0, 0, 0, 0, 0, 1, 0, 0});  // single segment, 2^40 bytes
  EXPECT_EQ(WhyNot(says, 1'000'000), too_much);
  Bytes is = magic;
  is.insert(is.end(), {0x00, 0x58});  // no size stated; window of 2 MB
  for (int block = 0; block < 100; ++block) is.insert(is.end(), {0x02, 0x00, 0x10, 'x'});
  EXPECT_EQ(WhyNot(is, 1'000'000), too_much);
  is[is.size() - 4] |= 1;  // the last block
  EXPECT_EQ(UnpackLog(is, "a.zst").size(), 100u << 17);
  // The log has exactly the allowed size.
  EXPECT_EQ(UnpackLog(is, "a.zst", 100u << 17).size(), 100u << 17);
  EXPECT_NE(WhyNot(is, (100u << 17) - 1), "");
}

TEST_F(PackedLog, TheReaderDoesNotCare) {
  const auto write = [](EventLogWriter* log) {
    for (int i = 0; i < 1000; ++i) log->Write("CHANNEL", SomeLog(static_cast<size_t>(i)), 10 * i);
  };
  const auto plain = folder_.path() / "plain", packed = folder_.path() / "packed";
  EventLogWriter a(plain), b(packed);
  write(&a);
  write(&b);
  a.Close();
  b.ClosePacked();
  EXPECT_FALSE(std::filesystem::exists(packed));
  const auto zst = packed.string() + ".zst";
  EXPECT_LT(std::filesystem::file_size(zst), std::filesystem::file_size(plain));
  EventLogReader reader(zst);
  EXPECT_TRUE(reader.is_packed());
  EXPECT_TRUE(std::ranges::equal(reader.unpacked(), ReadBytes(plain)));
  int64_t events = 0;
  for (LogEvent event; reader.Next(&event); ++events) {
    EXPECT_EQ(event.time_us, 10 * events);
    EXPECT_EQ(event.data.size(), static_cast<size_t>(events));
  }
  EXPECT_EQ(events, 1000);
  EXPECT_EQ(reader.damaged_bytes(), 0);
}

TEST_F(PackedLog, FormsHaveNames) {
  EXPECT_EQ(ParseLogForm("plain"), LogForm::kPlain);
  EXPECT_EQ(ParseLogForm("zstd"), LogForm::kZstd);
  EXPECT_THROW(ParseLogForm("gzip"), InputError);
}

}  // namespace evalbus::packed_log_test
