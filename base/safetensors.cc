#include "base/safetensors.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>

#include "base/errors.h"
#include "base/input_file.h"
#include "base/json_file.h"
#include "base/text.h"

namespace evalbus {
namespace {

using nlohmann::ordered_json;

constexpr uint64_t kMaxHeader = 100'000'000;
constexpr char kMetadata[] = "__metadata__";

size_t ItemSize(const std::string& dtype) {
  for (const char* name : {"F64", "I64", "U64"}) {
    if (dtype == name) return 8;
  }
  for (const char* name : {"F32", "I32", "U32"}) {
    if (dtype == name) return 4;
  }
  for (const char* name : {"F16", "BF16", "I16", "U16"}) {
    if (dtype == name) return 2;
  }
  for (const char* name : {"I8", "U8", "BOOL"}) {
    if (dtype == name) return 1;
  }
  return 0;
}

// Returns the size of a tensor in bytes; nullopt if the size overflows.
std::optional<uint64_t> Size(const Tensor& tensor) {
  uint64_t size = ItemSize(tensor.dtype);
  for (const int64_t extent : tensor.shape) {
    if (extent < 0 || (extent > 0 && size > (uint64_t{1} << 50) / static_cast<uint64_t>(extent))) return {};
    size *= static_cast<uint64_t>(extent);
  }
  return size;
}

template <class Number>
std::vector<double> NumbersOf(const std::vector<uint8_t>& data) {
  std::vector<double> numbers(data.size() / sizeof(Number));
  for (size_t i = 0; i < numbers.size(); ++i) {
    Number number;
    std::memcpy(&number, data.data() + i * sizeof number, sizeof number);
    numbers[i] = static_cast<double>(number);
  }
  return numbers;
}

struct Placed {
  std::string name;
  Tensor tensor;
  uint64_t begin = 0, end = 0;
};

}  // namespace

std::vector<double> Tensor::Numbers() const {
  if (dtype == "F64") return NumbersOf<double>(data);
  if (dtype == "F32") return NumbersOf<float>(data);
  if (dtype == "I64") return NumbersOf<int64_t>(data);
  if (dtype == "I32") return NumbersOf<int32_t>(data);
  if (dtype == "U8" || dtype == "BOOL") return NumbersOf<uint8_t>(data);
  throw InputError("numbers of type " + Printable(dtype) +
                   " are not supported; expected F64, F32, I64, I32, U8 or BOOL");
}

Tensor DoubleTensor(const std::vector<double>& numbers, std::vector<int64_t> shape) {
  Tensor tensor{"F64", std::move(shape), std::vector<uint8_t>(numbers.size() * sizeof(double))};
  if (!numbers.empty()) std::memcpy(tensor.data.data(), numbers.data(), tensor.data.size());
  return tensor;
}

Tensor ByteTensor(std::vector<uint8_t> numbers, std::vector<int64_t> shape, const char* dtype) {
  return {dtype, std::move(shape), std::move(numbers)};
}

const Tensor* Safetensors::Find(const std::string& name) const {
  for (const auto& [other, tensor] : tensors) {
    if (other == name) return &tensor;
  }
  return nullptr;
}

Safetensors ParseSafetensors(std::span<const uint8_t> bytes, const std::string& file) {
  const auto fail = [&](const std::string& what) { throw InputError(file + ": " + what); };
  if (bytes.size() < 8) fail("not a safetensors file: shorter than the 8 bytes of the header's length");
  uint64_t length = 0;
  for (int i = 7; i >= 0; --i) length = length << 8 | bytes[static_cast<size_t>(i)];
  if (length > kMaxHeader) {
    fail(fmt::format("not a safetensors file: its header would be {} bytes long, more than {}", length,
                     kMaxHeader));
  }
  if (length > bytes.size() - 8) {
    fail(fmt::format("truncated: the header is {} bytes long, the file has {} after its first 8", length,
                     bytes.size() - 8));
  }
  const std::string text(reinterpret_cast<const char*>(bytes.data()) + 8, length);
  const auto header = ParseJson<ordered_json>(text, file);
  if (!header.is_object()) fail("header: expected a JSON object");
  const std::span<const uint8_t> data = bytes.subspan(8 + length);

  Safetensors result;
  std::vector<Placed> placed;
  for (const auto& item : header.items()) {
    const std::string& name = item.key();
    const ordered_json& entry = item.value();
    const std::string where = "tensor \"" + Printable(Cut(name, 60)) + "\": ";
    if (name == kMetadata) {
      if (!entry.is_object()) fail("header: __metadata__: expected an object");
      for (const auto& [key, value] : entry.items()) {
        if (!value.is_string()) fail("header: __metadata__: \"" + Printable(Cut(key, 60)) + "\" is not text");
        result.metadata[key] = value.get<std::string>();
      }
      continue;
    }
    const auto is_list = [&](const char* key) {
      if (!entry.is_object() || !entry.contains(key) || !entry[key].is_array()) return false;
      return std::ranges::all_of(entry[key], [](const ordered_json& n) { return n.is_number_unsigned(); });
    };
    if (!is_list("shape") || !is_list("data_offsets") || entry["data_offsets"].size() != 2 ||
        !entry.contains("dtype") || !entry["dtype"].is_string()) {
      fail(where + "expected {dtype, shape, data_offsets: [begin, end]}");
    }
    Placed one{.name = name, .tensor = {}};
    one.tensor.dtype = entry["dtype"].get<std::string>();
    if (ItemSize(one.tensor.dtype) == 0)
      fail(where + "unknown dtype " + Printable(Cut(one.tensor.dtype, 20)));
    for (const ordered_json& extent : entry["shape"]) {
      const auto value = extent.get<uint64_t>();
      if (value > uint64_t{1} << 40) fail(where + "its shape is too large for any file");
      one.tensor.shape.push_back(static_cast<int64_t>(value));
    }
    one.begin = entry["data_offsets"][0].get<uint64_t>();
    one.end = entry["data_offsets"][1].get<uint64_t>();
    if (one.begin > one.end || one.end > data.size()) {
      fail(where + fmt::format("lies at bytes {} to {} of {}: the file is truncated or damaged", one.begin,
                               one.end, data.size()));
    }
    const auto size = Size(one.tensor);
    if (!size || *size != one.end - one.begin) fail(where + "shape, dtype and data_offsets do not match");
    placed.push_back(std::move(one));
  }
  std::ranges::stable_sort(placed, [](const Placed& a, const Placed& b) {
    return std::pair(a.begin, a.end) < std::pair(b.begin, b.end);
  });
  uint64_t end = 0;
  for (Placed& one : placed) {
    if (one.begin != end) {
      fail("tensor \"" + Printable(Cut(one.name, 60)) +
           (one.begin < end ? "\" overlaps another one" : "\": bytes before it belong to no tensor"));
    }
    end = one.end;
  }
  if (end != data.size())
    fail(Plural(static_cast<int64_t>(data.size() - end), "byte") + " after the last tensor, expected none");
  for (Placed& one : placed) {
    one.tensor.data.assign(data.begin() + static_cast<ptrdiff_t>(one.begin),
                           data.begin() + static_cast<ptrdiff_t>(one.end));
    result.tensors.emplace_back(std::move(one.name), std::move(one.tensor));
  }
  return result;
}

Safetensors ReadSafetensors(const std::filesystem::path& file) {
  const std::string bytes = ReadInput(file);
  return ParseSafetensors({reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size()}, file.string());
}

std::string EncodeSafetensors(const Safetensors& content) {
  ordered_json header = ordered_json::object();
  if (!content.metadata.empty()) header[kMetadata] = content.metadata;
  uint64_t end = 0;
  for (const auto& [name, tensor] : content.tensors) {
    const uint64_t begin = std::exchange(end, end + tensor.data.size());
    header[name] = {{"dtype", tensor.dtype}, {"shape", tensor.shape}, {"data_offsets", {begin, end}}};
  }
  std::string text = ToText(header);
  text.resize((text.size() + 7) / 8 * 8, ' ');
  std::string bytes;
  for (int i = 0; i < 8; ++i) bytes += static_cast<char>(text.size() >> (8 * i) & 0xff);
  bytes += text;
  for (const auto& [name, tensor] : content.tensors) bytes.append(tensor.data.begin(), tensor.data.end());
  return bytes;
}

}  // namespace evalbus
