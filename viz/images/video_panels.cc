#include "viz/images/video_panels.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "base/text.h"
#include "viz/images/colors.h"

namespace evalbus::viz {
namespace {

using Kind = VideoMark::Kind;

constexpr Color kPage{0.984, 0.984, 0.98}, kText{0.12, 0.14, 0.16}, kDim{0.40, 0.43, 0.47},
    kRule{0.82, 0.84, 0.86}, kWhite{1, 1, 1};
constexpr Color kSky{0.337, 0.706, 0.914}, kSlipColor{0.725, 0.529, 0};
constexpr Color kLines[] = {kLeftArmColor, kRightArmColor, kDim, {0.416, 0.353, 0.804}};
// Font sizes in layout units.
constexpr double kBold = 17, kNormal = 14.5, kSmall = 13, kAxis = 11;

Color Faded(Color color, double share) {
  color.a = share;
  return color;
}

Color ColorOf(VideoEnd end) {
  return end == VideoEnd::kSuccess ? kSuccessColor : end == VideoEnd::kFailure ? kFailureColor : kRule;
}

std::string Capital(std::string text) {
  if (!text.empty()) text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  return text;
}

std::string OutcomeWords(const VideoFacts& facts) {
  return facts.outcome.empty() ? "The log ends here" : Capital(Words(facts.outcome));
}

std::string TimeText(double time_s) { return fmt::format("{:.2f} s", time_s); }

}  // namespace

VideoEnd EndOf(const VideoFacts& facts) {
  if (facts.outcome.empty()) return VideoEnd::kNone;
  return facts.success ? VideoEnd::kSuccess : VideoEnd::kFailure;
}

void VideoPanels::Page() { Blank({0, 0, canvas_.width, canvas_.height}); }

void VideoPanels::Blank(const Box& box) { canvas_.Fill(box, kPage); }

void VideoPanels::Header(const Box& box, const std::string& title, const std::string& subtitle,
                         const std::string& right) {
  const double base = box.y + box.height / 2 + 0.36 * kBold * s_, margin = 14 * s_;
  const double right_width = canvas_.TextWidth(right, Font::kBold, kBold * s_);
  canvas_.TextBefore(box.right() - margin, base, right, Font::kBold, kBold * s_, kText);
  const double room = box.width - 3 * margin - right_width;
  const std::string first = canvas_.Fitted(title, Font::kBold, kBold * s_, room * 0.55);
  canvas_.Text(box.x + margin, base, first, Font::kBold, kBold * s_, kText);
  const double used = canvas_.TextWidth(first, Font::kBold, kBold * s_) + margin;
  canvas_.Text(box.x + margin + used, base,
               canvas_.Fitted(subtitle, Font::kNormal, kNormal * s_, room - used), Font::kNormal,
               kNormal * s_, kDim);
}

void VideoPanels::Title(const Box& box, const VideoFacts& facts, const std::string& name, bool is_over) {
  const double base = box.y + box.height / 2 + 0.36 * kBold * s_;
  double right = box.right();
  if (is_over) {
    const std::string words = canvas_.Fitted(OutcomeWords(facts) + " at " + TimeText(facts.outcome_s),
                                             Font::kBold, kNormal * s_, box.width * 0.55);
    right -= canvas_.TextWidth(words, Font::kBold, kNormal * s_);
    canvas_.Text(right, base, words, Font::kBold, kNormal * s_, ColorOf(EndOf(facts)));
    right -= 14 * s_;
    if (EndOf(facts) != VideoEnd::kNone) Verdict({right, box.y + box.height / 2}, 8 * s_, EndOf(facts));
    right -= 18 * s_;
  }
  canvas_.Text(box.x, base, canvas_.Fitted(name, Font::kBold, kBold * s_, right - box.x), Font::kBold,
               kBold * s_, kText);
}

void VideoPanels::Stages(const Box& box, const VideoFacts& facts, double time_s) {
  if (facts.stages.empty()) return;
  const double line = 20 * s_;
  const auto is_reached = [&](const StageRow& stage) {
    return stage.reached && stage.time >= 0 && stage.time <= time_s;
  };
  const auto num_reached = std::ranges::count_if(facts.stages, is_reached);
  double y = box.y + 14 * s_;
  canvas_.Text(box.x, y, fmt::format("Stages {} of {}", num_reached, facts.stages.size()), Font::kBold,
               kSmall * s_, kText);
  const size_t rows = std::max<size_t>(1, static_cast<size_t>((box.bottom() - y) / line));
  // If there are too many stages, only stages around the first unreached stage are shown.
  size_t first = 0;
  if (facts.stages.size() > rows) {
    const auto missing = std::ranges::find_if_not(facts.stages, is_reached) - facts.stages.begin();
    first = std::min(facts.stages.size() - rows, static_cast<size_t>(std::max<ptrdiff_t>(0, missing - 2)));
  }
  for (size_t i = first; i < std::min(facts.stages.size(), first + rows); ++i) {
    const StageRow& stage = facts.stages[i];
    const bool reached = is_reached(stage);
    y += line;
    const Point mark{box.x + 7 * s_, y - 5 * s_};
    if (reached) {
      canvas_.Disc(mark, 7 * s_, kSuccessColor);
      Check(mark, 7 * s_, kWhite);
    } else {
      canvas_.Ring(mark, 6.2 * s_, 1.5 * s_, kRule);
    }
    const std::string time = reached ? TimeText(stage.time) : "";
    const double left = box.x + 21 * s_, time_width = 62 * s_;
    canvas_.Text(left, y,
                 canvas_.Fitted(stage.name, Font::kNormal, kSmall * s_, box.right() - left - time_width),
                 Font::kNormal, kSmall * s_, reached ? kText : kDim);
    canvas_.TextBefore(box.right(), y, time, Font::kNormal, kSmall * s_, kDim);
  }
}

void VideoPanels::Curve(const Box& box, const VideoFacts& facts, const VideoCurve& curve, double time_s,
                        double to_s, double highest) {
  const auto now = std::ranges::upper_bound(facts.time_s, time_s) - facts.time_s.begin();
  const size_t num = static_cast<size_t>(now);
  // The label with its unit is followed by the current values in the colors of their lines.
  const std::string label = curve.label + (curve.unit.empty() ? "" : ", " + curve.unit);
  canvas_.Text(box.x, box.y + 14 * s_, canvas_.Fitted(label, Font::kBold, kSmall * s_, box.width),
               Font::kBold, kSmall * s_, kText);
  double x = box.x;
  const int decimals = Decimals(highest);
  for (size_t line = 0; line < curve.value.size(); ++line) {
    const double value = num > 0 ? curve.value[line][num - 1] : NAN;
    std::string words = line < curve.of.size() ? Words(Printable(curve.of[line])) + " " : "";
    words += std::isfinite(value) ? Fixed(value, decimals) : "-";
    const double room = (box.width - (x - box.x)) / static_cast<double>(curve.value.size() - line);
    words = canvas_.Fitted(words, Font::kNormal, kSmall * s_, room - 22 * s_);
    const double y = box.y + 32 * s_;
    if (curve.value.size() > 1) {
      const Point dash[] = {{x + 1, y - 4.5 * s_}, {x + 12 * s_, y - 4.5 * s_}};
      canvas_.Line(dash, 3 * s_, kLines[line % std::size(kLines)]);
      x += 17 * s_;
    }
    canvas_.Text(x, y, words, Font::kNormal, kSmall * s_, kText);
    // Each value has a fixed column, so that it does not move as digits change.
    x = box.x + (box.width / static_cast<double>(curve.value.size())) * static_cast<double>(line + 1);
  }
  const double low = std::min(0., curve.lowest), high = highest > low ? highest : low + 1;
  const Box plot =
      Axes({box.x, box.y + 42 * s_, box.width, box.height - 42 * s_}, Fixed(low, low < 0 ? decimals : 0),
           Fixed(high, decimals), fmt::format("{:.4g} s", to_s));
  canvas_.Clip({plot.x - 2 * s_, plot.y - 3 * s_, plot.width + 5 * s_, plot.height + 6 * s_});
  for (size_t line = 0; line < curve.value.size(); ++line) {
    std::vector<Point> points;
    const Color& color = kLines[line % std::size(kLines)];
    for (size_t i = 0; i < num; ++i) {
      const double value = curve.value[line][i];
      if (!std::isfinite(value) || to_s <= 0) continue;
      points.push_back({plot.x + plot.width * facts.time_s[i] / to_s,
                        plot.bottom() - plot.height * (value - low) / (high - low)});
    }
    if (points.empty()) continue;
    canvas_.Line(points, 2.2 * s_, color);
    canvas_.Disc(points.back(), 3.2 * s_, color);
  }
  canvas_.Unclip();
}

Box VideoPanels::Axes(const Box& box, const std::string& low, const std::string& high,
                      const std::string& right) {
  const double size = kAxis * s_, gap = 5 * s_;
  const double left = gap + std::max(canvas_.TextWidth(low, Font::kNormal, size),
                                     canvas_.TextWidth(high, Font::kNormal, size));
  const Box plot{box.x + left, box.y + 3 * s_, box.width - left, box.height - 3 * s_ - 1.3 * size};
  for (const auto& [y, text] : {std::pair(plot.y, high), std::pair(plot.bottom(), low)}) {
    const Point rule[] = {{plot.x, y}, {plot.right(), y}};
    canvas_.Line(rule, 1 * s_, kRule);
    canvas_.TextBefore(plot.x - gap, y + 0.36 * size, text, Font::kNormal, size, kDim);
  }
  canvas_.Text(plot.x, box.bottom(), "0", Font::kNormal, size, kDim);
  canvas_.TextBefore(plot.right(), box.bottom(), right, Font::kNormal, size, kDim);
  return plot;
}

void VideoPanels::TimeLine(const Box& box, const VideoFacts& facts, double time_s, double to_s) {
  // Legend of the marks, with their counts so far.
  struct Entry {
    Kind kind;
    const char* words;
    bool is_there;
  };
  const auto has = [&](Kind kind) {
    return std::ranges::any_of(facts.marks, [&](const VideoMark& mark) { return mark.kind == kind; });
  };
  const Entry entries[] = {{Kind::kGrasp, "grasps", has(Kind::kGrasp)},
                           {Kind::kSlip, "slips", facts.counts_slips || has(Kind::kSlip)},
                           {Kind::kCollision, "collisions", facts.counts_collisions}};
  const double y = box.bottom() - 14 * s_, text_y = box.y + 12 * s_;
  double x = box.x;
  for (const Entry& entry : entries) {
    if (!entry.is_there) continue;
    const auto count = std::ranges::count_if(
        facts.marks, [&](const VideoMark& mark) { return mark.kind == entry.kind && mark.time_s <= time_s; });
    const std::string words = fmt::format("{} {}", entry.words, count);
    const double width = canvas_.TextWidth(words, Font::kNormal, kSmall * s_);
    if (x + 16 * s_ + width > box.right()) break;
    if (entry.kind == Kind::kGrasp) {
      canvas_.Panel({x, text_y - 8 * s_, 12 * s_, 6 * s_}, 3 * s_, kSky);
    } else {
      Mark(entry.kind, {x + 6 * s_, text_y - 4.5 * s_}, 5.5 * s_);
    }
    canvas_.Text(x + 18 * s_, text_y, words, Font::kNormal, kSmall * s_, count > 0 ? kText : kDim);
    // Positions do not depend on the number of digits.
    x += width + 44 * s_ + (count < 10 ? 0 : -8 * s_ * (std::floor(std::log10(count))));
  }
  const std::string end = TimeText(to_s);
  canvas_.TextBefore(box.right(), text_y, end, Font::kNormal, kSmall * s_, kDim);
  const auto at = [&](double t) { return box.x + box.width * (to_s > 0 ? std::clamp(t / to_s, 0., 1.) : 1); };
  canvas_.Panel({box.x, y - 2 * s_, box.width, 4 * s_}, 2 * s_, kRule);
  const double reached = at(time_s) - box.x;
  if (reached > 4 * s_) canvas_.Panel({box.x, y - 2 * s_, reached, 4 * s_}, 2 * s_, kDim);
  for (const VideoMark& mark : facts.marks) {
    if (mark.kind != Kind::kGrasp || mark.time_s > time_s) continue;
    const double left = at(mark.time_s), right = at(std::min(time_s, mark.time_s + mark.duration_s));
    canvas_.Panel({left, y - 3.5 * s_, std::max(7 * s_, right - left), 7 * s_}, 3.5 * s_, kSky);
  }
  // Failures are drawn over successes.
  for (const Kind kind : {Kind::kStage, Kind::kCollision, Kind::kSlip}) {
    for (const VideoMark& mark : facts.marks) {
      if (mark.kind == kind && mark.time_s <= time_s) Mark(kind, {at(mark.time_s), y}, 7 * s_);
    }
  }
  const double head = at(time_s);
  canvas_.Fill({head - 1 * s_, y - 9 * s_, 2 * s_, 18 * s_}, kText);
}

void VideoPanels::Mark(Kind kind, const Point& center, double radius) {
  switch (kind) {
    case Kind::kStage:
      canvas_.Disc(center, radius + 1.2 * s_, kWhite);
      canvas_.Disc(center, radius, kSuccessColor);
      Check(center, radius, kWhite);
      break;
    case Kind::kGrasp:
      canvas_.Ring(center, radius, 4 * s_, Faded(kText, 0.55));
      canvas_.Ring(center, radius, 2 * s_, kSky);
      break;
    case Kind::kSlip: {
      const double r = radius * 1.15;
      const auto triangle = [&center](double size) {
        return std::vector<Point>{{center.x, center.y - size},
                                  {center.x + size * 0.9, center.y + size * 0.7},
                                  {center.x - size * 0.9, center.y + size * 0.7}};
      };
      canvas_.Polygon(triangle(r + 2.2 * s_), kWhite);
      canvas_.Polygon(triangle(r), kSlipColor);
      break;
    }
    case Kind::kCollision: {
      const double r = radius * 0.72;
      Cross(center, r, 6.5 * s_, kWhite);
      Cross(center, r, 3.2 * s_, kFailureColor);
      break;
    }
  }
}

void VideoPanels::Check(const Point& center, double radius, const Color& color) {
  const Point points[] = {{center.x - 0.48 * radius, center.y + 0.02 * radius},
                          {center.x - 0.12 * radius, center.y + 0.40 * radius},
                          {center.x + 0.52 * radius, center.y - 0.38 * radius}};
  canvas_.Line(points, 0.26 * radius, color);
}

void VideoPanels::Cross(const Point& center, double r, double width, const Color& color) {
  const Point down[] = {{center.x - r, center.y - r}, {center.x + r, center.y + r}},
              up[] = {{center.x - r, center.y + r}, {center.x + r, center.y - r}};
  canvas_.Line(down, width, color);
  canvas_.Line(up, width, color);
}

void VideoPanels::Verdict(const Point& center, double radius, VideoEnd end) {
  canvas_.Disc(center, radius, ColorOf(end));
  end == VideoEnd::kSuccess ? Check(center, radius, kWhite)
                            : Cross(center, 0.4 * radius, 0.26 * radius, kWhite);
}

void VideoPanels::Places(const Box& box, const std::vector<Place>& places, bool with_words) {
  canvas_.Clip(box);
  // Overlapping marks of one kind are merged.
  std::vector<Place> drawn;
  const double radius = 9 * s_;
  for (const Kind kind : {Kind::kGrasp, Kind::kCollision, Kind::kSlip}) {
    for (const Place& place : places) {
      if (place.kind != kind) continue;
      const Point point{box.x + place.point.x, box.y + place.point.y};
      if (point.x < box.x || point.x > box.right() || point.y < box.y || point.y > box.bottom()) continue;
      const bool is_near = std::ranges::any_of(drawn, [&](const Place& other) {
        return other.kind == kind &&
               std::hypot(other.point.x - point.x, other.point.y - point.y) < 1.6 * radius;
      });
      if (is_near) continue;
      drawn.push_back({kind, point});
      Mark(kind, point, radius);
    }
  }
  std::vector<Box> words;
  for (const Place& place : drawn) {
    if (!with_words || place.kind == Kind::kGrasp) continue;
    const std::string word = place.kind == Kind::kSlip ? "slip" : "collision";
    const double width = canvas_.TextWidth(word, Font::kBold, kSmall * s_) + 10 * s_;
    // The label is placed on the side that has enough room.
    double x = place.point.x + radius + 6 * s_;
    if (x + width > box.right()) x = place.point.x - radius - 6 * s_ - width;
    const Box label{x, place.point.y - 9 * s_, width, 18 * s_};
    const bool overlaps = std::ranges::any_of(words, [&](const Box& other) {
      return label.x < other.right() && other.x < label.right() && label.y < other.bottom() &&
             other.y < label.bottom();
    });
    if (overlaps) continue;
    words.push_back(label);
    canvas_.Panel(label, 4 * s_, Faded(kWhite, 0.9));
    canvas_.Text(label.x + 5 * s_, label.y + 13.5 * s_, word, Font::kBold, kSmall * s_, kText);
  }
  canvas_.Unclip();
}

void VideoPanels::Caption(const Box& box, const std::string& text) {
  const std::string fitted = canvas_.Fitted(text, Font::kNormal, kSmall * s_, box.width - 20 * s_);
  const double width = canvas_.TextWidth(fitted, Font::kNormal, kSmall * s_) + 12 * s_;
  canvas_.Panel({box.x + 5 * s_, box.y + 5 * s_, width, 20 * s_}, 4 * s_, Faded(kWhite, 0.82));
  canvas_.Text(box.x + 11 * s_, box.y + 19.5 * s_, fitted, Font::kNormal, kSmall * s_, kText);
}

void VideoPanels::EndCard(const Box& box, const VideoFacts& facts) {
  canvas_.Fill(box, Faded(kWhite, 0.45));
  const double padding = 20 * s_, line = 21 * s_;
  const double width = std::min(box.width - 24 * s_, 620 * s_), inner = width - 2 * padding;
  const double head = 30 * s_;
  // The verdict is always shown. The reason, and then numbers in two columns, are added if they fit.
  const double most = box.height - 16 * s_;
  double height = 2 * padding + head - 6 * s_;
  const size_t lines_left = most > height + 6 * s_ ? static_cast<size_t>((most - height - 6 * s_) / line) : 0;
  const std::vector<std::string> reason = canvas_.Wrapped(Capital(facts.reason), Font::kNormal, kNormal * s_,
                                                          inner, std::min<size_t>(3, lines_left));
  if (!reason.empty()) height += static_cast<double>(reason.size()) * line + 6 * s_;
  const size_t rows = (facts.numbers.size() + 1) / 2;
  const bool has_numbers =
      rows > 0 && height + static_cast<double>(rows) * line + 14 * s_ <= most && inner > 380 * s_;
  if (has_numbers) height += static_cast<double>(rows) * line + 14 * s_;
  const Box card{box.x + (box.width - width) / 2, box.y + (box.height - height) / 2, width, height};
  canvas_.Panel({card.x - 1 * s_, card.y, card.width + 2 * s_, card.height + 3 * s_}, 10 * s_,
                Faded(kText, 0.18));
  canvas_.Panel(card, 10 * s_, kWhite);

  const VideoEnd end = EndOf(facts);
  double x = card.x + padding, y = card.y + padding + 19 * s_;
  if (end != VideoEnd::kNone) {
    Verdict({x + 13 * s_, y - 8 * s_}, 13 * s_, end);
    x += 38 * s_;
  }
  const std::string time = TimeText(facts.outcome_s);
  const double time_width = canvas_.TextWidth(time, Font::kNormal, kBold * s_);
  canvas_.Text(x, y,
               canvas_.Fitted(OutcomeWords(facts), Font::kBold, 24 * s_,
                              card.right() - padding - x - time_width - 12 * s_),
               Font::kBold, 24 * s_, end == VideoEnd::kNone ? kText : ColorOf(end));
  canvas_.TextBefore(card.right() - padding, y, time, Font::kNormal, kBold * s_, kDim);
  y += 10 * s_;
  for (const std::string& words : reason) {
    canvas_.Text(card.x + padding, y += line, words, Font::kNormal, kNormal * s_, kText);
  }
  if (!has_numbers) return;
  y += 12 * s_;
  const Point rule[] = {{card.x + padding, y}, {card.right() - padding, y}};
  canvas_.Line(rule, 1 * s_, kRule);
  y += 2 * s_;
  const double gap = 28 * s_, column = (inner - gap) / 2;
  for (size_t i = 0; i < facts.numbers.size(); ++i) {
    const auto& [label, value] = facts.numbers[i];
    const double left = card.x + padding + (i < rows ? 0 : column + gap);
    const double base = y + static_cast<double>(i % rows + 1) * line;
    const double value_width = canvas_.TextWidth(value, Font::kBold, kSmall * s_);
    canvas_.Text(left, base,
                 canvas_.Fitted(label, Font::kNormal, kSmall * s_, column - value_width - 10 * s_),
                 Font::kNormal, kSmall * s_, kDim);
    canvas_.TextBefore(left + column, base, value, Font::kBold, kSmall * s_, kText);
  }
}

void VideoPanels::Ending(const Box& box, const VideoFacts& facts) {
  constexpr size_t kMaxLines = 2;
  const double line = 19 * s_, padding = 10 * s_, left = box.x + 40 * s_;
  std::vector<std::string> lines = canvas_.Wrapped(Capital(facts.reason), Font::kNormal, kSmall * s_,
                                                   box.right() - padding - left, kMaxLines);
  if (lines.empty()) lines = {OutcomeWords(facts)};
  const double height = static_cast<double>(lines.size()) * line + padding;
  const double top = box.bottom() - height;
  canvas_.Fill({box.x, top, box.width, height}, Faded(kWhite, 0.88));
  if (const VideoEnd end = EndOf(facts); end != VideoEnd::kNone) {
    Verdict({box.x + 20 * s_, top + height / 2}, 10 * s_, end);
  }
  double y = top + padding / 2 - 5 * s_;
  for (const std::string& words : lines) {
    canvas_.Text(left, y += line, words, Font::kNormal, kSmall * s_, kText);
  }
}

void VideoPanels::Cell(const Box& box, double frame, const std::string& name, const VideoFacts& facts,
                       bool is_over) {
  const VideoEnd end = is_over ? EndOf(facts) : VideoEnd::kNone;
  canvas_.Outline(box, frame, ColorOf(end));
  const Box inner{box.x + frame, box.y + frame, box.width - 2 * frame, box.height - 2 * frame};
  const double size = inner.width < 150 * s_ ? 11.5 * s_ : kSmall * s_, high = size * 1.55;
  const auto label = [&](double x, double y, const std::string& text, Font font, double room) {
    const std::string fitted = canvas_.Fitted(text, font, size, room - 0.8 * size);
    if (fitted.empty()) return;
    canvas_.Panel({x, y, canvas_.TextWidth(fitted, font, size) + 0.8 * size, high}, 3 * s_,
                  Faded(kWhite, 0.88));
    canvas_.Text(x + 0.4 * size, y + 1.12 * size, fitted, font, size, kText);
  };
  const double gap = 3 * s_;
  label(inner.x + gap, inner.y + gap, name, Font::kNormal, inner.width - 2 * gap);
  if (!is_over) return;
  const double radius = high / 2;
  const double y = inner.bottom() - gap - high;
  double x = inner.x + gap;
  if (end != VideoEnd::kNone) {
    Verdict({x + radius, y + radius}, radius, end);
    x += 2 * radius + gap;
  }
  label(x, y, fmt::format("{}, {:.1f} s", OutcomeWords(facts), facts.duration_s), Font::kBold,
        inner.right() - gap - x);
}

}  // namespace evalbus::viz
