#include "sim/jpeg_check.h"

#include <fmt/format.h>
#include <turbojpeg.h>

#include <memory>
#include <vector>

#include "base/errors.h"
#include "base/text.h"

namespace evalbus::sim {

std::string JpegFault(std::span<const uint8_t> jpeg, int width_px, int height_px) {
  const std::unique_ptr<void, int (*)(void*)> decoder(tjInitDecompress(), tjDestroy);
  if (!decoder) throw EnvironmentError(std::string("libjpeg-turbo: ") + tjGetErrorStr2(nullptr));
  const auto fault = [&] { return "not a valid JPEG: " + Printable(tjGetErrorStr2(decoder.get())); };
  int width = 0, height = 0, subsampling = 0, colors = 0;
  if (tjDecompressHeader3(decoder.get(), jpeg.data(), jpeg.size(), &width, &height, &subsampling, &colors) !=
      0)
    return fault();
  if (width != width_px || height != height_px) {
    return fmt::format("the JPEG has {}x{} pixels, the message states {}x{}", width, height, width_px,
                       height_px);
  }
  constexpr tjscalingfactor kEighth{1, 8};
  const int small_width = TJSCALED(width, kEighth), small_height = TJSCALED(height, kEighth);
  std::vector<uint8_t> gray(static_cast<size_t>(small_width) * static_cast<size_t>(small_height));
  if (tjDecompress2(decoder.get(), jpeg.data(), jpeg.size(), gray.data(), small_width, 0, small_height,
                    TJPF_GRAY, TJFLAG_FASTDCT) != 0) {
    return fault();
  }
  return "";
}

}  // namespace evalbus::sim
