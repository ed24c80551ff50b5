#include "viz/images/canvas.h"

#include <cairo-ft.h>

#include <filesystem>
#include <numbers>

#include "base/errors.h"
#include "base/installed.h"
#include "base/text.h"

namespace evalbus::viz {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr char kEllipsis[] = "…";

// Fonts are loaded from their files, not by name. A missing font is therefore an error, and no other font
// replaces it. They are loaded once and never freed, because Cairo keeps references to the fonts that it has
// used.
struct Fonts {
  Fonts() {
    FT_Library library = nullptr;
    FT_Init_FreeType(&library);
    const std::filesystem::path folder = SharedData("fonts", EVALBUS_FONT_FOLDER);
    const auto load = [&](const char* name) {
      const std::string file = folder / name;
      FT_Face face = nullptr;
      if (FT_New_Face(library, file.c_str(), 0, &face) != 0) {
        throw EnvironmentError("cannot read the font " + file +
                               ": install it with 'apt-get install fonts-dejavu-core'");
      }
      return cairo_ft_font_face_create_for_ft_face(face, FT_LOAD_NO_HINTING);
    };
    normal = load("DejaVuSans.ttf");
    bold = load("DejaVuSans-Bold.ttf");
  }

  cairo_font_face_t* normal;
  cairo_font_face_t* bold;
};

const Fonts& LoadedFonts() {
  static const Fonts fonts;
  return fonts;
}

}  // namespace

void LoadFonts() { LoadedFonts(); }

Canvas::Canvas(Frame* frame, double scale) {
  LoadFonts();
  surface_ = cairo_image_surface_create_for_data(frame->bgrx.data(), CAIRO_FORMAT_RGB24, frame->size.width,
                                                 frame->size.height, frame->size.width * 4);
  cairo_ = cairo_create(surface_);
  cairo_scale(cairo_, scale, scale);
  width = frame->size.width / scale;
  height = frame->size.height / scale;
}

Canvas::~Canvas() {
  cairo_destroy(cairo_);
  cairo_surface_destroy(surface_);
}

void Canvas::Fill(const Box& box, const Color& color) {
  Use(color);
  cairo_rectangle(cairo_, box.x, box.y, box.width, box.height);
  cairo_fill(cairo_);
}

void Canvas::Panel(const Box& box, double radius, const Color& color) {
  cairo_new_sub_path(cairo_);
  cairo_arc(cairo_, box.right() - radius, box.y + radius, radius, -kPi / 2, 0);
  cairo_arc(cairo_, box.right() - radius, box.bottom() - radius, radius, 0, kPi / 2);
  cairo_arc(cairo_, box.x + radius, box.bottom() - radius, radius, kPi / 2, kPi);
  cairo_arc(cairo_, box.x + radius, box.y + radius, radius, kPi, 3 * kPi / 2);
  cairo_close_path(cairo_);
  Use(color);
  cairo_fill(cairo_);
}

void Canvas::Outline(const Box& box, double line, const Color& color) {
  Use(color);
  cairo_set_line_width(cairo_, line);
  cairo_rectangle(cairo_, box.x + line / 2, box.y + line / 2, box.width - line, box.height - line);
  cairo_stroke(cairo_);
}

void Canvas::Disc(const Point& center, double radius, const Color& color) {
  cairo_new_path(cairo_);
  cairo_arc(cairo_, center.x, center.y, radius, 0, 2 * kPi);
  Use(color);
  cairo_fill(cairo_);
}

void Canvas::Ring(const Point& center, double radius, double line, const Color& color) {
  cairo_new_path(cairo_);
  cairo_arc(cairo_, center.x, center.y, radius, 0, 2 * kPi);
  Use(color);
  cairo_set_line_width(cairo_, line);
  cairo_stroke(cairo_);
}

void Canvas::Path(std::span<const Point> points) {
  cairo_new_path(cairo_);
  for (const Point& point : points) cairo_line_to(cairo_, point.x, point.y);
}

void Canvas::Line(std::span<const Point> points, double line, const Color& color) {
  Path(points);
  Use(color);
  cairo_set_line_width(cairo_, line);
  cairo_set_line_cap(cairo_, CAIRO_LINE_CAP_ROUND);
  cairo_set_line_join(cairo_, CAIRO_LINE_JOIN_ROUND);
  cairo_stroke(cairo_);
}

void Canvas::Polygon(std::span<const Point> points, const Color& color) {
  Path(points);
  cairo_close_path(cairo_);
  Use(color);
  cairo_fill(cairo_);
}

double Canvas::TextWidth(const std::string& text, Font font, double size) {
  Use(font, size);
  cairo_text_extents_t extents;
  cairo_text_extents(cairo_, text.c_str(), &extents);
  return extents.x_advance;
}

void Canvas::Text(double x, double y, const std::string& text, Font font, double size, const Color& color) {
  Use(font, size);
  Use(color);
  cairo_move_to(cairo_, x, y);
  cairo_show_text(cairo_, text.c_str());
}

void Canvas::TextBefore(double x, double y, const std::string& text, Font font, double size,
                        const Color& color) {
  Text(x - TextWidth(text, font, size), y, text, font, size, color);
}

std::string Canvas::Fitted(const std::string& text, Font font, double size, double room) {
  if (TextWidth(text, font, size) <= room) return text;
  int fits = 0, too_long = Width(text);
  while (fits + 1 < too_long) {
    const int middle = (fits + too_long) / 2;
    (TextWidth(Cut(text, middle) + kEllipsis, font, size) <= room ? fits : too_long) = middle;
  }
  return fits == 0 ? "" : Cut(text, fits) + kEllipsis;
}

std::vector<std::string> Canvas::Wrapped(const std::string& text, Font font, double size, double room,
                                         size_t max_lines) {
  std::vector<std::string> lines;
  std::string left = text;
  while (!left.empty() && lines.size() < max_lines) {
    if (lines.size() + 1 == max_lines || TextWidth(left, font, size) <= room) {
      lines.push_back(Fitted(left, font, size, room));
      break;
    }
    // Each line takes as many words as fit. A single word that is too long is cut.
    size_t end = std::string::npos;
    for (size_t space = left.find(' '); space != std::string::npos; space = left.find(' ', space + 1)) {
      if (TextWidth(left.substr(0, space), font, size) > room) break;
      end = space;
    }
    if (end == std::string::npos) end = left.find(' ');
    lines.push_back(Fitted(left.substr(0, end), font, size, room));
    left = end == std::string::npos ? "" : left.substr(end + 1);
  }
  return lines;
}

void Canvas::Clip(const Box& box) {
  cairo_save(cairo_);
  cairo_rectangle(cairo_, box.x, box.y, box.width, box.height);
  cairo_clip(cairo_);
}

void Canvas::Unclip() { cairo_restore(cairo_); }

void Canvas::Use(const Color& color) { cairo_set_source_rgba(cairo_, color.r, color.g, color.b, color.a); }

void Canvas::Use(Font font, double size) {
  const Fonts& fonts = LoadedFonts();
  cairo_set_font_face(cairo_, font == Font::kBold ? fonts.bold : fonts.normal);
  cairo_set_font_size(cairo_, size);
}

}  // namespace evalbus::viz
