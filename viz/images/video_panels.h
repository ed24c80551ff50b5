// The panels of a video: stages, curves, timeline, marks and end card. Each is drawn into a box in pixels.
// Colors are based on the Okabe-Ito palette. Everything that is shown by color is also shown by a shape or a
// word.
#pragma once

#include <string>
#include <vector>

#include "viz/images/canvas.h"
#include "viz/images/video_facts.h"

namespace evalbus::viz {

// Outcome of an episode. kNone: the episode has not ended.
enum class VideoEnd { kNone, kSuccess, kFailure };
VideoEnd EndOf(const VideoFacts& facts);

class VideoPanels {
 public:
  // scale: pixels per unit of text and lines.
  VideoPanels(Frame* frame, double scale) : canvas_(frame, 1), s_(scale) {}

  // Page() fills the whole frame with the background color, Blank() a box of it.
  void Page();
  void Blank(const Box& box);
  // Draws the title in bold and the subtitle on the left, and `right` (the time) at the right edge.
  void Header(const Box& box, const std::string& title, const std::string& subtitle,
              const std::string& right);
  // Shows the name and, once the episode has ended, the outcome with its mark.
  void Title(const Box& box, const VideoFacts& facts, const std::string& name, bool is_over);
  void Stages(const Box& box, const VideoFacts& facts, double time_s);
  // curve: must be an element of facts.curves. to_s, highest: upper ends of the axes.
  void Curve(const Box& box, const VideoFacts& facts, const VideoCurve& curve, double time_s, double to_s,
             double highest);
  void TimeLine(const Box& box, const VideoFacts& facts, double time_s, double to_s);
  // Draws marks at points in pixels relative to the box. Points outside the box are skipped.
  struct Place {
    VideoMark::Kind kind;
    Point point;
  };
  void Places(const Box& box, const std::vector<Place>& places, bool with_words);
  void Caption(const Box& box, const std::string& text);
  // Draws the verdict, the reason and, if there is room, numbers over the image in this box.
  void EndCard(const Box& box, const VideoFacts& facts);
  // Draws the verdict and the reason in a strip at the lower edge of the image in this box. The end of the
  // episode stays visible.
  void Ending(const Box& box, const VideoFacts& facts);
  // Draws the frame and text of a grid cell.
  void Cell(const Box& box, double frame, const std::string& name, const VideoFacts& facts, bool is_over);

 private:
  // Draws the axes of a curve with numbers at their ends. The time axis begins at 0. Returns the box between
  // the axes.
  Box Axes(const Box& box, const std::string& low, const std::string& high, const std::string& right);
  void Mark(VideoMark::Kind kind, const Point& center, double radius);
  void Check(const Point& center, double radius, const Color& color);
  // Draws two strokes of this width. r: half of their extent in x and in y.
  void Cross(const Point& center, double r, double width, const Color& color);
  // Draws a check mark or a cross on a disc.
  void Verdict(const Point& center, double radius, VideoEnd end);

  Canvas canvas_;
  double s_;
};

}  // namespace evalbus::viz
