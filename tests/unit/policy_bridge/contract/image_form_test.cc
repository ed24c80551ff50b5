#include "policy_bridge/contract/image_form.h"

#include <gtest/gtest.h>

#include <cstring>
#include <stdexcept>

namespace evalbus::policy::image_form_test {

// The 3 x 2 pixels are the letters a b c in the first row and d e f in the second. Red is the letter's
// number, green 10 more and blue 20 more, so every rotation, mirroring and transposition is visible.
image_t Marker() {
  image_t image{};
  image.view.camera = "head";
  image.view.width_px = 3;
  image.view.height_px = 2;
  image.view.encoding = "rgb8";
  for (uint8_t letter = 1; letter <= 6; ++letter) {
    for (const int more : {0, 10, 20}) image.data.push_back(static_cast<uint8_t>(letter + more));
  }
  image.num_bytes = static_cast<int32_t>(image.data.size());
  return image;
}

ImageForm Form() {
  ImageForm form;
  form.view = Marker().view;
  return form;
}

// Returns the letters of the red values, row by row.
std::string Letters(const Array& array) {
  std::string letters;
  const auto width = static_cast<size_t>(array.shape.at(1));
  for (size_t i = 0; i < array.data.size() / 3; ++i) {
    if (i > 0 && i % width == 0) letters += '/';
    letters += static_cast<char>('a' + array.data[3 * i] - 1);
  }
  return letters;
}

TEST(FormImage, AsItWasDrawn) {
  const Array array = FormImage(Form(), Marker());
  EXPECT_EQ(array.dtype, "|u1");
  EXPECT_EQ(array.shape, (std::vector<int64_t>{2, 3, 3}));
  EXPECT_EQ(array.data, Marker().data);
  EXPECT_EQ(Letters(array), "abc/def");
}

TEST(FormImage, TurnedCounterClockwiseThenMirrored) {
  const auto turned = [](int degrees, bool mirror) {
    ImageForm form = Form();
    form.rotate_deg = degrees;
    form.mirror = mirror;
    return Letters(FormImage(form, Marker()));
  };
  EXPECT_EQ(turned(90, false), "cf/be/ad");
  EXPECT_EQ(turned(180, false), "fed/cba");
  EXPECT_EQ(turned(270, false), "da/eb/fc");
  EXPECT_EQ(turned(0, true), "cba/fed");
  EXPECT_EQ(turned(180, true), "def/abc");
  EXPECT_EQ(turned(90, true), "fc/eb/da");
}

TEST(FormImage, BlueFirstAndPlanesFirst) {
  ImageForm form = Form();
  form.bgr = true;
  Array array = FormImage(form, Marker());
  EXPECT_EQ(array.data[0], 21);
  EXPECT_EQ(array.data[1], 11);
  EXPECT_EQ(array.data[2], 1);
  form.bgr = false;
  form.chw = true;
  array = FormImage(form, Marker());
  EXPECT_EQ(array.shape, (std::vector<int64_t>{3, 2, 3}));
  EXPECT_EQ(array.data, (Bytes{1, 2, 3, 4, 5, 6, 11, 12, 13, 14, 15, 16, 21, 22, 23, 24, 25, 26}));
  form.bgr = true;
  EXPECT_EQ(FormImage(form, Marker()).data[0], 21);
}

TEST(FormImage, PadKeepsTheShapeAndStretchDoesNot) {
  ImageForm form = Form();
  form.width_px = form.height_px = 6;
  form.pad = true;
  Array array = FormImage(form, Marker());
  EXPECT_EQ(array.shape, (std::vector<int64_t>{6, 6, 3}));
  // An image of 3 x 2 becomes 6 x 4, with a black row above and below.
  for (size_t i = 0; i < 6 * 3; ++i) EXPECT_EQ(array.data[i], 0);
  for (size_t i = 5 * 6 * 3; i < 6 * 6 * 3; ++i) EXPECT_EQ(array.data[i], 0);
  EXPECT_EQ(array.data[6 * 3], 1);
  form.pad = false;
  array = FormImage(form, Marker());
  EXPECT_EQ(array.data[0], 1);
  EXPECT_EQ(array.data[6 * 6 * 3 - 1], 26);
}

TEST(FormImage, DepthKeepsItsNumbers) {
  ImageForm form;
  form.view.camera = "head";
  form.view.width_px = 2;
  form.view.height_px = 1;
  form.view.encoding = "depth32";
  form.mirror = true;
  image_t image{};
  image.view = form.view;
  const float depth[2] = {0.5, 2.25};
  image.data.resize(sizeof depth);
  std::memcpy(image.data.data(), depth, sizeof depth);
  const Array array = FormImage(form, image);
  EXPECT_EQ(array.dtype, "<f4");
  EXPECT_EQ(array.shape, (std::vector<int64_t>{1, 2}));
  EXPECT_EQ(Numbers(array), (std::vector<double>{2.25, 0.5}));
}

TEST(FormImage, AnotherImageIsRefused) {
  image_t image = Marker();
  image.data.pop_back();
  EXPECT_THROW(FormImage(Form(), image), std::runtime_error);
  image = Marker();
  image.view.camera = "front";
  EXPECT_THROW(FormImage(Form(), image), std::runtime_error);
}

// Expected values were computed by hand from the triangle filter. Halving weights pixels at distances of 0.25
// and 0.75 of the filter's half width by 0.75 and 0.25. Pixels beyond the edge are ignored.
TEST(Resize, HalvesByTheTriangleFilter) {
  const std::vector<uint8_t> row = {0, 80, 160, 240};
  // The left pixel is (0.75 x 0 + 0.75 x 80 + 0.25 x 160) / 1.75, and the right one is (0.25 x 80 + 0.75 x
  // 160 + 0.75 x 240) / 1.75.
  EXPECT_EQ(Resize(row, 4, 1, 1, 2, 1), (std::vector<uint8_t>{57, 183}));
  EXPECT_EQ(Resize(row, 1, 4, 1, 1, 2), (std::vector<uint8_t>{57, 183}));
  // Enlarging interpolates between pixels and repeats the edge's value at the edges.
  EXPECT_EQ(Resize(std::vector<uint8_t>{0, 100}, 2, 1, 1, 4, 1), (std::vector<uint8_t>{0, 25, 75, 100}));
  EXPECT_EQ(Resize(std::vector<uint8_t>(64, 200), 8, 8, 1, 3, 5), std::vector<uint8_t>(15, 200));
}

}  // namespace evalbus::policy::image_form_test
