// Layout of videos with panels. Pure; boxes are in pixels of the image.
#pragma once

#include <string>
#include <vector>

#include "viz/images/canvas.h"
#include "viz/images/frame.h"

namespace evalbus::viz {

// Returns the number of pixels per layout unit: 1 at 1280x720, and never so few that text becomes unreadable.
double VideoScale(FrameSize size);
// Throws InputError if the image is too small for panels and text.
void CheckPanelSize(FrameSize size);

// A main image, insets in a column, and panels below. Images have even sizes.
struct FullLayout {
  double scale = 1;
  Box header, main;
  std::vector<Box> insets;
  Box stages;
  std::vector<Box> curves;
  Box time_line;
};
FullLayout LayOutFull(FrameSize size, int num_insets, int num_curves);
inline constexpr int kMaxInsets = 3;

// Two episodes side by side, each with its own panels.
struct PairLayout {
  double scale = 1;
  Box header;
  struct Side {
    Box title, image, stages, curve, time_line;
  };
  Side side[2];
};
PairLayout LayOutPair(FrameSize size);

// Small images in rows below a header.
struct GridLayout {
  double scale = 1;
  Box header;
  // Cells row by row. Each cell contains a frame and an image.
  std::vector<Box> cells;
  // Width of the frame between a cell's edge and its image, pixels.
  double frame = 0;
};
GridLayout LayOutGrid(FrameSize size, int columns, int rows);

struct GridShape {
  int columns = 0, rows = 0;
};
// Parses a shape such as "4x3". Throws InputError if the text is invalid.
GridShape ParseGridShape(const std::string& text);
// Returns a nearly square grid for all episodes, of at most kMaxCells cells.
GridShape ShapeFor(int num_episodes);
inline constexpr int kMaxCells = 36;

}  // namespace evalbus::viz
