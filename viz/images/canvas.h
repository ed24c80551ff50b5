// A frame as a surface to draw on, by Cairo, with the one font of our images.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "viz/images/frame.h"

struct _cairo;
struct _cairo_surface;

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
  // Everything is in units of `scale` pixels. Throws EnvironmentError if the font is missing.
  Canvas(Frame* frame, double scale);
  ~Canvas();
  Canvas(const Canvas&) = delete;
  Canvas& operator=(const Canvas&) = delete;

  void Fill(const Box& box, const Color& color);
  // With round corners.
  void Panel(const Box& box, double radius, const Color& color);
  void Outline(const Box& box, double line, const Color& color);
  void Disc(const Point& center, double radius, const Color& color);
  void Ring(const Point& center, double radius, double line, const Color& color);
  void Line(std::span<const Point> points, double line, const Color& color);
  void Polygon(std::span<const Point> points, const Color& color);

  double TextWidth(const std::string& text, Font font, double size);
  // x, y: left end of the base line.
  void Text(double x, double y, const std::string& text, Font font, double size, const Color& color);
  // The same, to the left of x.
  void TextBefore(double x, double y, const std::string& text, Font font, double size, const Color& color);

  // Cut, with an ellipsis, to what is not wider.
  std::string Fitted(const std::string& text, Font font, double size, double room);
  // In lines that are not wider; what has no room in so many lines is cut with an ellipsis.
  std::vector<std::string> Wrapped(const std::string& text, Font font, double size, double room,
                                   size_t max_lines);

  // Nothing is drawn outside until Unclip.
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
