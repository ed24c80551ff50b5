#include "viz/pictures/overlay.h"

#include <cairo-ft.h>
#include <fmt/format.h>

#include <algorithm>
#include <numbers>

#include "base/errors.h"
#include "base/text.h"
#include "lcmtypes/end_reason.h"
#include "lcmtypes/metric_catalogue.h"

namespace evalbus::viz {
namespace {

// Sizes in pixels of a picture 480 pixels high.
constexpr double kMargin = 12, kPadding = 9, kRadius = 5, kBold = 13.5, kSmall = 11.5, kLine = 17, kDot = 4.2;

struct Color {
  double r, g, b, a = 1;
};
constexpr Color kPanel{0.07, 0.08, 0.10, 0.66}, kText{0.97, 0.97, 0.97}, kDim{0.74, 0.76, 0.79};
// Blue and vermilion of Okabe and Ito's palette, which colour-blind people tell apart; a word says it, too.
constexpr Color kGood{0, 0.447, 0.698, 0.94}, kBad{0.835, 0.369, 0, 0.94}, kReached{0.337, 0.706, 0.914};

std::string EndLabel(const std::string& end_reason) {
  std::string text = Words(end_reason);
  for (char& c : text) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return text;
}

// Loaded by file, not by name: a font that is missing is an error and not another font. Loaded once and kept,
// since Cairo keeps references to what it has drawn with.
struct Fonts {
  Fonts() {
    FT_Library library = nullptr;
    FT_Init_FreeType(&library);
    const auto load = [library](const char* file) {
      FT_Face face = nullptr;
      if (FT_New_Face(library, file, 0, &face) != 0) {
        throw EnvironmentError(std::string("cannot read the font ") + file +
                               ": install it with 'apt-get install fonts-dejavu-core'");
      }
      return cairo_ft_font_face_create_for_ft_face(face, FT_LOAD_NO_HINTING);
    };
    normal = load(EVALBUS_FONT_FOLDER "/DejaVuSans.ttf");
    bold = load(EVALBUS_FONT_FOLDER "/DejaVuSans-Bold.ttf");
  }

  cairo_font_face_t* normal;
  cairo_font_face_t* bold;
};

const Fonts& LoadedFonts() {
  static const Fonts fonts;
  return fonts;
}

// A frame as a drawing surface, in units of a picture 480 pixels high.
class Canvas {
 public:
  Canvas(Frame* frame, double scale)
      : surface_(cairo_image_surface_create_for_data(frame->bgrx.data(), CAIRO_FORMAT_RGB24,
                                                     frame->size.width, frame->size.height,
                                                     frame->size.width * 4)),
        cairo_(cairo_create(surface_)) {
    cairo_scale(cairo_, scale, scale);
    width = frame->size.width / scale;
    height = frame->size.height / scale;
  }
  ~Canvas() {
    cairo_destroy(cairo_);
    cairo_surface_destroy(surface_);
  }
  Canvas(const Canvas&) = delete;
  Canvas& operator=(const Canvas&) = delete;

  void Panel(double x, double y, double w, double h, const Color& color) {
    constexpr double kPi = std::numbers::pi;
    cairo_new_sub_path(cairo_);
    cairo_arc(cairo_, x + w - kRadius, y + kRadius, kRadius, -kPi / 2, 0);
    cairo_arc(cairo_, x + w - kRadius, y + h - kRadius, kRadius, 0, kPi / 2);
    cairo_arc(cairo_, x + kRadius, y + h - kRadius, kRadius, kPi / 2, kPi);
    cairo_arc(cairo_, x + kRadius, y + kRadius, kRadius, kPi, 3 * kPi / 2);
    cairo_close_path(cairo_);
    Use(color);
    cairo_fill(cairo_);
  }

  // A ring, or a filled disc.
  void Dot(double x, double y, bool filled, const Color& color) {
    cairo_new_path(cairo_);
    cairo_arc(cairo_, x, y, filled ? kDot : kDot - 0.7, 0, 2 * std::numbers::pi);
    Use(color);
    cairo_set_line_width(cairo_, 1.4);
    filled ? cairo_fill(cairo_) : cairo_stroke(cairo_);
  }

  double TextWidth(const std::string& text, cairo_font_face_t* font, double size) {
    Font(font, size);
    cairo_text_extents_t extents;
    cairo_text_extents(cairo_, text.c_str(), &extents);
    return extents.x_advance;
  }
  // x, y: left end of the base line.
  void Text(double x, double y, const std::string& text, cairo_font_face_t* font, double size,
            const Color& color) {
    Font(font, size);
    Use(color);
    cairo_move_to(cairo_, x, y);
    cairo_show_text(cairo_, text.c_str());
  }

