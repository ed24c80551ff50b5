#include <fmt/format.h>

#include <algorithm>
#include <span>

#include "report/page/page.h"

namespace evalbus::report {
namespace {

constexpr size_t kMaxColumns = 200;

void Square(const StripCell& cell, Markup* html) {
  const char* const name = cell.url.empty() ? "span" : "a";
  html->Open(name, {{"class", cell.css_class}, {"title", cell.title}});
  if (!cell.url.empty()) html->Attribute("href", cell.url);
  if (!cell.url.empty()) html->Attribute("tabindex", "-1");
  html->Text(cell.text);
  html->Close();
}

// Writes a square that stands for several cells of one row. It links to their first failure.
void CombinedSquare(std::span<const StripCell* const> cells, Markup* html) {
  const auto successes = std::ranges::count(cells, std::string("good"), &StripCell::css_class);
  const auto failed = std::ranges::find(cells, std::string("bad"), &StripCell::css_class);
  const StripCell& first = failed == cells.end() ? *cells.front() : **failed;
  const double percent = 100.0 * static_cast<double>(successes) / static_cast<double>(cells.size());
  html->Open(first.url.empty() ? "span" : "a",
             {{"class", "combined"},
              {"title", fmt::format("{} to {}: {} of {} succeeded", cells.front()->text, cells.back()->text,
                                    successes, cells.size())},
              {"style", fmt::format("--share:{:.1f}%", percent)}});
  if (!first.url.empty()) html->Attribute("href", first.url);
  if (!first.url.empty()) html->Attribute("tabindex", "-1");
  html->Text("");
  html->Close();
}

}  // namespace

size_t ColumnsPerSquare(size_t columns) {
  size_t size = 1;
  // A square combines 1, 10, 20, 50, 100, 200, ... columns.
  for (const size_t next : {10, 20, 50, 100, 200, 500, 1000, 2000, 5000}) {
    if (columns <= size * kMaxColumns) break;
    size = next;
  }
  return size;
}

void WriteStrip(const std::vector<std::vector<StripCell>>& columns, Markup* html) {
  const size_t size = ColumnsPerSquare(columns.size());
  html->Element("div", {{"class", "strip"}, {"aria-hidden", "true"}}, [&] {
    for (size_t begin = 0; begin < columns.size(); begin += size) {
      const size_t end = std::min(begin + size, columns.size());
      html->Element("span", {{"class", "column"}}, [&] {
        for (size_t row = 0; row < columns[begin].size(); ++row) {
          if (size == 1) {
            Square(columns[begin][row], html);
            continue;
          }
          std::vector<const StripCell*> cells;
          for (size_t i = begin; i < end; ++i) cells.push_back(&columns[i][row]);
          CombinedSquare(cells, html);
        }
      });
    }
  });
}

}  // namespace evalbus::report
