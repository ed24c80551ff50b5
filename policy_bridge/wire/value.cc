#include "policy_bridge/wire/value.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "base/overloaded.h"
#include "base/text.h"
#include "policy_bridge/wire/policy_client.h"

namespace evalbus::policy {
namespace {

constexpr int kWidth = 100;  // maximum length of a value's description, in characters

std::string Line(const std::string& text) { return Printable(Cut(text, kWidth)); }

// Converts an IEEE 754 binary16 number.
double Half(uint16_t bits) {
  const int exponent = bits >> 10 & 0x1F, fraction = bits & 0x3FF;
  const double magnitude = exponent == 0x1F ? (fraction ? NAN : INFINITY)
                           : exponent == 0  ? std::ldexp(fraction, -24)
                                            : std::ldexp(fraction + 0x400, exponent - 25);
  return bits & 0x8000 ? -magnitude : magnitude;
}

template <class Number>
void Append(const Array& array, std::vector<double>* numbers) {
  static_assert(std::endian::native == std::endian::little);
  for (size_t at = 0; at < array.data.size(); at += sizeof(Number)) {
    Number number;
    std::memcpy(&number, &array.data[at], sizeof(number));
    numbers->push_back(static_cast<double>(number));
  }
}

}  // namespace

std::optional<double> Value::Number() const {
  if (const auto* number = As<double>()) return *number;
  if (const auto* number = As<int64_t>()) return static_cast<double>(*number);
  return std::nullopt;
}

const Value* Value::Find(std::string_view key) const {
  const Map* map = As<Map>();
  if (!map) return nullptr;
  for (const auto& [name, value] : *map) {
    if (name == key) return &value;
  }
  return nullptr;
}

std::string Describe(const Value& value) {
  return std::visit(
      Overloaded{
          [](std::nullptr_t) -> std::string { return "nothing"; },
          [](bool truth) -> std::string { return truth ? "true" : "false"; },
          [](int64_t number) { return fmt::format("{}", number); },
          [](double number) { return fmt::format("{}", number); },
          [](const std::string& text) { return "text \"" + Line(text) + "\""; },
          [](const Bytes& bytes) { return fmt::format("{} bytes", bytes.size()); },
          [](const Array& array) {
            return Line(fmt::format("array {} [{}]", array.dtype, fmt::join(array.shape, ", ")));
          },
          [](const List& list) { return fmt::format("list of {}", list.size()); },
          [](const Map& map) { return fmt::format("map of {}", map.size()); },
      },
      value.variant());
}

std::string TextOrDescription(const Value& value) {
  const auto* text = value.As<std::string>();
  return text ? *text : Describe(value);
}

size_t ItemSize(std::string_view dtype) {
  if (dtype.size() != 3) return 0;
  const char order = dtype[0], kind = dtype[1], size = dtype[2];
  if (order != '<' && order != '>' && order != '|') return 0;
  const bool known = size == '1' ? kind == 'b' || kind == 'i' || kind == 'u'
                     : size == '2'
                         ? kind == 'i' || kind == 'u' || kind == 'f'
                         : (size == '4' || size == '8') && (kind == 'i' || kind == 'u' || kind == 'f');
  // Only items of more than one byte have a byte order.
  return known && (size == '1' || order != '|') ? static_cast<size_t>(size - '0') : 0;
}

std::optional<size_t> ItemCount(const std::vector<int64_t>& shape) {
  constexpr int64_t kMax = int64_t{1} << 31;
  if (std::ranges::any_of(shape, [](int64_t extent) { return extent < 0 || extent > kMax; }))
    return std::nullopt;
  if (std::ranges::count(shape, 0) != 0) return 0;
  size_t count = 1;
  for (const int64_t extent : shape) {
    if (__builtin_mul_overflow(count, extent, &count)) return std::nullopt;
  }
  return count;
}

std::vector<double> Numbers(const Array& array) {
  const size_t item_size = ItemSize(array.dtype);
  if (item_size == 0 || array.dtype[0] == '>') {
    throw ServerError(ServerError::Kind::kReply, "expected an array of numbers, got " + Describe(array));
  }
  const std::optional<size_t> count = ItemCount(array.shape);
  if (!count || array.data.size() % item_size != 0 || array.data.size() / item_size != *count) {
    throw ServerError(ServerError::Kind::kReply,
                      fmt::format("{} has {} bytes of data, which do not fit its type and shape",
                                  Describe(array), array.data.size()));
  }
  std::vector<double> numbers;
  numbers.reserve(*count);
  const std::string_view type = std::string_view(array.dtype).substr(1);
  if (type == "b1" || type == "u1") Append<uint8_t>(array, &numbers);
  if (type == "i1") Append<int8_t>(array, &numbers);
  if (type == "i2") Append<int16_t>(array, &numbers);
  if (type == "i4") Append<int32_t>(array, &numbers);
  if (type == "i8") Append<int64_t>(array, &numbers);
  if (type == "u2") Append<uint16_t>(array, &numbers);
  if (type == "u4") Append<uint32_t>(array, &numbers);
  if (type == "u8") Append<uint64_t>(array, &numbers);
  if (type == "f4") Append<float>(array, &numbers);
  if (type == "f8") Append<double>(array, &numbers);
  if (type == "f2") {
    Append<uint16_t>(array, &numbers);
    for (double& number : numbers) number = Half(static_cast<uint16_t>(number));
  }
  return numbers;
}

Array FloatArray(const std::vector<double>& numbers, std::vector<int64_t> shape) {
  Array array{"<f4", std::move(shape), Bytes(4 * numbers.size())};
  for (size_t i = 0; i < numbers.size(); ++i) {
    const float number = static_cast<float>(numbers[i]);
    std::memcpy(&array.data[4 * i], &number, sizeof(number));
  }
  return array;
}

}  // namespace evalbus::policy
