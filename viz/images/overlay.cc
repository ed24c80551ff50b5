#include "viz/images/overlay.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/errors.h"
#include "base/text.h"
#include "lcmtypes/end_reason.h"
#include "lcmtypes/metric_catalog.h"
#include "lcmtypes/source.h"
#include "viz/images/canvas.h"
#include "viz/images/colors.h"

namespace evalbus::viz {
namespace {

// Sizes in pixels for an image 480 pixels high.
constexpr double kMargin = 12, kPadding = 9, kRadius = 5, kBold = 13.5, kSmall = 11.5, kLine = 17, kDot = 4.2;

constexpr Color kPanel{0.07, 0.08, 0.10, 0.66}, kText{0.97, 0.97, 0.97}, kDim{0.74, 0.76, 0.79};

std::string EndLabel(const std::string& end_reason) {
  std::string text = Words(end_reason);
  for (char& c : text) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return text;
}

// Draws a filled disc or a ring.
void Dot(Canvas* canvas, double x, double y, bool filled, const Color& color) {
  filled ? canvas->Disc({x, y}, kDot, color) : canvas->Ring({x, y}, kDot - 0.7, 1.4, color);
}

// Draws the time at the top right and, once the episode has ended, the outcome next to it.
void DrawTime(const OverlayText& text, Canvas* canvas) {
  const std::string verdict = EndLabel(text.end_reason);
  const double time_width = std::max(58.0, canvas->TextWidth(text.clock, Font::kBold, kBold));
  double right = canvas->width - kMargin;
  canvas->Panel({right - time_width - 2 * kPadding, kMargin, time_width + 2 * kPadding, 26}, kRadius, kPanel);
  canvas->TextBefore(right - kPadding, kMargin + 18, text.clock, Font::kBold, kBold, kText);
  if (!verdict.empty()) {
    right -= time_width + 2 * kPadding + 6;
    const double width = canvas->TextWidth(verdict, Font::kBold, kBold) + 2 * kPadding;
    canvas->Panel({right - width, kMargin, width, 26}, kRadius,
                  text.end_reason == end_reason::kSuccess ? kSuccessColor : kFailureColor);
    canvas->Text(right - width + kPadding, kMargin + 18, verdict, Font::kBold, kBold, kText);
  }
}

}  // namespace

std::string EpisodeSubtitle(int32_t episode) { return fmt::format("episode {}", episode); }

std::string MakerText(const std::string& policy, const std::string& robot) {
  constexpr int kLongest = 40;
  std::string text = Printable(policy);
  if (Width(text) > kLongest) text = Cut(text, kLongest - 1) + "…";
  return text + (text.empty() ? "" : " on ") + Printable(robot);
}

void AddScores(const metric_values_t& metrics, OverlayText* text) {
  text->stages.clear();
  for (size_t i = 0; i < metrics.stage_name.size(); ++i) {
    text->stages.push_back({metrics.stage_name[i], metrics.stage_reached[i] != 0});
  }
  text->counts.clear();
  for (const MetricInfo& metric : Metrics()) {
    if (!metric.count || !IsTracked(metric, metrics) || metrics.*metric.count == kUnavailableCount) continue;
    text->counts.emplace_back(metric.label, metrics.*metric.count);
  }
}

OverlayAmount ParseOverlay(const std::string& name) {
  if (name == "none") return OverlayAmount::kNone;
  if (name == "small") return OverlayAmount::kSmall;
  if (name == "full") return OverlayAmount::kFull;
  throw InputError("--overlay " + name + ": expected none, small or full");
}

Overlay::Overlay(FrameSize size, OverlayAmount amount)
    : scale_(std::max(0.5, size.height / 480.0)), amount_(amount) {
  LoadFonts();
}

void Overlay::Draw(const OverlayText& text, Frame* frame) const {
  if (amount_ == OverlayAmount::kNone) return;
  Canvas canvas(frame, scale_);
  DrawTime(text, &canvas);
  if (amount_ == OverlayAmount::kSmall) return;

  // Title, subtitle, policy and robot are at the top left.
  const double title_width = std::max({canvas.TextWidth(text.title, Font::kBold, kBold),
                                       canvas.TextWidth(text.subtitle, Font::kNormal, kSmall),
                                       canvas.TextWidth(text.maker, Font::kNormal, kSmall)});
  canvas.Panel({kMargin, kMargin, title_width + 2 * kPadding, text.maker.empty() ? 42. : 58.}, kRadius,
               kPanel);
  canvas.Text(kMargin + kPadding, kMargin + 18, text.title, Font::kBold, kBold, kText);
  canvas.Text(kMargin + kPadding, kMargin + 34, text.subtitle, Font::kNormal, kSmall, kDim);
  canvas.Text(kMargin + kPadding, kMargin + 50, text.maker, Font::kNormal, kSmall, kDim);

  // Stages are at the bottom left.
  if (!text.stages.empty()) {
    double width = 0;
    for (const OverlayText::Stage& stage : text.stages) {
      width = std::max(width, canvas.TextWidth(Words(stage.name), Font::kNormal, kSmall));
    }
    const double height = kLine * static_cast<double>(text.stages.size()) + 8;
    double y = canvas.height - kMargin - height;
    canvas.Panel({kMargin, y, width + 2 * kPadding + 15, height}, kRadius, kPanel);
    y += kLine;
    for (const OverlayText::Stage& stage : text.stages) {
      Dot(&canvas, kMargin + kPadding + kDot, y - 4, stage.reached, stage.reached ? kSuccessOnDark : kDim);
      canvas.Text(kMargin + kPadding + 15, y, Words(stage.name), Font::kNormal, kSmall,
                  stage.reached ? kText : kDim);
      y += kLine;
    }
  }

  // Counts of slips and similar events are at the bottom right.
  if (!text.counts.empty()) {
    std::vector<std::string> lines;
    double width = 0;
    for (const auto& [label, count] : text.counts) {
      lines.push_back(fmt::format("{} {}", label, count));
      width = std::max(width, canvas.TextWidth(lines.back(), Font::kNormal, kSmall));
    }
    const double height = kLine * static_cast<double>(lines.size()) + 8;
    const double left = canvas.width - kMargin - width - 2 * kPadding;
    double y = canvas.height - kMargin - height;
    canvas.Panel({left, y, width + 2 * kPadding, height}, kRadius, kPanel);
    for (const std::string& line : lines) {
      canvas.Text(left + kPadding, y += kLine, line, Font::kNormal, kSmall, kText);
    }
  }
}

}  // namespace evalbus::viz
