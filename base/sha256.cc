#include "base/sha256.h"

#include <openssl/evp.h>

#include <array>
#include <memory>

#include "base/input_file.h"

namespace evalbus {
namespace {

class Sha256 {
 public:
  Sha256() { EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr); }
  void Add(std::string_view bytes) { EVP_DigestUpdate(context_.get(), bytes.data(), bytes.size()); }
  std::string Text() {
    std::array<unsigned char, 32> digest{};
    EVP_DigestFinal_ex(context_.get(), digest.data(), nullptr);
    std::string text;
    for (unsigned char byte : digest) {
      constexpr const char* kDigits = "0123456789abcdef";
      text += {kDigits[byte >> 4], kDigits[byte & 15]};
    }
    return text;
  }

 private:
  std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context_{EVP_MD_CTX_new(), &EVP_MD_CTX_free};
};

}  // namespace

std::string Sha256File(const std::filesystem::path& file) {
  const InputFile input(file);
  Sha256 sha256;
  std::array<char, 65536> block{};
  uint64_t position = 0;
  while (const size_t n = input.ReadAt(position, block)) {
    sha256.Add({block.data(), n});
    position += n;
  }
  return sha256.Text();
}

std::string Sha256Text(std::string_view text) {
  Sha256 sha256;
  sha256.Add(text);
  return sha256.Text();
}

}  // namespace evalbus
