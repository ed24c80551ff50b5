// Common parts of all pages: frame, style, script and number formats.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "report/page/markup.h"
#include "results/run_reader.h"
#include "viz/viewer/pack.h"

namespace evalbus::report {

struct ReportLink {
  std::string text;
  std::string url;  // relative to the page; see Url()
};

// Writes the links one after the other.
void Links(const std::vector<ReportLink>& links, Markup* html);

// Attribute of elements that do not show results: `evalbus verify` does not compare them (page_check.h).
inline constexpr char kUnchecked[] = "data-unchecked";

// Returns a whole page with the title as heading. made_by: version and commit. source: what the page was made
// from, for `evalbus verify`, which makes it again; null if it cannot. viewer: null if the page has no
// viewer; otherwise `content` must call WriteViewer().
std::string Page(const std::string& title, const std::string& made_by, const nlohmann::ordered_json& source,
                 const std::function<void(Markup*)>& content, const viz::PackedViewer* viewer = nullptr);

// Writes the section with the 3D episode viewer. opened: fragment of the episode that it shows first; empty:
// the first failure.
void WriteViewer(const viz::PackedViewer& viewer, Markup* html, const std::string& opened = "");

// An episode in the 3D viewer: number of the run on the page, and of the episode.
struct PlayerPlace {
  int run, episode;
};
// Returns the URL fragment that shows the episode from one second before its decisive moment on, or from its
// beginning if the moment is not known; other: an episode to compare it with.
std::string PlayerUrl(const PlayerPlace& place, const results::Cause& cause,
                      const std::optional<PlayerPlace>& other = {});

// Replaces hyphens before numbers by minus signs.
std::string WithMinus(std::string text);

// Writes a number as <data>: the value with all digits, and `text` as shown; "-" if the value is not finite.
void Data(double value, const std::string& text, Markup* html);
void Data(double value, Markup* html);
// The same as a table cell.
void NumberCell(double value, const std::string& text, Markup* html);
void NumberCell(double value, Markup* html);

}  // namespace evalbus::report
