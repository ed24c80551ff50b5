// What travels between us and a policy server, whatever bytes a wire makes of it: a tree of maps, lists,
// numbers, texts and arrays of numbers.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

namespace evalbus::policy {

// An array of numbers as NumPy has it: C order, little endian.
struct Array {
  // NumPy's: "|u1", "|b1", "<i4", "<i8", "<f4", "<f8", ...
  std::string dtype;
  // Empty: one number.
  std::vector<int64_t> shape;
  std::vector<uint8_t> data;

  friend bool operator==(const Array&, const Array&) = default;
};

class Value;
using Bytes = std::vector<uint8_t>;
using List = std::vector<Value>;
// In the order in which it was written; some servers go by it.
using Map = std::vector<std::pair<std::string, Value>>;

class Value {
 public:
  using Variant = std::variant<std::nullptr_t, bool, int64_t, double, std::string, Bytes, Array, List, Map>;

  Value() = default;
  // From anything that Variant can be made of, and from an int or a text.
  template <class T>
  requires(!std::is_same_v<std::decay_t<T>, Value> && std::is_constructible_v<Variant, T>)
      // NOLINTNEXTLINE(bugprone-forwarding-reference-overload): clang-tidy 14 does not see what it requires
      Value(T&& value)
      : value_(std::forward<T>(value)) {}
  Value(int value) : value_(int64_t{value}) {}
  Value(const char* text) : value_(std::string(text)) {}

  template <class T>
  bool Is() const {
    return std::holds_alternative<T>(value_);
  }
  // Null if it is something else.
  template <class T>
  const T* As() const {
    return std::get_if<T>(&value_);
  }
  template <class T>
  T* As() {
    return std::get_if<T>(&value_);
  }
  const Variant& variant() const { return value_; }

  // Of a map; null where it is no map or has no such key.
  const Value* Find(std::string_view key) const;

  friend bool operator==(const Value&, const Value&) = default;

 private:
  Variant value_;
};

// "map of 3", "array <f4 [10, 16]", "text \"lift the pot\"": what a message for people says of a value; cut
// to a line.
std::string Describe(const Value& value);

// Bytes of one number of this dtype; 0 for what no wire of ours carries (objects, complex numbers, texts).
size_t ItemSize(std::string_view dtype);

// How many numbers an array of this shape has; nothing where an extent is negative or above 2^31, or where
// there are too many to count.
std::optional<size_t> ItemCount(const std::vector<int64_t>& shape);

// The numbers of an array of booleans, integers or floats, as they are. Throws ServerError for a dtype that
// has none, or where data and shape do not fit.
std::vector<double> Numbers(const Array& array);

Array FloatArray(const std::vector<double>& numbers, std::vector<int64_t> shape);  // "<f4"

}  // namespace evalbus::policy
