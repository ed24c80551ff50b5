#include "base/base64.h"

#include <openssl/evp.h>

namespace evalbus {

std::string Base64(std::string_view bytes) {
  // OpenSSL stores lengths in int, so long input is encoded in parts. Three bytes become four characters, so
  // the encodings of parts whose length is a multiple of three can be joined.
  constexpr size_t kPart = size_t{3} << 20;
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (size_t begin = 0; begin < bytes.size(); begin += kPart) {
    const std::string_view part = bytes.substr(begin, kPart);
    // OpenSSL appends a terminating zero.
    std::string piece((part.size() + 2) / 3 * 4 + 1, '\0');
    const int length =
        EVP_EncodeBlock(reinterpret_cast<unsigned char*>(piece.data()),
                        reinterpret_cast<const unsigned char*>(part.data()), static_cast<int>(part.size()));
    text.append(piece, 0, static_cast<size_t>(length));
  }
  return text;
}

std::string Base64(const std::vector<uint8_t>& bytes) {
  return Base64(std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
}

}  // namespace evalbus
