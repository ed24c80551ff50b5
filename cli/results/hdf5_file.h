// A file in HDF5's format, written from beginning to end; a thin cover of HDF5's C library.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "base/write_whole.h"

namespace evalbus::results {

// Reads a dataset of one or two dimensions of whole or floating numbers. Throws InputError, one line: no such
// dataset, another kind or shape, more than 100 million numbers, a damaged file.
struct Hdf5Numbers {
  std::vector<int64_t> shape;
  std::vector<double> numbers;
};
Hdf5Numbers ReadHdf5(const std::filesystem::path& file, const std::string& path);

class Hdf5File {
 public:
  // Creates the file under a temporary name beside it. Throws EnvironmentError, as do the other functions: a
  // file that was finished holds all that was written.
  explicit Hdf5File(const std::filesystem::path& file);
  // Takes the half-written file away, unless it was finished.
  ~Hdf5File();
  Hdf5File(const Hdf5File&) = delete;
  Hdf5File& operator=(const Hdf5File&) = delete;

  // Paths like "data/demo_0/obs/joint_position"; groups on the way are made.
  void Write(const std::string& path, const std::vector<double>& numbers, const std::vector<int64_t>& shape);
  void Write(const std::string& path, const std::vector<std::string>& texts);
  // A dataset of bytes whose rows, each of row_shape, are deflated (zlib) already.
  void WriteDeflated(const std::string& path, const std::vector<int64_t>& row_shape,
                     const std::vector<std::string_view>& rows);
  // A view of this shape on other datasets of bytes: all rows of `rows` but its first, then the row of
  // `last`. HDF5 calls it a virtual dataset.
  void WriteShifted(const std::string& path, const std::vector<int64_t>& shape, const std::string& rows,
                    const std::string& last);
  void SetAttribute(const std::string& path, const std::string& name, const std::string& text);
  void SetAttribute(const std::string& path, const std::string& name, int64_t number);
  void SetAttribute(const std::string& path, const std::string& name, const std::vector<double>& numbers);

  // Closes it, syncs it and gives it its name.
  void Finish();

 private:
  void Need(bool good, const std::string& what) const;

  std::filesystem::path file_;
  WholeFile whole_;
  int64_t id_ = -1;
};

}  // namespace evalbus::results
