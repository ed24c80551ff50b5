#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "base/text.h"
#include "policy_bridge/wire/codecs.h"
#include "policy_bridge/wire/policy_client.h"

namespace evalbus::policy {
namespace {

constexpr std::string_view kMagic = "\x93NUMPY";
constexpr size_t kAlignment = 64;

[[noreturn]] void RefuseNpy(const std::string& why) {
  throw ServerError(ServerError::Kind::kProtocol, ".npy array: " + why);
}

// Parses the header, a one-line Python dictionary of three entries: {'descr': '<f4', 'fortran_order': False,
// 'shape': (1, 2), }
class HeaderReader {
 public:
  explicit HeaderReader(std::string_view text) : text_(text) {}

  Array Read() {
    Array array;
    bool has_descr = false, has_order = false, has_shape = false;
    Expect('{');
    while (!Take('}')) {
      const std::string_view key = Text();
      Expect(':');
      if (key == "descr") {
        if (Next() == '[') RefuseNpy("record types are not supported");
        array.dtype = Text();
        has_descr = true;
      } else if (key == "fortran_order") {
        if (Truth()) RefuseNpy("Fortran order is not supported");
        has_order = true;
      } else if (key == "shape") {
        array.shape = Shape();
        has_shape = true;
      } else {
        Malformed();
      }
      if (!Take(',') && Next() != '}') Malformed();
    }
    if (Next() != '\0' || !has_descr || !has_order || !has_shape) Malformed();
    return array;
  }

 private:
  [[noreturn]] void Malformed() const {
    RefuseNpy(fmt::format("header cannot be read: {}", Printable(Cut(std::string(text_), 100))));
  }
  // Returns the next character that is not white space, without consuming it. Returns NUL at the end.
  char Next() {
    while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\n')) ++at_;
    return at_ < text_.size() ? text_[at_] : '\0';
  }
  bool Take(char expected) {
    if (Next() != expected) return false;
    ++at_;
    return true;
  }
  void Expect(char expected) {
    if (!Take(expected)) Malformed();
  }
  std::string_view Text() {
    const char quote = Next();
    if (quote != '\'' && quote != '"') Malformed();
    const size_t begin = at_ + 1, end = text_.find(quote, begin);
    if (end == std::string_view::npos) Malformed();
    at_ = end + 1;
    return text_.substr(begin, end - begin);
  }
  bool Truth() {
    Next();
    const std::string_view rest = text_.substr(at_);
    const bool truth = rest.starts_with("True");
    if (!truth && !rest.starts_with("False")) Malformed();
    at_ += truth ? 4 : 5;
    return truth;
  }
  std::vector<int64_t> Shape() {
    std::vector<int64_t> shape;
    Expect('(');
    while (!Take(')')) {
      Next();
      int64_t length = 0;
      const char* begin = text_.data() + at_;
      const auto [end, error] = std::from_chars(begin, text_.data() + text_.size(), length);
      if (error != std::errc{}) Malformed();
      at_ += static_cast<size_t>(end - begin);
      shape.push_back(length);
      if (!Take(',') && Next() != ')') Malformed();
    }
    return shape;
  }

  std::string_view text_;
  size_t at_ = 0;
};

}  // namespace

Bytes EncodeNpy(const Array& array) {
  std::string shape;
  for (const int64_t length : array.shape) shape += fmt::format("{}{}", shape.empty() ? "" : ", ", length);
  if (array.shape.size() == 1) shape += ',';
  std::string header =
      fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': ({}), }}", array.dtype, shape);
  const size_t before = kMagic.size() + 4;
  header.resize((before + header.size() + kAlignment) / kAlignment * kAlignment - before - 1, ' ');
  header += '\n';

  Bytes bytes(kMagic.begin(), kMagic.end());
  bytes.reserve(before + header.size() + array.data.size());
  for (const size_t byte : {size_t{1}, size_t{0}, header.size() & 255, header.size() >> 8}) {
    bytes.push_back(static_cast<uint8_t>(byte));
  }
  bytes.insert(bytes.end(), header.begin(), header.end());
  bytes.insert(bytes.end(), array.data.begin(), array.data.end());
  return bytes;
}

Array DecodeNpy(std::span<const uint8_t> bytes) {
  if (bytes.size() < 10 || !std::equal(kMagic.begin(), kMagic.end(), bytes.begin(),
                                       [](char a, uint8_t b) { return static_cast<uint8_t>(a) == b; })) {
    RefuseNpy("it does not begin like a .npy file");
  }
  const int version = bytes[6];
  if (version != 1 && version != 2) RefuseNpy(fmt::format("version {} is not supported", version));
  const size_t begin = version == 1 ? 10 : 12;
  if (bytes.size() < begin) RefuseNpy("cut short");
  size_t length = 0;
  for (size_t i = begin; i > 8; --i) length = length << 8 | bytes[i - 1];
  if (length > bytes.size() - begin) RefuseNpy("cut short");
  Array array = HeaderReader({reinterpret_cast<const char*>(bytes.data()) + begin, length}).Read();
  array.data.assign(bytes.begin() + static_cast<std::ptrdiff_t>(begin + length), bytes.end());
  return CheckedArray(std::move(array));
}

}  // namespace evalbus::policy
