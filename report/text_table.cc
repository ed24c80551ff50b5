#include "report/text_table.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cctype>
#include <string_view>

#include "base/text.h"

namespace evalbus::report {
namespace {

std::string LatexCell(const std::string& text) {
  std::string escaped;
  const std::string printable = Printable(text);
  for (size_t i = 0; i < printable.size(); ++i) {
    const char c = printable[i];
    // True for a minus sign, false for a hyphen.
    const bool is_sign = c == '-' && (i == 0 || printable[i - 1] == ' ') && i + 1 < printable.size() &&
                         std::isdigit(static_cast<unsigned char>(printable[i + 1]));
    switch (c) {
      case '-':
        escaped += is_sign ? "$-$" : "-";
        break;
      case '\\':
        escaped += "\\textbackslash{}";
        break;
      case '~':
        escaped += "\\textasciitilde{}";
        break;
      case '^':
        escaped += "\\textasciicircum{}";
        break;
      // In text mode, LaTeX's default fonts show other characters for these.
      case '<':
      case '>':
        escaped += fmt::format("${}$", c);
        break;
      default:
        if (std::string_view("&%$#_{}").find(c) != std::string_view::npos) escaped += '\\';
        escaped += c;
    }
  }
  return escaped;
}

}  // namespace

std::string MarkdownCell(const std::string& text) {
  std::string escaped;
  for (const char c : Printable(text)) {
    if (c == '<') {
      escaped += "&lt;";
      continue;
    }
    if (std::string_view("\\`*_[]|#>").find(c) != std::string_view::npos) escaped += '\\';
    escaped += c;
  }
  return escaped;
}

std::string MarkdownTable(const TextTable& table) {
  const auto row = [](const std::vector<std::string>& cells) {
    std::string line = "|";
    for (const std::string& cell : cells) line += " " + MarkdownCell(cell) + " |";
    return line + "\n";
  };
  std::string text = row(table.header) + "|---|";
  for (size_t i = 1; i < table.header.size(); ++i) text += "---:|";
  text += "\n";
  for (const auto& cells : table.rows) text += row(cells);
  return text;
}

std::string LatexTable(const TextTable& table) {
  const auto row = [](const std::vector<std::string>& cells) {
    std::vector<std::string> escaped;
    for (const std::string& cell : cells) escaped.push_back(LatexCell(cell));
    return fmt::format("{} \\\\\n", fmt::join(escaped, " & "));
  };
  std::string text = fmt::format("\\begin{{tabular}}{{l{}}}\n\\toprule\n{}\\midrule\n",
                                 std::string(table.header.size() - 1, 'r'), row(table.header));
  for (const auto& cells : table.rows) text += row(cells);
  return text + "\\bottomrule\n\\end{tabular}\n";
}

}  // namespace evalbus::report
