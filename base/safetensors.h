// Files of tensors: u64 little-endian length n of the header; the header, n bytes of JSON
// {name: {dtype, shape, data_offsets: [begin, end]}, "__metadata__": {text: text}}; then the numbers, little
// endian, C order, with offsets counted from the end of the header. Format: huggingface/safetensors.
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

  // Numbers of a tensor of F64, F32, I64, I32, U8 or BOOL. Throws InputError for another one.
  std::vector<double> Numbers() const;
};
Tensor DoubleTensor(const std::vector<double>& numbers, std::vector<int64_t> shape);  // F64
Tensor ByteTensor(std::vector<uint8_t> numbers, std::vector<int64_t> shape,
                  const char* dtype = "U8");  // or BOOL

struct Safetensors {
  // In the order of the file's numbers.
  std::vector<std::pair<std::string, Tensor>> tensors;
  std::map<std::string, std::string> metadata;

  // Null if there is no tensor of this name.
  const Tensor* Find(const std::string& name) const;
};

// Both throw InputError, one line that names the file, for a header that is above 100 MB, longer than the
// file or not JSON, for tensors that overlap, leave a gap or do not have the size of their shape, and for a
// truncated file. They allocate memory in proportion to the bytes that exist, not to the sizes that the
// header states.
Safetensors ParseSafetensors(std::span<const uint8_t> bytes, const std::string& file);
Safetensors ReadSafetensors(const std::filesystem::path& file);

// The header is padded with spaces to a multiple of 8 bytes.
std::string EncodeSafetensors(const Safetensors& content);

}  // namespace evalbus
