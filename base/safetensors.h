// Reads and writes files of tensors in the format of huggingface/safetensors. A file begins with the length n
// of the header (u64, little-endian). The header follows, n bytes of JSON: {name: {dtype, shape,
// data_offsets: [begin, end]}, "__metadata__": {text: text}}. Then the numbers follow, little-endian and in C
// order. Offsets count from the end of the header.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace evalbus {

struct Tensor {
  // "F64", "F32", "I64", "I32", "U8", "BOOL", ...
  std::string dtype;
  std::vector<int64_t> shape;
  std::vector<uint8_t> data;

  // Returns the numbers of a tensor of F64, F32, I64, I32, U8 or BOOL. Throws InputError for other types.
  std::vector<double> Numbers() const;
};
Tensor DoubleTensor(const std::vector<double>& numbers, std::vector<int64_t> shape);  // F64
Tensor ByteTensor(std::vector<uint8_t> numbers, std::vector<int64_t> shape,
                  const char* dtype = "U8");  // dtype: "U8" or "BOOL"

struct Safetensors {
  // Names and tensors, in the order of their numbers in the file.
  std::vector<std::pair<std::string, Tensor>> tensors;
  std::map<std::string, std::string> metadata;

  // Returns the tensor with this name; null if there is none.
  const Tensor* Find(const std::string& name) const;
};

// Both functions throw InputError, one line that names the file, if the file does not have this format: the
// header is above 100 MB, longer than the file or malformed; tensors overlap, leave a gap or do not have the
// size of their shape; or the file is truncated. ReadSafetensors() also throws the errors of InputFile. The
// allocated memory is proportional to the bytes that exist, not to the sizes that the header states.
Safetensors ParseSafetensors(std::span<const uint8_t> bytes, const std::string& file);
Safetensors ReadSafetensors(const std::filesystem::path& file);

// Returns the contents of a file. The header is padded with spaces to a multiple of 8 bytes.
std::string EncodeSafetensors(const Safetensors& content);

}  // namespace evalbus
