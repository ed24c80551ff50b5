#include "viz/viewer/pack.h"

#include <zlib.h>

#include "base/base64.h"
#include "base/errors.h"

namespace evalbus::viz {

std::string Deflated(const std::string& bytes) {
  uLongf length = compressBound(bytes.size());
  std::string deflated(length, '\0');
  if (compress2(reinterpret_cast<Bytef*>(deflated.data()), &length,
                reinterpret_cast<const Bytef*>(bytes.data()), bytes.size(), Z_DEFAULT_COMPRESSION) != Z_OK) {
    throw EnvironmentError("zlib has no memory left");
  }
  deflated.resize(length);
  return deflated;
}

std::string Packed(const std::string& block) { return Base64(Deflated(block)); }

}  // namespace evalbus::viz
