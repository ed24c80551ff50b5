// JSON of a form that is known beforehand, read where it stands: for long files, of which each value would
// otherwise become a tree.
#pragma once

#include <bitset>
#include <charconv>
#include <cmath>
#include <span>
#include <string>
#include <string_view>
#include <system_error>

namespace evalbus {

inline std::string_view WithoutLeadingBlanks(std::string_view json) {
  size_t blanks = 0;
  while (blanks < json.size() &&
         (json[blanks] == ' ' || json[blanks] == '\n' || json[blanks] == '\r' || json[blanks] == '\t')) {
    ++blanks;
  }
  return json.substr(blanks);
}

// Takes one token or value after the other from the front of a text. False: something else is next, or the
// text ends there. Then all that was taken is to be read again by what knows all of JSON and says what is
// wrong, since this only takes what is surely right: it knows keys only as they are usually written, and no
// number that rounds to an infinity.
class JsonText {
 public:
  explicit JsonText(std::string_view text) : text_(text) {}

  std::string_view rest() const { return text_; }

  bool Take(char mark) {
    text_ = WithoutLeadingBlanks(text_);
    if (text_.empty() || text_[0] != mark) return false;
    text_.remove_prefix(1);
    return true;
  }
  bool TakeWord(std::string_view word) {
    text_ = WithoutLeadingBlanks(text_);
    if (!text_.starts_with(word)) return false;
    text_.remove_prefix(word.size());
    return true;
  }
  bool TakeBool(bool* value) {
    *value = TakeWord("true");
    return *value || TakeWord("false");
  }

  // The nearest double, as strtod() has it. A whole number has neither point nor exponent.
  bool TakeNumber(double* value, bool* whole = nullptr) {
    text_ = WithoutLeadingBlanks(text_);
    const char* const end = text_.data() + text_.size();
    // from_chars() takes more than JSON allows: inf, .5, 01 and 5.
    const char* const first = text_.data() + text_.starts_with('-');
    const char* digits_end = first;
    while (digits_end != end && IsDigit(*digits_end)) ++digits_end;
    if (digits_end == first || digits_end == end || (*first == '0' && digits_end - first > 1)) return false;
    if (*digits_end == '.' && (digits_end + 1 == end || !IsDigit(digits_end[1]))) return false;
    const auto [parsed, error] = std::from_chars(text_.data(), end, *value);
    // At the end of the text it may be cut off.
    if (error != std::errc() || parsed == end || !std::isfinite(*value)) return false;
    // Of whole numbers there is one zero: -0 becomes 0.
    if (parsed == digits_end) *value += 0.0;
    if (whole) *whole = parsed == digits_end;
    text_.remove_prefix(parsed - text_.data());
    return true;
  }

  // Exactly that many.
  bool TakeNumbers(std::span<double> values) {
    if (!Take('[')) return false;
    for (size_t k = 0; k < values.size(); ++k) {
      if ((k > 0 && !Take(',')) || !TakeNumber(&values[k])) return false;
    }
    return Take(']');
  }

  // An array, take_element() takes each element.
  template <class TakeElement>
  bool TakeArray(TakeElement take_element) {
    if (!Take('[')) return false;
    if (Take(']')) return true;
    do {
      if (!take_element()) return false;
    } while (Take(','));
    return Take(']');
  }

  // An object of exactly these keys, each as JSON has it ("\"t\""), in any order; take_value(k) takes the
  // k-th's value.
  template <class TakeValue>
  bool TakeObject(std::span<const std::string> keys, TakeValue take_value) {
    std::bitset<64> seen;
    if (keys.size() > seen.size() || !Take('{')) return false;
    for (size_t n = 0; n < keys.size(); ++n) {
      if (n > 0 && !Take(',')) return false;
      // Mostly they come in this order.
      size_t key = n, tried = 0;
      for (; tried < keys.size() && !TakeWord(keys[key]); ++tried) key = (key + 1) % keys.size();
      if (tried == keys.size() || seen[key] || !Take(':') || !take_value(key)) return false;
      seen.set(key);
    }
    return Take('}');
  }

 private:
  static bool IsDigit(char c) { return c >= '0' && c <= '9'; }

  std::string_view text_;
};

}  // namespace evalbus
