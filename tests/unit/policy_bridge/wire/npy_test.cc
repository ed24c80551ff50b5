#include <gtest/gtest.h>

#include "policy_bridge/wire/codecs.h"
#include "tests/unit/policy_bridge/wire/server_failure.h"

namespace evalbus::policy::npy_test {

using Kind = ServerError::Kind;

// Returns a file of this version with this header and data.
Bytes File(int version, const std::string& header, const Bytes& data) {
  Bytes bytes = FromHex("934e554d5059");
  bytes.insert(bytes.end(), {static_cast<uint8_t>(version), 0});
  for (int i = 0; i < (version == 1 ? 2 : 4); ++i) {
    bytes.push_back(static_cast<uint8_t>(header.size() >> 8 * i));
  }
  bytes.insert(bytes.end(), header.begin(), header.end());
  bytes.insert(bytes.end(), data.begin(), data.end());
  return bytes;
}

struct NpyVector {
  Array array;
  std::string header;  // without padding
  size_t data_begin;
};

// This is the output of NumPy 1.24's save().
TEST(Npy, WritesAndReadsWhatNumPyDoes) {
  const std::vector<NpyVector> vectors = {
      {{"<f4", {1, 1, 2}, FromHex("0000003f000080bf")},
       "{'descr': '<f4', 'fortran_order': False, 'shape': (1, 1, 2), }",
       128},
      {{"<f8", {}, FromHex("000000000000f83f")},
       "{'descr': '<f8', 'fortran_order': False, 'shape': (), }",
       128},
      {{"|u1", {3}, {0, 1, 2}}, "{'descr': '|u1', 'fortran_order': False, 'shape': (3,), }", 128},
      {{"|b1", {2}, {1, 0}}, "{'descr': '|b1', 'fortran_order': False, 'shape': (2,), }", 128},
      {{"<f4", {0, 3}, {}}, "{'descr': '<f4', 'fortran_order': False, 'shape': (0, 3), }", 128},
      {{"|u1", std::vector<int64_t>(25, 1), {7}},
       "{'descr': '|u1', 'fortran_order': False, 'shape': (1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, "
       "1, 1, 1, "
       "1, 1, 1, 1, 1, 1), }",
       192},
  };
  for (const auto& [array, header, data_begin] : vectors) {
    SCOPED_TRACE(header);
    const Bytes bytes = EncodeNpy(array);
    const std::string filled = header + std::string(data_begin - 11 - header.size(), ' ') + '\n';
    EXPECT_EQ(ToHex(bytes), ToHex(File(1, filled, array.data)));
    EXPECT_EQ(DecodeNpy(bytes), array);
  }
}

TEST(Npy, ReadsVersion2OtherOrdersOfKeysAndBigEndianNumbers) {
  const Array numbers = {"<i2", {2}, {1, 0, 2, 0}};
  EXPECT_EQ(
      DecodeNpy(File(2, "{'descr': '<i2', 'fortran_order': False, 'shape': (2,), }   \n", {1, 0, 2, 0})),
      numbers);
  EXPECT_EQ(DecodeNpy(File(1, "{\"shape\":( 2 ,) , 'fortran_order':False,'descr':'<i2'}", {1, 0, 2, 0})),
            numbers);
  EXPECT_EQ(DecodeNpy(File(1, "{'descr': '>i2', 'fortran_order': False, 'shape': (2,), }", {0, 1, 0, 2})),
            numbers);
}

TEST(Npy, RefusesWhatItCannotRead) {
  const auto failure = [](int version, const std::string& header, size_t num_bytes) {
    return FailureOf([&] { DecodeNpy(File(version, header, Bytes(num_bytes))); });
  };
  EXPECT_THAT(failure(1, "{'descr': '<f4', 'fortran_order': True, 'shape': (1, 2), }", 8),
              FailsAs(Kind::kProtocol, "Fortran"));
  EXPECT_THAT(failure(1, "{'descr': '|O', 'fortran_order': False, 'shape': (1,), }", 8),
              FailsAs(Kind::kProtocol, "array |O [1]"));
  EXPECT_THAT(failure(1, "{'descr': '<c8', 'fortran_order': False, 'shape': (1,), }", 8),
              FailsAs(Kind::kProtocol, "array <c8 [1]"));
  EXPECT_THAT(failure(1, "{'descr': [('x', '<f4')], 'fortran_order': False, 'shape': (1,), }", 4),
              FailsAs(Kind::kProtocol, "record types"));
  EXPECT_THAT(failure(3, "{'descr': '<f4', 'fortran_order': False, 'shape': (1,), }", 4),
              FailsAs(Kind::kProtocol, "version 3"));
  // The data does not fit the shape.
  const auto of_shape = [&](const std::string& shape, size_t num_bytes) {
    return failure(1, "{'descr': '<f4', 'fortran_order': False, 'shape': " + shape + ", }", num_bytes);
  };
  EXPECT_THAT(
      of_shape("(2,)", 4),
      FailsAs(Kind::kProtocol, "array <f4 [2] has 4 bytes of data, which do not fit its type and shape"));
  EXPECT_THAT(
      of_shape("(2,)", 12),
      FailsAs(Kind::kProtocol, "array <f4 [2] has 12 bytes of data, which do not fit its type and shape"));
  EXPECT_THAT(of_shape("(-1, -1)", 4), FailsAs(Kind::kProtocol, "[-1, -1]"));
  EXPECT_THAT(of_shape("(1073741824, 1073741824, 16)", 0),
              FailsAs(Kind::kProtocol, "has 0 bytes of data"));  // needs 4 * 2^64 bytes
  EXPECT_THAT(of_shape("(99999999999999999999,)", 4), FailsAs(Kind::kProtocol, "header"));
  // These headers are invalid or use a different notation.
  for (const char* header : {"", "{", "{}", "{'descr': '<f4', 'fortran_order': False}",
                             "{'descr': '<f4', 'fortran_order': 0, 'shape': ()}",
                             "{'descr': '<f4' 'fortran_order': False, 'shape': ()}",
                             "{'descr': '<f4', 'fortran_order': False, 'shape': (}",
                             "{'descr': '<f4', 'fortran_order': False, 'shape': (1 1)}", "{'descr': '<f4",
                             "{'descr': '<f4', 'fortran_order': False, 'shape': (), 'more': 1}",
                             "{'descr': '<f4', 'fortran_order': False, 'shape': ()} x"}) {
    EXPECT_THAT(failure(1, header, 4), FailsAs(Kind::kProtocol, "header")) << header;
  }
}

TEST(Npy, RefusesEveryFileCutShort) {
  const Bytes whole = EncodeNpy({"<f4", {1, 1, 2}, Bytes(8)});
  for (size_t size = 0; size < whole.size(); ++size) {
    EXPECT_EQ(FailureOf([&] { DecodeNpy({whole.data(), size}); }).kind(), Kind::kProtocol) << size;
  }
  // The length field announces a header of 4 GB.
  EXPECT_THAT(FailureOf([] { DecodeNpy(FromHex("934e554d50590200ffffffff7b27")); }),
              FailsAs(Kind::kProtocol, "cut short"));
}

}  // namespace evalbus::policy::npy_test
