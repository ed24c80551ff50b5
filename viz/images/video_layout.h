// Where the parts of a video's image are. Pure; boxes are in pixels of the image.
#pragma once

#include <string>
#include <vector>

#include "viz/images/canvas.h"
#include "viz/images/frame.h"

namespace evalbus::viz {

// How many pixels a unit of text and margins is: 1 at 1280x720, and never so few that text cannot be read.
double VideoScale(FrameSize size);
// Throws InputError for an image that is too small for panels and text.
void CheckPanelSize(FrameSize size);

// A large image, smaller ones in a column, and what happens below. Images have even pixels.
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
  // Row by row; each has an image within a frame.
  std::vector<Box> cells;
  // Of the image within its cell.
  double frame = 0;
};
GridLayout LayOutGrid(FrameSize size, int columns, int rows);

struct GridShape {
  int columns = 0, rows = 0;
};
// From "4x3". Throws InputError.
GridShape ParseGridShape(const std::string& text);
// So many columns and rows as show all episodes, up to kMaxCells.
GridShape ShapeFor(int num_episodes);
inline constexpr int kMaxCells = 36;

}  // namespace evalbus::viz
