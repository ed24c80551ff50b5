#include <fmt/format.h>

#include "report/page/page.h"

namespace evalbus::report {

void Folded(const std::vector<std::function<void()>>& figures, size_t shown, const std::string& what,
            const char* css_class, Markup* html) {
  // One or two additional figures are shown, too, because folding them would save little space.
  if (figures.size() <= shown + 2) shown = figures.size();
  html->Element("div", {{"class", css_class}}, [&] {
    for (size_t i = 0; i < shown; ++i) figures[i]();
  });
  if (figures.size() == shown) return;
  html->Element("details", {{"class", "more"}}, [&] {
    html->Element("summary", {}, fmt::format("{} {}", figures.size() - shown, what));
    html->Element("div", {{"class", css_class}}, [&] {
      for (size_t i = shown; i < figures.size(); ++i) figures[i]();
    });
  });
}

}  // namespace evalbus::report
