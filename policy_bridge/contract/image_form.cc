#include "policy_bridge/contract/image_form.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace evalbus::policy {
namespace {

// Weights of the input pixels for one output pixel of a row. weights[0] belongs to pixel `first`. Unit:
// 2^-kWeightBits.
struct Taps {
  int first = 0;
  std::vector<int32_t> weights;
};
constexpr int kWeightBits = 32 - 8 - 2;

std::vector<Taps> TriangleTaps(int size, int to_size) {
  const double scale = static_cast<double>(size) / to_size, support = std::max(scale, 1.0);
  std::vector<Taps> all(static_cast<size_t>(to_size));
  for (int i = 0; i < to_size; ++i) {
    const double center = (i + 0.5) * scale;
    const int first = std::max(0, static_cast<int>(std::floor(center - support + 0.5)));
    const int end = std::min(size, static_cast<int>(std::floor(center + support + 0.5)));
    std::vector<double> weights;
    double sum = 0;
    for (int x = first; x < end; ++x) {
      const double distance = std::abs((x - center + 0.5) / support);
      weights.push_back(std::max(0.0, 1 - distance));
      sum += weights.back();
    }
    Taps& taps = all[static_cast<size_t>(i)];
    taps.first = first;
    for (const double weight : weights) {
      taps.weights.push_back(static_cast<int32_t>(std::floor(weight / sum * (1 << kWeightBits) + 0.5)));
    }
  }
  return all;
}

uint8_t ToLevel(int64_t sum) { return static_cast<uint8_t>(std::clamp<int64_t>(sum >> kWeightBits, 0, 255)); }

struct Pixels {
  std::vector<uint8_t> data;
  int width, height, channels;

  uint8_t at(int x, int y, int c) const { return data[static_cast<size_t>((y * width + x) * channels + c)]; }
};

// Creates an image of this size. pixel(x, y, channel) returns the value of a channel.
template <class Pixel>
Pixels Draw(int width, int height, int channels, const Pixel& pixel) {
  const size_t size =
      static_cast<size_t>(width) * static_cast<size_t>(height) * static_cast<size_t>(channels);
  Pixels to{std::vector<uint8_t>(size), width, height, channels};
  size_t next = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < channels; ++c) to.data[next++] = pixel(x, y, c);
    }
  }
  return to;
}

Pixels Resized(const Pixels& from, int to_width, int to_height) {
  constexpr int64_t kHalf = int64_t{1} << (kWeightBits - 1);
  const auto weigh = [](const Taps& taps, const auto& pixel) {
    int64_t sum = kHalf;
    for (size_t k = 0; k < taps.weights.size(); ++k) {
      sum += int64_t{taps.weights[k]} * pixel(taps.first + static_cast<int>(k));
    }
    return ToLevel(sum);
  };
  Pixels wide = from;
  if (to_width != from.width) {
    const std::vector<Taps> taps = TriangleTaps(from.width, to_width);
    wide = Draw(to_width, from.height, from.channels, [&](int x, int y, int c) {
      return weigh(taps[static_cast<size_t>(x)], [&](int i) { return from.at(i, y, c); });
    });
  }
  if (to_height == from.height) return wide;
  const std::vector<Taps> taps = TriangleTaps(from.height, to_height);
  return Draw(to_width, to_height, from.channels, [&](int x, int y, int c) {
    return weigh(taps[static_cast<size_t>(y)], [&](int i) { return wide.at(x, i, c); });
  });
}

// Resizes as openpi's image_tools.resize_with_pad does.
Pixels ResizedWithPad(const Pixels& from, int width, int height) {
  const double ratio =
      std::max(static_cast<double>(from.width) / width, static_cast<double>(from.height) / height);
  const int inner_width = std::max(1, static_cast<int>(from.width / ratio));
  const int inner_height = std::max(1, static_cast<int>(from.height / ratio));
  const Pixels inner = Resized(from, inner_width, inner_height);
  const int left = (width - inner_width) / 2, top = (height - inner_height) / 2;
  return Draw(width, height, from.channels, [&](int x, int y, int c) -> uint8_t {
    const bool is_inside = x >= left && x < left + inner_width && y >= top && y < top + inner_height;
    return is_inside ? inner.at(x - left, y - top, c) : 0;
  });
}

// Rotates counter-clockwise, then mirrors. Pixels may have any number of bytes.
Pixels Turned(const Pixels& from, int rotate_deg, bool mirror) {
  const bool is_upright = rotate_deg % 180 == 0;
  const int width = is_upright ? from.width : from.height, height = is_upright ? from.height : from.width;
  return Draw(width, height, from.channels, [&](int x, int y, int c) {
    if (mirror) x = width - 1 - x;
    switch (rotate_deg) {
      case 90:
        return from.at(from.width - 1 - y, x, c);
      case 180:
        return from.at(from.width - 1 - x, from.height - 1 - y, c);
      case 270:
        return from.at(y, from.height - 1 - x, c);
      default:
        return from.at(x, y, c);
    }
  });
}

}  // namespace

std::vector<uint8_t> Resize(std::span<const uint8_t> pixels, int width, int height, int channels,
                            int to_width, int to_height) {
  return Resized({{pixels.begin(), pixels.end()}, width, height, channels}, to_width, to_height).data;
}

Array FormImage(const ImageForm& form, const image_t& image) {
  const view_t &wanted = form.view, &view = image.view;
  const bool is_depth = wanted.encoding == "depth32";
  const int bytes_per_pixel = is_depth ? 4 : 3;
  const size_t size = static_cast<size_t>(wanted.width_px) * static_cast<size_t>(wanted.height_px) *
                      static_cast<size_t>(bytes_per_pixel);
  if (view.camera != wanted.camera || view.encoding != wanted.encoding || view.width_px != wanted.width_px ||
      view.height_px != wanted.height_px || image.data.size() != size) {
    throw std::runtime_error("an image of camera " + view.camera +
                             " does not have the requested camera, size or encoding");
  }
  Pixels pixels{image.data, view.width_px, view.height_px, bytes_per_pixel};
  if (form.rotate_deg != 0 || form.mirror) pixels = Turned(pixels, form.rotate_deg, form.mirror);
  if (form.width_px > 0 && (form.width_px != pixels.width || form.height_px != pixels.height)) {
    pixels = form.pad ? ResizedWithPad(pixels, form.width_px, form.height_px)
                      : Resized(pixels, form.width_px, form.height_px);
  }
  if (is_depth) return {"<f4", {pixels.height, pixels.width}, std::move(pixels.data)};
  const auto channel = [&](int c) { return form.bgr ? 2 - c : c; };
  if (form.chw) {
    Array array{"|u1", {3, pixels.height, pixels.width}, {}};
    array.data.reserve(pixels.data.size());
    for (int c = 0; c < 3; ++c) {
      for (int y = 0; y < pixels.height; ++y) {
        for (int x = 0; x < pixels.width; ++x) array.data.push_back(pixels.at(x, y, channel(c)));
      }
    }
    return array;
  }
  if (form.bgr) {
    for (size_t i = 0; i < pixels.data.size(); i += 3) std::swap(pixels.data[i], pixels.data[i + 2]);
  }
  return {"|u1", {pixels.height, pixels.width, 3}, std::move(pixels.data)};
}

}  // namespace evalbus::policy
