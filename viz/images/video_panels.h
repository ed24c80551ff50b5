// The panels of a video, each drawn into its box, in pixels: stages, curves, time line, marks, end card.
// Colors are Okabe and Ito's; what a color says, a shape or a word says, too.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "viz/images/canvas.h"
#include "viz/images/video_facts.h"

namespace evalbus::viz {

// How an episode came out, where its end is reached.
enum class VideoEnd { kNone, kSuccess, kFailure };
VideoEnd EndOf(const VideoFacts& facts);

class VideoPanels {
 public:
  // scale: pixels to a unit of text and lines.
  VideoPanels(Frame* frame, double scale) : canvas_(frame, 1), s_(scale) {}

  // Nothing but the background: everywhere, or here.
  void Page();
  void Blank(const Box& box);
  // Bold on the left, then quieter; on the right the time.
  void Header(const Box& box, const std::string& title, const std::string& subtitle,
              const std::string& right);
  // A name, and at the end the outcome behind its mark.
  void Title(const Box& box, const VideoFacts& facts, const std::string& name, bool is_over);
  void Stages(const Box& box, const VideoFacts& facts, double time_s);
  // curve: of these facts. to_s, highest: ends of the axes.
  void Curve(const Box& box, const VideoFacts& facts, const VideoCurve& curve, double time_s, double to_s,
             double highest);
  void TimeLine(const Box& box, const VideoFacts& facts, double time_s, double to_s);
  // Points in pixels of the box, whose own outline they must not leave.
  struct Place {
    VideoMark::Kind kind;
    Point point;
  };
  void Places(const Box& box, const std::vector<Place>& places, bool with_words);
  void Caption(const Box& box, const std::string& text);
  // Over the image in this box: verdict, reason, and where there is room, numbers.
  void EndCard(const Box& box, const VideoFacts& facts);
  // The frame and the words of a cell.
  void Cell(const Box& box, double frame, const std::string& name, const VideoFacts& facts, bool is_over);

 private:
  void Mark(VideoMark::Kind kind, const Point& center, double radius);
  void Check(const Point& center, double radius, const Color& color);
  void Cross(const Point& center, double radius, const Color& color);
  // Check or cross on a disc.
  void Verdict(const Point& center, double radius, VideoEnd end);

  Canvas canvas_;
  double s_;
};

}  // namespace evalbus::viz
