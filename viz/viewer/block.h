// A block of the viewer's data: a JSON head followed by binary arrays (docs/viewer_data.md).
#pragma once

#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <type_traits>
#include <vector>

namespace evalbus::viz {

// Returns the name of T, which is the "type" of an array in the head.
template <class T>
constexpr const char* TypeName() {
  if constexpr (std::is_same_v<T, uint8_t>) return "u8";
  if constexpr (std::is_same_v<T, int16_t>) return "i16";
  if constexpr (std::is_same_v<T, uint16_t>) return "u16";
  if constexpr (std::is_same_v<T, int32_t>) return "i32";
  if constexpr (std::is_same_v<T, uint32_t>) return "u32";
  if constexpr (std::is_same_v<T, float>) return "f32";
}

// Converts a number to JSON. NaN and infinity become null, because JSON does not have them.
inline nlohmann::ordered_json NumberOrNull(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json();
}

class BlockWriter {
 public:
  explicit BlockWriter(const std::string& kind) { head_["block"] = kind; }

  // Members of the head, except "block" and "arrays".
  nlohmann::ordered_json& head() { return head_; }

  // Adds a row-major array. The number of values must be the product of the shape. Returns the array's
  // description in the head, to which scale and origin can be added.
  template <class T>
  nlohmann::ordered_json& Add(const std::string& name, const std::vector<size_t>& shape,
                              const std::vector<T>& values) {
    return Add(name, TypeName<T>(), shape, values.data(), values.size() * sizeof(T));
  }
  // Adds an array, stored as differences along the last axis. Differences wrap around in type T.
  template <class T>
  nlohmann::ordered_json& AddDeltas(const std::string& name, const std::vector<size_t>& shape,
                                    std::vector<T> values) {
    const size_t row = shape.back();
    for (size_t end = values.size(); row > 0 && end > 0; end -= row) {
      for (size_t i = end - 1; i > end - row; --i) {
        using Bits = std::make_unsigned_t<T>;
        values[i] = static_cast<T>(
            static_cast<Bits>(static_cast<Bits>(values[i]) - static_cast<Bits>(values[i - 1])));
      }
    }
    nlohmann::ordered_json& array = Add(name, shape, values);
    array["delta"] = true;
    return array;
  }

  // Returns the block. Strings in the head may contain arbitrary bytes from external sources. They are made
  // printable (base/text.h).
  std::string Bytes() const;

 private:
  nlohmann::ordered_json& Add(const std::string& name, const char* type, const std::vector<size_t>& shape,
                              const void* data, size_t bytes);

  nlohmann::ordered_json head_ = nlohmann::ordered_json::object();
  nlohmann::ordered_json arrays_ = nlohmann::ordered_json::object();
  std::string data_;
};

// Parses a block in the same way as the page.
class BlockReader {
 public:
  // Throws InputError if the head is truncated or not JSON.
  explicit BlockReader(const std::string& bytes);

  const nlohmann::ordered_json& head() const { return head_; }
  bool Has(const std::string& array) const { return head_["arrays"].contains(array); }
  std::vector<size_t> Shape(const std::string& array) const;
  // Returns the values of an array: sums up differences, and applies scale and origin. Throws InputError if
  // the array does not exist or is truncated.
  std::vector<double> Values(const std::string& array) const;
  // Returns an array's bytes without decoding.
  std::string Raw(const std::string& array) const;

 private:
  const nlohmann::ordered_json& Find(const std::string& array) const;

  nlohmann::ordered_json head_;
  std::string data_;
};

}  // namespace evalbus::viz
