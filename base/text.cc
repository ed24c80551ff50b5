#include "base/text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

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

std::string Printable(const std::string& text) {
  std::string printable;
  for (size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    // U+0080 to U+009F are control characters, too.
    const bool is_c1 = c == 0xC2 && i + 1 < text.size() && static_cast<unsigned char>(text[i + 1]) < 0xA0;
    printable += c < 0x20 || c == 0x7F || is_c1 ? '?' : text[i];
    i += is_c1;
  }
  return printable;
}

std::string Words(std::string name) {
  std::replace(name.begin(), name.end(), '_', ' ');
  return name;
}

std::string Number(double value) {
  if (!std::isfinite(value)) return "-";
  const double magnitude = std::abs(value);
  if (magnitude < 0.0005) return "0.000";  // without a sign that comes and goes
  if (magnitude >= 99999.5) return fmt::format("{:.0f}k", value * 1e-3);
  // A minus takes the place of a digit, unless none would be left.
  const bool shorter = value < -0.005;
  return fmt::format("{:.{}f}", value, shorter ? std::min(2, Decimals(magnitude * 10)) : Decimals(magnitude));
}

int Decimals(double magnitude) {
  return magnitude >= 999.95 ? 0 : magnitude >= 99.995 ? 1 : magnitude >= 9.9995 ? 2 : 3;
}

}  // namespace evalbus
