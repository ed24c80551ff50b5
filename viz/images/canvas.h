// A 2D drawing surface over a Frame, implemented with Cairo. All text uses one font family.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "viz/images/frame.h"

struct _cairo;          // NOLINT(bugprone-reserved-identifier)
struct _cairo_surface;  // NOLINT(bugprone-reserved-identifier)

namespace evalbus::viz {

struct Color {
  double r, g, b, a = 1;
};

struct Point {
  double x, y;
};

struct Box {
  double x = 0, y = 0, width = 0, height = 0;

  double right() const { return x + width; }
  double bottom() const { return y + height; }
};

enum class Font { kNormal, kBold };

// Throws EnvironmentError if the font is missing.
void LoadFonts();

class Canvas {
 public:
  // All coordinates and lengths are in units of `scale` pixels. Throws EnvironmentError if the font is
  // missing.
  Canvas(Frame* frame, double scale);
  ~Canvas();
  Canvas(const Canvas&) = delete;
  Canvas& operator=(const Canvas&) = delete;

  void Fill(const Box& box, const Color& color);
  // Fills a box with rounded corners.
  void Panel(const Box& box, double radius, const Color& color);
  void Outline(const Box& box, double line, const Color& color);
  void Disc(const Point& center, double radius, const Color& color);
  void Ring(const Point& center, double radius, double line, const Color& color);
  void Line(std::span<const Point> points, double line, const Color& color);
  void Polygon(std::span<const Point> points, const Color& color);

  double TextWidth(const std::string& text, Font font, double size);
  // Draws text. x, y: left end of the baseline.
  void Text(double x, double y, const std::string& text, Font font, double size, const Color& color);
  // Draws right-aligned text: it ends at x.
  void TextBefore(double x, double y, const std::string& text, Font font, double size, const Color& color);

  // Returns the text. If it is wider than `room`, it is cut and ends with an ellipsis; empty if not even one
  // character fits.
  std::string Fitted(const std::string& text, Font font, double size, double room);
  // Breaks the text into lines no wider than `room`. If it needs more than max_lines, the last line ends with
  // an ellipsis.
  std::vector<std::string> Wrapped(const std::string& text, Font font, double size, double room,
                                   size_t max_lines);

  // Restricts drawing to the box until Unclip is called.
  void Clip(const Box& box);
  void Unclip();

  double width, height;

 private:
  void Use(const Color& color);
  void Use(Font font, double size);
  void Path(std::span<const Point> points);

  _cairo_surface* surface_;
  _cairo* cairo_;
};

}  // namespace evalbus::viz
