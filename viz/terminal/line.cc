#include "viz/terminal/line.h"

#include <algorithm>
#include <numeric>

#include "base/text.h"

namespace evalbus::viz {

int LineWidth(const Line& line) {
  return std::accumulate(line.begin(), line.end(), 0,
                         [](int sum, const Span& span) { return sum + Width(span.text); });
}

std::string LineText(const Line& line) {
  std::string text;
  for (const Span& span : line) text += span.text;
  return text.erase(text.find_last_not_of(' ') + 1);
}

std::string Fit(const std::string& text, int width) {
  return Pad(Width(text) > width ? Cut(text, std::max(0, width - 1)) + "…" : text, -width);
}

void Shorten(int width, Line* line) {
  std::string* last = line->empty() ? nullptr : &line->back().text;
  if (last != nullptr) last->erase(last->find_last_not_of(' ') + 1);
  if (LineWidth(*line) <= width) return;
  --width;
  for (Span& span : *line) {
    span.text = Cut(span.text, std::max(0, width));
    width -= Width(span.text);
  }
  line->push_back({"…"});
}

}  // namespace evalbus::viz
