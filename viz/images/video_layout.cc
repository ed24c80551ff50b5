#include "viz/images/video_layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "base/errors.h"

namespace evalbus::viz {
namespace {

// Lengths in layout units (VideoScale pixels).
constexpr double kHeader = 40, kTimeLine = 46, kPanels = 140, kMargin = 14, kGap = 3;
constexpr double kSmallestScale = 0.8;
constexpr int kSmallestWidth = 640, kSmallestHeight = 360;

double Even(double pixels) { return 2 * std::floor(pixels / 2); }

Box EvenBox(double x, double y, double right, double bottom) {
  return {Even(x), Even(y), Even(right) - Even(x), Even(bottom) - Even(y)};
}

}  // namespace

double VideoScale(FrameSize size) {
  return std::max(kSmallestScale, std::min(size.width / 1280., size.height / 720.));
}

void CheckPanelSize(FrameSize size) {
  CheckFrameSize(size);
  if (size.width >= kSmallestWidth && size.height >= kSmallestHeight) return;
  throw InputError(fmt::format("--size {}x{}: videos with panels require at least {}x{}", size.width,
                               size.height, kSmallestWidth, kSmallestHeight));
}

FullLayout LayOutFull(FrameSize size, int num_insets, int num_curves) {
  FullLayout layout;
  const double s = layout.scale = VideoScale(size);
  const double width = size.width, height = size.height, margin = kMargin * s, gap = Even(kGap * s);
  layout.header = {0, 0, width, Even(kHeader * s)};
  layout.time_line = {margin, height - kTimeLine * s, width - 2 * margin, kTimeLine * s};
  const double panels = layout.time_line.y - kPanels * s;
  const double top = layout.header.bottom(), bottom = Even(panels);
  // If there are more insets, their column is narrower, so that they keep their aspect ratio.
  const double share = num_insets == 0 ? 0 : num_insets == 1 ? 0.36 : num_insets == 2 ? 0.30 : 0.24;
  const double column = Even(width * (1 - share));
  layout.main = EvenBox(0, top, num_insets > 0 ? column - gap : width, bottom);
  for (int i = 0; i < num_insets; ++i) {
    const double each = (bottom - top + gap) / num_insets;
    layout.insets.push_back(EvenBox(column, top + i * each, width, top + (i + 1) * each - gap));
  }
  const double stages = std::max(0.24 * width, 230 * s);
  const Box row{margin, bottom + 10 * s, width - 2 * margin, kPanels * s - 14 * s};
  layout.stages = {row.x, row.y, stages, row.height};
  const double left = layout.stages.right() + 2 * margin, room = row.right() - left;
  // Shows only as many curves as fit without cutting their labels.
  const int shown = std::clamp(static_cast<int>((room + 2 * margin) / (210 * s + 2 * margin)), 0, num_curves);
  for (int i = 0; i < shown; ++i) {
    const double each = (room + 2 * margin) / shown;
    layout.curves.push_back({left + i * each, row.y, each - 2 * margin, row.height});
  }
  return layout;
}

PairLayout LayOutPair(FrameSize size) {
  PairLayout layout;
  const double s = layout.scale = VideoScale(size);
  const double width = size.width, height = size.height, margin = kMargin * s, gap = Even(kGap * s);
  layout.header = {0, 0, width, Even(kHeader * s)};
  const double half = Even(width / 2);
  for (int i = 0; i < 2; ++i) {
    PairLayout::Side& side = layout.side[i];
    const double left = i == 0 ? 0 : half + gap, right = i == 0 ? half - gap : width;
    const double inner = right - left - 2 * margin;
    side.title = {left + margin, layout.header.bottom(), inner, Even(30 * s)};
    side.time_line = {left + margin, height - kTimeLine * s, inner, kTimeLine * s};
    const double bottom = side.time_line.y - kPanels * s;
    side.image = EvenBox(left, side.title.bottom(), right, bottom);
    const double top = side.image.bottom() + 10 * s, high = kPanels * s - 14 * s;
    const double stages = (inner - margin) * 0.5;
    side.stages = {left + margin, top, stages, high};
    side.curve = {side.stages.right() + margin, top, inner - stages - margin, high};
  }
  return layout;
}

GridLayout LayOutGrid(FrameSize size, int columns, int rows) {
  GridLayout layout;
  const double s = layout.scale = VideoScale(size);
  layout.header = {0, 0, static_cast<double>(size.width), Even(kHeader * s)};
  layout.frame = std::max(2., Even(4 * s));
  const double gap = Even(4 * s), top = layout.header.bottom();
  const double width = (size.width - gap) / columns, height = (size.height - top - gap) / rows;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      layout.cells.push_back(EvenBox(gap + column * width, top + row * height, (column + 1) * width,
                                     top + (row + 1) * height - gap));
    }
  }
  return layout;
}

GridShape ParseGridShape(const std::string& text) {
  GridShape shape;
  int used = 0;
  if (std::sscanf(text.c_str(), "%2dx%2d%n", &shape.columns, &shape.rows, &used) != 2 ||
      used != static_cast<int>(text.size()) || shape.columns < 1 || shape.rows < 1 ||
      shape.columns * shape.rows > kMaxCells) {
    throw InputError(fmt::format("--grid {}: expected COLUMNSxROWS, for example 4x3, with at most {} cells",
                                 text, kMaxCells));
  }
  return shape;
}

GridShape ShapeFor(int num_episodes) {
  const int shown = std::clamp(num_episodes, 1, kMaxCells);
  const int columns = static_cast<int>(std::ceil(std::sqrt(shown)));
  return {columns, (shown + columns - 1) / columns};
}

}  // namespace evalbus::viz
