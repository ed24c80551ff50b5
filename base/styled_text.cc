#include "base/styled_text.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <string_view>

#include "base/text.h"

namespace evalbus {
namespace {

// Colors close to bluish green and vermilion of the Okabe-Ito palette, distinguishable for color-blind users.
const char* Code(Style style) {
  return style == Style::kStrong  ? "\x1b[1m"
         : style == Style::kQuiet ? "\x1b[2m"
         : style == Style::kGood  ? "\x1b[38;5;36m"
         : style == Style::kBad   ? "\x1b[38;5;202m"
                                  : "";
}

}  // namespace

bool UsesColors(std::FILE* out) {
  const auto value = [](const char* variable) {
    const char* text = std::getenv(variable);
    return std::string_view(text == nullptr ? "" : text);
  };
  return isatty(fileno(out)) != 0 && value("NO_COLOR").empty() && value("TERM") != "dumb";
}

std::string Styled(const std::string& text, Style style, bool colors) {
  const char* const code = colors ? Code(style) : "";
  return code + Printable(text) + (*code != '\0' ? "\x1b[0m" : "");
}

std::string Sparkline(std::span<const double> values, int width) {
  constexpr std::array<const char*, 8> kBars = {"▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
  const size_t bars = std::min(values.size(), static_cast<size_t>(std::max(0, width)));
  std::string text;
  for (size_t i = 0; i < bars; ++i) {
    const double value = values[(i + 1) * values.size() / bars - 1];
    const auto height = std::lround(std::clamp(value, 0.0, 1.0) * (kBars.size() - 1));
    text += kBars[static_cast<size_t>(height)];
  }
  return text;
}

}  // namespace evalbus
