// What all pages have in common: frame, style and script, and how numbers are written.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "viz/report/markup.h"
#include "viz/viewer/pack.h"

namespace evalbus::viz {

struct ReportLink {
  std::string text;
  std::string url;  // relative to the page; see Url()
};

// Links one after the other.
void Links(const std::vector<ReportLink>& links, Markup* html);

// A whole page with the title as its heading. `made_by`: version and commit. viewer: null for none; it is
// where the content calls WriteViewer().
std::string Page(const std::string& title, const std::string& made_by,
                 const std::function<void(Markup*)>& content, const PackedViewer* viewer = nullptr);

// The section of the episodes that can be looked at in 3D.
void WriteViewer(const PackedViewer& viewer, Markup* html);

// "95 %"; "-" for what is not finite.
std::string Percent(double share);

// A number with all its digits for programs (<data value>) and as `text` for people; "-" for what is not
// finite.
void Data(double value, const std::string& text, Markup* html);
void Data(double value, Markup* html);
// The same as a cell of a table.
void NumberCell(double value, const std::string& text, Markup* html);
void NumberCell(double value, Markup* html);

}  // namespace evalbus::viz
