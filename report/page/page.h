// Common parts of all pages: the HTML document, style, script and number formats.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "report/page/markup.h"
#include "results/run_reader.h"
#include "viz/viewer/page_files.h"

namespace evalbus::report {

struct ReportLink {
  std::string text;
  std::string url;  // relative to the page; see Url()
};

// Writes the links in a row.
void Links(const std::vector<ReportLink>& links, Markup* html);

// Attribute of elements that do not show results. `evalbus verify` does not compare them (page_check.h).
inline constexpr char kUnchecked[] = "data-unchecked";

// Returns a whole page with the title as heading. made_by: version and commit. source: arguments and folders
// from which `evalbus verify` can generate the page again; null if it cannot. viewer: null if the page has no
// viewer; otherwise `content` must call WriteViewer().
std::string Page(const std::string& title, const std::string& made_by, const nlohmann::ordered_json& source,
                 const std::function<void(Markup*)>& content, const viz::PackedViewer* viewer = nullptr);

// Writes the section with the 3D episode viewer. opened: URL fragment of the episode that it shows first;
// empty: the first failure.
void WriteViewer(const viz::PackedViewer& viewer, Markup* html, const std::string& opened = "");

// An episode in the 3D viewer. run: number of the run on the page.
struct PlayerPlace {
  int run, episode;
};
// Returns the URL fragment that plays the episode from one second before its decisive moment, or from its
// beginning if the moment is not known. other: an episode that is shown for comparison.
std::string PlayerUrl(const PlayerPlace& place, const results::Cause& cause,
                      const std::optional<PlayerPlace>& other = {});

// Replaces hyphens before numbers by minus signs.
std::string WithMinus(std::string text);

// Writes a number as a <data> element, whose value has all digits and whose content is `text`; "-" if the
// value is not finite.
void Data(double value, const std::string& text, Markup* html);
void Data(double value, Markup* html);
// Writes a table cell that contains Data().
void NumberCell(double value, const std::string& text, Markup* html);
void NumberCell(double value, Markup* html);

// Writes a table that scrolls sideways if it is wider than the page. titles: writes the cells of the head.
// rows: writes the rows of the body.
void ScrollingTable(Markup::Attributes attributes, const std::function<void()>& titles,
                    const std::function<void()>& rows, Markup* html);

// Writes the meaning of a color in a figure's legend.
void LegendKey(const char* css_class, const std::string& text, Markup* html);

// A square of a row of squares, one per episode or per pair of episodes.
struct StripCell {
  // CSS class: "good", "bad" or "incomplete"; see Outcome() in report_sections.h.
  std::string css_class;
  std::string text;   // a few characters in the square
  std::string title;  // tooltip of the square
  std::string url;
};

// Writes the columns from left to right, each with its cells from top to bottom. All columns must have the
// same number of cells. If there are more than 200 columns, neighbors are combined, and the filled part of a
// square shows their share of successes. The strip is hidden from assistive technology, which uses the table
// of episodes instead.
void WriteStrip(const std::vector<std::vector<StripCell>>& columns, Markup* html);

// Returns the number of neighbors that a square combines; 1 for up to 200 columns.
size_t ColumnsPerSquare(size_t columns);

// Shows the first `shown` figures in an element of class css_class. The others are in an expandable element
// with the label `what`; if there are at most two others, all are shown.
void Folded(const std::vector<std::function<void()>>& figures, size_t shown, const std::string& what,
            const char* css_class, Markup* html);

}  // namespace evalbus::report
