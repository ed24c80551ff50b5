#include "base/text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <string_view>

namespace evalbus {

int Width(const std::string& text) {
  return static_cast<int>(std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}

std::string Cut(const std::string& text, int width) {
  int characters = 0;
  for (size_t i = 0; i < text.size(); ++i) {
    if ((text[i] & 0xC0) != 0x80 && ++characters > width) return text.substr(0, i);
  }
  return text;
}

std::string Pad(const std::string& text, int width) {
  const std::string space(static_cast<size_t>(std::max(0, std::abs(width) - Width(text))), ' ');
  return width < 0 ? text + space : space + text;
}

namespace {

struct Character {
  size_t bytes;
  char32_t code;
};

// Returns the first character of a string, which must not be empty; nullopt if its first bytes are not UTF-8.
std::optional<Character> FirstCharacter(std::string_view text) {
  const auto byte = [&](size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char lead = byte(0);
  if (lead < 0x80) return Character{1, lead};
  const size_t bytes = lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : 2;
  if (lead < 0xC0 || lead >= 0xF8 || text.size() < bytes) return std::nullopt;
  char32_t code = lead & (0x7F >> bytes);
  for (size_t i = 1; i < bytes; ++i) {
    if ((byte(i) & 0xC0) != 0x80) return std::nullopt;
    code = code << 6 | (byte(i) & 0x3F);
  }
  constexpr char32_t kLeast[] = {0, 0, 0x80, 0x800, 0x10000};  // smaller codes have shorter encodings
  const bool is_surrogate = code >= 0xD800 && code < 0xE000;
  if (code < kLeast[bytes] || is_surrogate || code > 0x10FFFF) return std::nullopt;
  return Character{bytes, code};
}

}  // namespace

std::string Printable(const std::string& text) {
  std::string printable;
  for (std::string_view rest = text; !rest.empty();) {
    const auto character = FirstCharacter(rest);
    const size_t bytes = character ? character->bytes : 1;
    // U+0080 to U+009F are also control characters; the last two codes of each plane are not characters.
    const bool is_shown = character && character->code >= 0x20 &&
                          !(character->code >= 0x7F && character->code < 0xA0) &&
                          (character->code & 0xFFFE) != 0xFFFE;
    printable += is_shown ? rest.substr(0, bytes) : "?";
    rest.remove_prefix(bytes);
  }
  return printable;
}

std::string ShellWords(const std::vector<std::string>& command) {
  std::string text;
  for (const std::string& word : command) {
    const bool is_plain = !word.empty() && std::ranges::all_of(word, [](unsigned char c) {
      return std::isalnum(c) || std::string_view("-_./:=,+@").find(static_cast<char>(c)) != std::string::npos;
    });
    text += text.empty() ? "" : " ";
    if (is_plain) {
      text += word;
      continue;
    }
    text += '\'';
    for (const char c : word) text += c == '\'' ? "'\\''" : std::string(1, c);
    text += '\'';
  }
  return text;
}

std::string Words(std::string name) {
  std::replace(name.begin(), name.end(), '_', ' ');
  return name;
}

std::string Fixed(double value, int decimals) {
  const std::string text = fmt::format("{:.{}f}", value, decimals);
  const bool is_nothing = text.find_first_not_of("-0.") == std::string::npos;
  return is_nothing && text[0] == '-' ? text.substr(1) : text;
}

std::string Number(double value, double error) {
  if (!std::isfinite(value)) return "-";
  const double magnitude = std::abs(value);
  if (magnitude >= 99999.5) return fmt::format("{:.0f}k", value * 1e-3);
  // A minus sign takes the place of one digit, except if no nonzero digit would remain.
  const bool shorter = value < -0.005;
  const int decimals = Decimals(shorter ? magnitude * 10 : magnitude, error);
  return Fixed(value, shorter ? std::min(2, decimals) : decimals);
}

int Decimals(double magnitude) {
  return magnitude >= 999.95 ? 0 : magnitude >= 99.995 ? 1 : magnitude >= 9.9995 ? 2 : 3;
}

int Decimals(double magnitude, double error) {
  const int most = Decimals(magnitude);
  if (!(error > 0) || !std::isfinite(error)) return most;
  return std::clamp(1 - static_cast<int>(std::floor(std::log10(error))), 0, most);
}

std::string RangesText(const std::vector<int>& numbers) {
  std::vector<std::string> ranges;
  for (size_t begin = 0; begin < numbers.size();) {
    size_t end = begin + 1;
    while (end < numbers.size() && numbers[end] == numbers[end - 1] + 1) ++end;
    if (end - begin > 2) {
      ranges.push_back(fmt::format("{} to {}", numbers[begin], numbers[end - 1]));
    } else {
      for (size_t i = begin; i < end; ++i) ranges.push_back(std::to_string(numbers[i]));
    }
    begin = end;
  }
  return fmt::format("{}", fmt::join(ranges, ", "));
}

}  // namespace evalbus
