#include "viz/viewer/block.h"

#include <bit>
#include <functional>
#include <numeric>

#include "base/errors.h"
#include "base/json_file.h"
#include "base/text.h"

namespace evalbus::viz {
namespace {

static_assert(std::endian::native == std::endian::little, "blocks are little endian");

constexpr size_t kAlignment = 8;

void Align(std::string* bytes) {
  bytes->resize((bytes->size() + kAlignment - 1) / kAlignment * kAlignment, '\0');
}

// Replaces invalid bytes in strings, which may come from external files and messages.
void MakePrintable(nlohmann::ordered_json* json) {
  if (json->is_string()) *json = Printable(json->get_ref<const std::string&>());
  if (!json->is_structured()) return;
  for (auto& value : *json) MakePrintable(&value);
}

template <class T>
std::vector<double> Decoded(const std::string& raw, bool is_delta, size_t row) {
  std::vector<T> values(raw.size() / sizeof(T));
  raw.copy(reinterpret_cast<char*>(values.data()), values.size() * sizeof(T));
  if constexpr (std::is_integral_v<T>) {
    // Differences wrap around. They are added as unsigned numbers, because signed overflow is undefined.
    using Bits = std::make_unsigned_t<T>;
    for (size_t i = 0; is_delta && i < values.size(); ++i) {
      if (i % row != 0)
        values[i] = static_cast<T>(static_cast<Bits>(values[i]) + static_cast<Bits>(values[i - 1]));
    }
  }
  return {values.begin(), values.end()};
}

}  // namespace

nlohmann::ordered_json& BlockWriter::Add(const std::string& name, const char* type,
                                         const std::vector<size_t>& shape, const void* data, size_t bytes) {
  Align(&data_);
  nlohmann::ordered_json& array = arrays_[name];
  array = {{"type", type}, {"shape", shape}, {"offset", data_.size()}};
  if (bytes > 0) data_.append(static_cast<const char*>(data), bytes);
  return array;
}

std::string BlockWriter::Bytes() const {
  nlohmann::ordered_json head = head_;
  MakePrintable(&head);
  head["arrays"] = arrays_;
  const std::string text = ToText(head);
  const auto length = static_cast<uint32_t>(text.size());
  std::string bytes(reinterpret_cast<const char*>(&length), sizeof length);
  bytes += text;
  Align(&bytes);
  return bytes + data_;
}

BlockReader::BlockReader(const std::string& bytes) {
  uint32_t length = 0;
  if (bytes.size() < sizeof length) throw InputError("block: the header is missing");
  std::memcpy(&length, bytes.data(), sizeof length);
  const size_t end = sizeof length + length;
  if (end > bytes.size()) throw InputError("block: the header is truncated");
  head_ = ParseJson<nlohmann::ordered_json>(bytes.substr(sizeof length, length), "block");
  data_ = bytes.substr(std::min(bytes.size(), (end + kAlignment - 1) / kAlignment * kAlignment));
}

const nlohmann::ordered_json& BlockReader::Find(const std::string& array) const {
  const auto found = head_.at("arrays").find(array);
  if (found == head_.at("arrays").end()) throw InputError("block: no array '" + array + "'");
  return *found;
}

std::vector<size_t> BlockReader::Shape(const std::string& array) const {
  return Find(array).at("shape").get<std::vector<size_t>>();
}

std::string BlockReader::Raw(const std::string& array) const {
  static const std::map<std::string, size_t> kSize = {{"u8", 1},  {"i16", 2}, {"u16", 2},
                                                      {"i32", 4}, {"u32", 4}, {"f32", 4}};
  const std::vector<size_t> shape = Shape(array);
  const size_t count = std::accumulate(shape.begin(), shape.end(), size_t{1}, std::multiplies<>());
  const size_t bytes = count * kSize.at(Find(array).at("type").get<std::string>());
  const size_t offset = Find(array).at("offset").get<size_t>();
  if (offset > data_.size() || bytes > data_.size() - offset) {
    throw InputError("block: array '" + array + "' is truncated");
  }
  return data_.substr(offset, bytes);
}

std::vector<double> BlockReader::Values(const std::string& array) const {
  const nlohmann::ordered_json& description = Find(array);
  const std::string type = description.at("type").get<std::string>();
  const std::string raw = Raw(array);
  const bool is_delta = description.value("delta", false);
  const std::vector<size_t> shape = Shape(array);
  const size_t row = shape.back();
  std::vector<double> values = type == "u8"    ? Decoded<uint8_t>(raw, is_delta, row)
                               : type == "i16" ? Decoded<int16_t>(raw, is_delta, row)
                               : type == "u16" ? Decoded<uint16_t>(raw, is_delta, row)
                               : type == "i32" ? Decoded<int32_t>(raw, is_delta, row)
                               : type == "u32" ? Decoded<uint32_t>(raw, is_delta, row)
                                               : Decoded<float>(raw, is_delta, row);
  // Scale and origin are a single value for all elements, or one value per element of the last axis.
  const auto of = [&](const char* key, size_t i, double otherwise) {
    const auto found = description.find(key);
    if (found == description.end()) return otherwise;
    return found->is_array() ? found->at(i % row).get<double>() : found->get<double>();
  };
  if (!description.contains("scale") && !description.contains("origin")) return values;
  for (size_t i = 0; i < values.size(); ++i) values[i] = of("origin", i, 0) + of("scale", i, 1) * values[i];
  return values;
}

}  // namespace evalbus::viz
