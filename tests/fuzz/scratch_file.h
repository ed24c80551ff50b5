// Writes an input to a file, for code that reads files.
#pragma once

#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>

namespace evalbus {

class ScratchFolder {
 public:
  ScratchFolder() {
    std::string path = "/dev/shm/evalbus_fuzz_XXXXXX";
    if (!mkdtemp(path.data())) std::abort();
    path_ = path;
  }
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  std::filesystem::path Write(const std::string& name, const uint8_t* data, size_t size) const {
    const std::filesystem::path file = path_ / name;
    std::ofstream(file, std::ios::binary)
        .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
    return file;
  }
  std::filesystem::path Write(const std::string& name, const std::string& text) const {
    return Write(name, reinterpret_cast<const uint8_t*>(text.data()), text.size());
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace evalbus
