#include "viz/viewer/block.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <limits>

#include "base/base64.h"
#include "base/errors.h"
#include "viz/viewer/page_files.h"

namespace evalbus::viz::block_test {

TEST(Block, TheBytesByHand) {
  BlockWriter block("log");
  block.Add<uint16_t>("a", {3}, {1, 2, 0x0304});
  block.Add<uint8_t>("b", {1}, {7});
  const std::string bytes = block.Bytes();
  const std::string head = R"({"block":"log","arrays":{"a":{"type":"u16","shape":[3],"offset":0},)"
                           R"("b":{"type":"u8","shape":[1],"offset":8}}})";
  ASSERT_EQ(head.size(), 109u);
  // The head of 109 bytes and its length of 4 bytes are 113 bytes. Seven zeros pad them to 120, a multiple of
  // 8.
  EXPECT_EQ(bytes, std::string("\x6d\0\0\0", 4) + head + std::string(7, '\0') +
                       std::string("\1\0\2\0\4\3\0\0\7", 9));
}

TEST(Block, ReadsWhatItWrites) {
  BlockWriter block("episode");
  const int32_t least = std::numeric_limits<int32_t>::min(), most = std::numeric_limits<int32_t>::max();
  // The differences start again in each row, and they wrap around.
  block.AddDeltas<int32_t>("deltas", {2, 3}, {5, 7, 4, least, most, 0})["scale"] = 0.5;
  nlohmann::ordered_json& points = block.Add<uint16_t>("points", {2, 3}, {0, 1, 2, 3, 4, 65535});
  points["scale"] = {1, 10, 100};
  points["origin"] = {-1, 0, 1};
  block.Add<float>("empty", {4, 0}, {});
  const BlockReader reader(block.Bytes());
  EXPECT_EQ(reader.head()["block"], "episode");
  EXPECT_EQ(reader.Values("deltas"), (std::vector<double>{2.5, 3.5, 2, 0.5 * least, 0.5 * most, 0}));
  EXPECT_EQ(reader.Values("points"), (std::vector<double>{-1, 10, 201, 2, 40, 6553501}));
  EXPECT_EQ(reader.Shape("empty"), (std::vector<size_t>{4, 0}));
  EXPECT_TRUE(reader.Values("empty").empty());
  int32_t raw[6];
  std::memcpy(raw, reader.Raw("deltas").data(), sizeof raw);
  EXPECT_EQ(raw[1], 2);
  EXPECT_EQ(raw[2], -3);
  EXPECT_THROW(reader.Values("other"), InputError);
  EXPECT_THROW(BlockReader(block.Bytes().substr(0, 20)), InputError);
}

TEST(Block, WordsOfOthersArePrintable) {
  BlockWriter block("run");
  block.head()["name"] = "<script>\x1b[31m\xff\n";
  block.head()["deep"] = {{{"list", {"a\x01"}}}};
  const BlockReader reader(block.Bytes());
  EXPECT_EQ(reader.head()["name"], "<script>?[31m??");
  EXPECT_EQ(reader.head()["deep"][0]["list"][0], "a?");
}

TEST(Pack, IsBase64OfWhatZlibInflates) {
  EXPECT_EQ(Base64(""), "");
  EXPECT_EQ(Base64("f"), "Zg==");
  EXPECT_EQ(Base64("fo"), "Zm8=");
  EXPECT_EQ(Base64("foobar"), "Zm9vYmFy");  // RFC 4648, section 10
  // This text is longer than the encoder's buffer.
  const std::string long_text(size_t{7} << 20, 'a');
  EXPECT_EQ(Base64(long_text).size(), (long_text.size() + 2) / 3 * 4);
  EXPECT_EQ(Base64(long_text).substr(0, 8), "YWFhYWFh");

  const std::string deflated = Deflated(long_text);
  EXPECT_LT(deflated.size(), size_t{10000});
  std::string inflated(long_text.size(), ' ');
  uLongf length = inflated.size();
  ASSERT_EQ(uncompress(reinterpret_cast<Bytef*>(inflated.data()), &length,
                       reinterpret_cast<const Bytef*>(deflated.data()), deflated.size()),
            Z_OK);
  EXPECT_EQ(inflated, long_text);
}

// The files are used in pages that are both HTML and XML.
TEST(PageFiles, HaveNothingThatEndsAScript) {
  for (const PageFile& file : PageFiles()) {
    const std::string text = file.text;
    for (const char* end : {"]]>", "</script", "<!--", "</style"}) {
      EXPECT_EQ(text.find(end), std::string::npos) << file.name << " has " << end;
    }
  }
}

}  // namespace evalbus::viz::block_test
