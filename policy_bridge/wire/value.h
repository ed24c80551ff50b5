// Data exchanged with a policy server, independent of the wire's encoding: a tree of maps, lists, numbers,
// strings and arrays of numbers.
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

// An array of numbers as in NumPy, in C order and little endian.
struct Array {
  // NumPy's type string, such as "|u1", "|b1", "<i4", "<i8", "<f4" or "<f8".
  std::string dtype;
  // Extents of the axes. Empty: a single number.
  std::vector<int64_t> shape;
  std::vector<uint8_t> data;

  friend bool operator==(const Array&, const Array&) = default;
};

class Value;
using Bytes = std::vector<uint8_t>;
using List = std::vector<Value>;
// A map keeps its entries in insertion order, because some servers depend on the order.
using Map = std::vector<std::pair<std::string, Value>>;

class Value {
 public:
  using Variant = std::variant<std::nullptr_t, bool, int64_t, double, std::string, Bytes, Array, List, Map>;

  Value() = default;
  // Constructs a value from anything from which Variant can be constructed, and from an int or a string.
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
  // Returns the value as a T, or null if it has a different type.
  template <class T>
  const T* As() const {
    return std::get_if<T>(&value_);
  }
  template <class T>
  T* As() {
    return std::get_if<T>(&value_);
  }
  const Variant& variant() const { return value_; }
  // Returns an integer or floating-point value as a double; nullopt for other types.
  std::optional<double> Number() const;

  // Returns the value of a key. Returns null if this is not a map or the key is missing.
  const Value* Find(std::string_view key) const;

  friend bool operator==(const Value&, const Value&) = default;

 private:
  Variant value_;
};

// Returns a description of a value in one line for messages, such as "map of 3", "array <f4 [10, 16]" or
// "text \"lift the pot\"".
std::string Describe(const Value& value);

// Returns a string unchanged, and describes any other value.
std::string TextOrDescription(const Value& value);

// Returns the number of bytes per number of this dtype; 0 if no wire supports the dtype (objects, complex
// numbers, strings).
size_t ItemSize(std::string_view dtype);

// Returns the number of elements of an array with this shape. Unset if an extent is negative or above 2^31,
// or if the product overflows.
std::optional<size_t> ItemCount(const std::vector<int64_t>& shape);

// Returns the numbers of an array of booleans, integers or floats. Values are not rescaled: uint8 stays in 0
// to 255. Throws ServerError for any other dtype, or if data and shape do not match.
std::vector<double> Numbers(const Array& array);

Array FloatArray(const std::vector<double>& numbers, std::vector<int64_t> shape);  // "<f4"

}  // namespace evalbus::policy
