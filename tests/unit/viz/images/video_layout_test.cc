// Tests the positions of a video's parts and of a point in a camera's image.
#include "viz/images/video_layout.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "base/errors.h"
#include "models/mujoco_ptr.h"
#include "viz/images/projection.h"
#include "viz/images/renderer.h"

namespace evalbus::viz::video_layout_test {

void ExpectBox(const Box& box, double x, double y, double width, double height) {
  EXPECT_DOUBLE_EQ(box.x, x);
  EXPECT_DOUBLE_EQ(box.y, y);
  EXPECT_DOUBLE_EQ(box.width, width);
  EXPECT_DOUBLE_EQ(box.height, height);
}

// Expects that every part has at least 40 x 20 pixels and is within the image, and that no two parts overlap.
void ExpectApart(const std::vector<Box>& boxes, FrameSize size) {
  for (size_t i = 0; i < boxes.size(); ++i) {
    const Box& a = boxes[i];
    EXPECT_GE(a.width, 40) << i;
    EXPECT_GE(a.height, 20) << i;
    EXPECT_GE(a.x, 0) << i;
    EXPECT_GE(a.y, 0) << i;
    EXPECT_LE(a.right(), size.width + 1e-9) << i;
    EXPECT_LE(a.bottom(), size.height + 1e-9) << i;
    for (size_t j = 0; j < i; ++j) {
      const Box& b = boxes[j];
      EXPECT_FALSE(a.x < b.right() - 1e-9 && b.x < a.right() - 1e-9 && a.y < b.bottom() - 1e-9 &&
                   b.y < a.bottom() - 1e-9)
          << j << " and " << i << " at " << size.width << "x" << size.height;
    }
  }
}

void ExpectEven(const Box& box) {
  for (const double pixels : {box.x, box.y, box.width, box.height}) EXPECT_EQ(std::fmod(pixels, 2), 0);
}

constexpr std::array<FrameSize, 5> kSizes = {
    {{1280, 720}, {640, 480}, {640, 360}, {1920, 1080}, {1000, 998}}};

TEST(VideoScale, IsOneAt720AndNeverTooSmallToRead) {
  EXPECT_EQ(VideoScale({1280, 720}), 1);
  EXPECT_EQ(VideoScale({1920, 1080}), 1.5);
  EXPECT_EQ(VideoScale({640, 480}), 0.8);
  EXPECT_EQ(VideoScale({2560, 720}), 1);
}

// Computed by hand for 1280x720, where a unit is a pixel. The header has 40 pixels, the timeline 46 and the
// panels 140. Three insets occupy 24 % of the width, starting at 1280 * 0.76 = 972.8, 2 pixels apart.
TEST(FullLayout, HasItsPartsWhereTheyBelong) {
  const FullLayout layout = LayOutFull({1280, 720}, 3, 3);
  ExpectBox(layout.header, 0, 0, 1280, 40);
  ExpectBox(layout.main, 0, 40, 970, 494);
  ASSERT_EQ(layout.insets.size(), 3u);
  ExpectBox(layout.insets[0], 972, 40, 308, 162);
  EXPECT_EQ(layout.insets[2].bottom(), 534);
  EXPECT_EQ(layout.time_line.y, 674);
  EXPECT_EQ(layout.curves.size(), 3u);
  ExpectBox(LayOutFull({1280, 720}, 0, 0).main, 0, 40, 1280, 494);
}

TEST(FullLayout, NothingOverlapsAtAnySize) {
  for (const FrameSize size : kSizes) {
    for (int insets = 0; insets <= kMaxInsets; ++insets) {
      for (int curves = 0; curves <= 3; ++curves) {
        const FullLayout layout = LayOutFull(size, insets, curves);
        std::vector<Box> boxes = {layout.header, layout.main, layout.stages, layout.time_line};
        boxes.insert(boxes.end(), layout.insets.begin(), layout.insets.end());
        boxes.insert(boxes.end(), layout.curves.begin(), layout.curves.end());
        ExpectApart(boxes, size);
        ExpectEven(layout.main);
        for (const Box& inset : layout.insets) ExpectEven(inset);
      }
    }
  }
}

TEST(PairLayout, NothingOverlapsAndBothSidesAreEqual) {
  for (const FrameSize size : kSizes) {
    const PairLayout layout = LayOutPair(size);
    std::vector<Box> boxes = {layout.header};
    for (const PairLayout::Side& side : layout.side) {
      boxes.insert(boxes.end(), {side.title, side.image, side.stages, side.curve, side.time_line});
      ExpectEven(side.image);
    }
    ExpectApart(boxes, size);
    EXPECT_NEAR(layout.side[0].image.width, layout.side[1].image.width, 2);
    EXPECT_EQ(layout.side[0].image.height, layout.side[1].image.height);
  }
}

TEST(GridLayout, CellsAreInRowsAndApart) {
  for (const FrameSize size : kSizes) {
    for (const GridShape shape : {GridShape{1, 1}, GridShape{4, 3}, GridShape{6, 6}}) {
      const GridLayout layout = LayOutGrid(size, shape.columns, shape.rows);
      ASSERT_EQ(layout.cells.size(), static_cast<size_t>(shape.columns * shape.rows));
      std::vector<Box> boxes = layout.cells;
      boxes.push_back(layout.header);
      ExpectApart(boxes, size);
      for (const Box& cell : layout.cells) ExpectEven(cell);
    }
  }
  const GridLayout layout = LayOutGrid({1280, 720}, 4, 3);
  // The cells repeat every 1276 / 4 = 319 and 676 / 3 = 225.3 pixels, with gaps of 4.
  ExpectBox(layout.cells[0], 4, 40, 314, 220);
  ExpectBox(layout.cells[5], 322, 264, 316, 222);
}

TEST(GridShape, HoldsAllEpisodesUpToItsMost) {
  const auto shape = [](int episodes) {
    const GridShape s = ShapeFor(episodes);
    return std::pair(s.columns, s.rows);
  };
  EXPECT_EQ(shape(1), std::pair(1, 1));
  EXPECT_EQ(shape(2), std::pair(2, 1));
  EXPECT_EQ(shape(7), std::pair(3, 3));
  EXPECT_EQ(shape(12), std::pair(4, 3));
  EXPECT_EQ(shape(500), std::pair(6, 6));
  EXPECT_EQ(ParseGridShape("9x4").rows, 4);
  for (const char* wrong : {"", "4", "0x3", "4x", "4x3 ", "-1x3", "7x6", "99x99", "runs/a"}) {
    EXPECT_THROW(ParseGridShape(wrong), InputError) << wrong;
  }
}

TEST(PanelSize, TooSmallForTextIsRefused) {
  EXPECT_NO_THROW(CheckPanelSize({640, 360}));
  EXPECT_THROW(CheckPanelSize({638, 480}), InputError);
  EXPECT_THROW(CheckPanelSize({1281, 720}), InputError);
}

// A camera at the origin without rotation points along -z with y upward. With a vertical field of view of 90
// degrees, the upper edge of the image is 45 degrees above the axis.
TEST(Project, PinholeByHand) {
  const CameraPose camera{{0, 0, 0}, {1, 0, 0, 0, 1, 0, 0, 0, 1}, 90};
  const auto at = [&](double x, double y, double z) {
    const double point[3] = {x, y, z};
    return Project(camera, {200, 100}, point);
  };
  EXPECT_NEAR(at(0, 0, -2)->x, 100, 1e-9);
  EXPECT_NEAR(at(0, 0, -2)->y, 50, 1e-9);
  EXPECT_NEAR(at(0, 2, -2)->y, 0, 1e-9);
  EXPECT_NEAR(at(1, 0, -2)->x, 125, 1e-9);
  EXPECT_FALSE(at(0, 0, 1));
  EXPECT_FALSE(at(1, 1, 0));
}

// The position is compared with MuJoCo's own image of a red ball there.
TEST(Project, IsWhereTheRendererDrawsIt) {
  constexpr char kXml[] =
      R"(<mujoco><visual><headlight ambient="1 1 1" diffuse="0 0 0" specular="0 0 0"/></visual>
    <worldbody><camera name="eye" pos="1.2 -0.7 1.1" xyaxes="0.5 0.86 0 -0.4 0.25 0.88" fovy="50"/>
    <geom type="sphere" size="0.02" pos="POSITION" rgba="1 0 0 1" contype="0" conaffinity="0"/>
    </worldbody></mujoco>)";
  const FrameSize size{320, 240};
  for (const char* position : {"0.1 0.05 0.3", "-0.1 0.2 0.1", "0.3 -0.2 0.4"}) {
    std::string xml = kXml;
    xml.replace(xml.find("POSITION"), 8, position);
    mjVFS vfs;
    mj_defaultVFS(&vfs);
    mj_makeEmptyFileVFS(&vfs, "ball.xml", static_cast<int>(xml.size()));
    std::copy(xml.begin(), xml.end(), static_cast<char*>(vfs.filedata[vfs.nfile - 1]));
    char error[500] = "";
    ModelPtr model(mj_loadXML("ball.xml", &vfs, error, sizeof error));
    mj_deleteVFS(&vfs);
    ASSERT_TRUE(model) << error;
    Renderer renderer(std::move(model), size);
    renderer.SetState(state_t{});
    Frame frame(size);
    renderer.Render(0, &frame);
    double x = 0, y = 0, count = 0;
    for (int i = 0; i < size.width * size.height; ++i) {
      const uint8_t* pixel = &frame.bgrx[static_cast<size_t>(i) * 4];
      if (pixel[2] < 100 || pixel[0] > 60) continue;
      x += i % size.width + 0.5;
      y += i / size.width + 0.5;
      ++count;
    }
    ASSERT_GT(count, 20) << position;
    double point[3];
    std::sscanf(position, "%lf %lf %lf", point, point + 1, point + 2);
    const auto projected = Project(renderer.PoseOf(0), size, point);
    ASSERT_TRUE(projected);
    EXPECT_NEAR(projected->x, x / count, 0.7) << position;
    EXPECT_NEAR(projected->y, y / count, 0.7) << position;
  }
}

}  // namespace evalbus::viz::video_layout_test
