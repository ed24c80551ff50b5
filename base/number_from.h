// Parses numbers.
#pragma once

#include <charconv>
#include <optional>
#include <string_view>

namespace evalbus {

// Parses the whole text as a number of type T. Returns nullopt if the text contains anything else, such as
// spaces or a plus sign, or if the number is out of range.
template <class T>
std::optional<T> NumberFrom(std::string_view text) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(value) : std::nullopt;
}

}  // namespace evalbus
