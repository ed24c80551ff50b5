// Common parts of all pages: frame, style, script and number formats.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "report/page/markup.h"
#include "viz/viewer/pack.h"

namespace evalbus::report {

struct ReportLink {
  std::string text;
  std::string url;  // relative to the page; see Url()
};

// Writes the links one after the other.
void Links(const std::vector<ReportLink>& links, Markup* html);

// Returns a whole page with the title as heading. made_by: version and commit. viewer: null if the page has
// no viewer; otherwise `content` must call WriteViewer().
std::string Page(const std::string& title, const std::string& made_by,
                 const std::function<void(Markup*)>& content, const viz::PackedViewer* viewer = nullptr);

// Writes the section with the 3D episode viewer.
void WriteViewer(const viz::PackedViewer& viewer, Markup* html);

// Writes a number as <data>: the value with all digits, and `text` as shown; "-" if the value is not finite.
void Data(double value, const std::string& text, Markup* html);
void Data(double value, Markup* html);
// The same as a table cell.
void NumberCell(double value, const std::string& text, Markup* html);
void NumberCell(double value, Markup* html);

}  // namespace evalbus::report