  double width, height;

 private:
  void Use(const Color& color) { cairo_set_source_rgba(cairo_, color.r, color.g, color.b, color.a); }
  void Font(cairo_font_face_t* font, double size) {
    cairo_set_font_face(cairo_, font);
    cairo_set_font_size(cairo_, size);
  }

  cairo_surface_t* surface_;
  cairo_t* cairo_;
};

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
    if (!metric.count || !IsTracked(metric, metrics)) continue;
    text->counts.emplace_back(metric.label, metrics.*metric.count);
  }
}

Overlay::Overlay(FrameSize size) : scale_(std::max(0.5, size.height / 480.0)) { LoadedFonts(); }

void Overlay::Draw(const OverlayText& text, Frame* frame) const {
  const Fonts& fonts = LoadedFonts();
  Canvas canvas(frame, scale_);

  // Top left: what this is.
  const double title_width = std::max({canvas.TextWidth(text.title, fonts.bold, kBold),
                                       canvas.TextWidth(text.subtitle, fonts.normal, kSmall),
                                       canvas.TextWidth(text.maker, fonts.normal, kSmall)});
  canvas.Panel(kMargin, kMargin, title_width + 2 * kPadding, text.maker.empty() ? 42 : 58, kPanel);
  canvas.Text(kMargin + kPadding, kMargin + 18, text.title, fonts.bold, kBold, kText);
  canvas.Text(kMargin + kPadding, kMargin + 34, text.subtitle, fonts.normal, kSmall, kDim);
  canvas.Text(kMargin + kPadding, kMargin + 50, text.maker, fonts.normal, kSmall, kDim);

  // Top right: when, and in the end how it ended.
  const std::string time = fmt::format("{:.2f} s", text.time_s);
  const std::string verdict = EndLabel(text.end_reason);
  const double time_width = std::max(58.0, canvas.TextWidth(time, fonts.bold, kBold));
  double right = canvas.width - kMargin;
  canvas.Panel(right - time_width - 2 * kPadding, kMargin, time_width + 2 * kPadding, 26, kPanel);
  canvas.Text(right - kPadding - canvas.TextWidth(time, fonts.bold, kBold), kMargin + 18, time, fonts.bold,
              kBold, kText);
  if (!verdict.empty()) {
    right -= time_width + 2 * kPadding + 6;
    const double width = canvas.TextWidth(verdict, fonts.bold, kBold) + 2 * kPadding;
    canvas.Panel(right - width, kMargin, width, 26, text.end_reason == end_reason::kSuccess ? kGood : kBad);
    canvas.Text(right - width + kPadding, kMargin + 18, verdict, fonts.bold, kBold, kText);
  }

  // Bottom left: stages.
  if (!text.stages.empty()) {
    double width = 0;
    for (const OverlayText::Stage& stage : text.stages) {
      width = std::max(width, canvas.TextWidth(Words(stage.name), fonts.normal, kSmall));
    }
    const double height = kLine * static_cast<double>(text.stages.size()) + 8;
    double y = canvas.height - kMargin - height;
    canvas.Panel(kMargin, y, width + 2 * kPadding + 15, height, kPanel);
    y += kLine;
    for (const OverlayText::Stage& stage : text.stages) {
      canvas.Dot(kMargin + kPadding + kDot, y - 4, stage.reached, stage.reached ? kReached : kDim);
      canvas.Text(kMargin + kPadding + 15, y, Words(stage.name), fonts.normal, kSmall,
                  stage.reached ? kText : kDim);
      y += kLine;
    }
  }

  // Bottom right: what went wrong on the way.
  if (!text.counts.empty()) {
    std::vector<std::string> lines;
    double width = 0;
    for (const auto& [label, count] : text.counts) {
      lines.push_back(fmt::format("{} {}", label, count));
      width = std::max(width, canvas.TextWidth(lines.back(), fonts.normal, kSmall));
    }
    const double height = kLine * static_cast<double>(lines.size()) + 8;
    const double left = canvas.width - kMargin - width - 2 * kPadding;
    double y = canvas.height - kMargin - height;
    canvas.Panel(left, y, width + 2 * kPadding, height, kPanel);
    for (const std::string& line : lines) {
      canvas.Text(left + kPadding, y += kLine, line, fonts.normal, kSmall, kText);
    }
  }
}

}  // namespace evalbus::viz
