#include "report/page/page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "base/json_file.h"
#include "report/page/assets.h"
#include "report/page/page_check.h"
#include "report/page/scale.h"

namespace evalbus::report {

namespace {

// Blocks get a script type that browsers do not execute.
void WriteScripts(const viz::PackedViewer& viewer, Markup* html) {
  for (const auto& [name, packed] : viewer.blocks) {
    html->Element("script", {{"type", "application/x-evalbus"}, {"data-block", name}}, packed);
  }
  const auto script = [&](const std::string& code) {
    html->Element("script", {}, [&] { html->Verbatim(code); });
  };
  script(viewer.libraries.three);
  script(viewer.libraries.orbit_controls);
  for (const viz::PageFile& file : viz::PageFiles()) {
    if (std::string_view(file.name).ends_with(".js")) script(file.text);
  }
}

}  // namespace

void WriteViewer(const viz::PackedViewer& viewer, Markup* html, const std::string& opened) {
  html->Element("section", {{"class", "in-3d"}}, [&] {
    html->Element("h2", {{"id", "in-3d"}}, "Episode player");
    html->Element("p", {{"class", "note"}}, viewer.note);
    html->Element("div", {{"id", "viewer"}, {"data-from", "page"}, {"data-open", opened}},
                  [&] { html->Element("noscript", {}, "The 3D view requires JavaScript."); });
  });
}

std::string Page(const std::string& title, const std::string& made_by, const nlohmann::ordered_json& source,
                 const std::function<void(Markup*)>& content, const viz::PackedViewer* viewer) {
  Markup html;
  html.Doctype();
  html.Element("html", {{"lang", "en"}}, [&] {
    html.Element("head", {}, [&] {
      html.Empty("meta", {{"charset", "utf-8"}});
      html.Empty("meta", {{"name", "viewport"}, {"content", "width=device-width, initial-scale=1"}});
      if (!source.is_null()) html.Empty("meta", {{"name", kSourceMeta}, {"content", ToText(source)}});
      // Without this element, browsers request /favicon.ico.
      html.Empty("link", {{"rel", "icon"}, {"href", "data:,"}});
      html.Element("title", {}, title);
      html.Element("style", {}, [&] { html.Verbatim(kReportCss); });
      if (viewer) html.Element("style", {}, [&] { html.Verbatim(viz::PageStyle()); });
    });
    html.Element("body", {}, [&] {
      html.Element("main", {}, [&] {
        html.Element("h1", {}, title);
        content(&html);
      });
      html.Element("footer", {}, kMadeBy + made_by + ".");
      html.Element("script", {}, [&] { html.Verbatim(kReportJs); });
      if (viewer) WriteScripts(*viewer, &html);
    });
  });
  return html.str() + "\n";
}

void Links(const std::vector<ReportLink>& links, Markup* html) {
  for (const ReportLink& link : links) {
    html->Element("a", {{"href", link.url}}, link.text);
    html->Text(" ");
  }
}

std::string PlayerUrl(const PlayerPlace& place, const results::Cause& cause,
                      const std::optional<PlayerPlace>& other) {
  constexpr double kBefore = 1;  // s
  std::string url = fmt::format("#view:run={},episode={}", place.run, place.episode);
  if (!cause.text.empty()) url += fmt::format(",t={:.3f}", std::max(0.0, cause.time_s - kBefore));
  if (other) url += fmt::format(",other={}/{}", other->run, other->episode);
  return url;
}

std::string WithMinus(std::string text) {
  const auto is_digit = [&](size_t i) { return i < text.size() && text[i] >= '0' && text[i] <= '9'; };
  for (size_t i = 0; i < text.size(); ++i) {
    const bool begins = i == 0 || text[i - 1] == ' ' || text[i - 1] == '(' || text[i - 1] == '[';
    if (text[i] == '-' && begins && is_digit(i + 1)) text.replace(i, 1, "−");
  }
  return text;
}

void Data(double value, const std::string& text, Markup* html) {
  if (!std::isfinite(value)) {
    html->Text("-");
  } else {
    html->Element("data", {{"value", fmt::format("{}", value)}}, WithMinus(text));
  }
}
void Data(double value, Markup* html) { Data(value, Number(value), html); }

void NumberCell(double value, const std::string& text, Markup* html) {
  html->Element("td", {{"class", "number"}}, [&] { Data(value, text, html); });
}
void NumberCell(double value, Markup* html) { NumberCell(value, Number(value), html); }

void ScrollingTable(Markup::Attributes attributes, const std::function<void()>& titles,
                    const std::function<void()>& rows, Markup* html) {
  html->Element("div", {{"class", "scroll"}, {"tabindex", "0"}}, [&] {
    html->Element("table", attributes, [&] {
      html->Element("thead", {}, [&] { html->Element("tr", {}, titles); });
      html->Element("tbody", {}, rows);
    });
  });
}

void LegendKey(const char* css_class, const std::string& text, Markup* html) {
  html->Element("span", {{"class", "key"}}, [&] {
    html->Element("i", {{"class", css_class}}, "");
    html->Text(text);
  });
}

void Folded(const std::vector<std::function<void()>>& figures, size_t shown, const std::string& what,
            const char* css_class, Markup* html) {
  // One or two additional figures are also shown, because folding them would save little space.
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
