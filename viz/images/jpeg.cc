#include "viz/images/jpeg.h"

#include <turbojpeg.h>

#include <string>

#include "base/errors.h"

namespace evalbus::viz {

JpegEncoder::JpegEncoder() : encoder_(tjInitCompress(), tjDestroy) {
  if (!encoder_) throw EnvironmentError(std::string("libjpeg-turbo: ") + tjGetErrorStr2(nullptr));
}

std::vector<uint8_t> JpegEncoder::Encode(const Frame& frame) {
  constexpr int kQuality = 85;
  const auto [width, height] = frame.size;
  std::vector<uint8_t> jpeg(tjBufSize(width, height, TJSAMP_420));
  uint8_t* begin = jpeg.data();
  unsigned long size = jpeg.size();
  if (tjCompress2(encoder_.get(), frame.bgrx.data(), width, width * 4, height, TJPF_BGRX, &begin, &size,
                  TJSAMP_420, kQuality, TJFLAG_NOREALLOC) != 0) {
    throw EnvironmentError(std::string("libjpeg-turbo: ") + tjGetErrorStr2(encoder_.get()));
  }
  jpeg.resize(size);
  return jpeg;
}

}  // namespace evalbus::viz
