// A thin wrapper around HDF5's C library that writes files sequentially and reads datasets.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "base/write_whole.h"

namespace evalbus::exports {

// Reads a dataset with one or two dimensions of integers or floating-point numbers. Throws InputError if the
// dataset does not exist, has a different type or shape, has more than 100 million numbers, or is stored in
// another file or dataset, or if the file is damaged.
struct Hdf5Numbers {
  std::vector<int64_t> shape;
  std::vector<double> numbers;
};
Hdf5Numbers ReadHdf5(const std::filesystem::path& file, const std::string& path);

// Reads a dataset of strings that Hdf5File::Write() wrote. Throws InputError.
std::vector<std::string> ReadHdf5Texts(const std::filesystem::path& file, const std::string& path);

class Hdf5File {
 public:
  // Creates the file under a temporary name in the same folder. All functions throw EnvironmentError if they
  // fail (the constructor and Finish() may also throw InputError, see WholeFile), so a finished file contains
  // everything that was written.
  explicit Hdf5File(const std::filesystem::path& file);
  // Removes the partially written file, unless Finish() was called.
  ~Hdf5File();
  Hdf5File(const Hdf5File&) = delete;
  Hdf5File& operator=(const Hdf5File&) = delete;

  // Paths have the form "data/demo_0/obs/joint_position"; missing groups are created.
  void Write(const std::string& path, const std::vector<double>& numbers, const std::vector<int64_t>& shape);
  void Write(const std::string& path, const std::vector<std::string>& texts);
  // Writes a dataset of bytes. Each row has the shape row_shape and must already be deflated (zlib).
  void WriteDeflated(const std::string& path, const std::vector<int64_t>& row_shape,
                     const std::vector<std::string_view>& rows);
  // Writes a virtual dataset of this shape. It is a view of all rows of `rows` except the first, followed by
  // the row of `last`.
  void WriteShifted(const std::string& path, const std::vector<int64_t>& shape, const std::string& rows,
                    const std::string& last);
  void SetAttribute(const std::string& path, const std::string& name, const std::string& text);
  void SetAttribute(const std::string& path, const std::string& name, int64_t number);
  void SetAttribute(const std::string& path, const std::string& name, const std::vector<double>& numbers);

  // Closes and syncs the file, and renames it to its final name.
  void Finish();

 private:
  void Need(bool good, const std::string& what) const;

  std::filesystem::path file_;
  WholeFile whole_;
  int64_t id_ = -1;
};

}  // namespace evalbus::exports
