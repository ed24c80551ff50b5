// Columns of numbers from a file of somebody else's: CSV with a line of names, npz of NumPy (np.savez), HDF5.
#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace evalbus::launch {

class TrajectoryTable {
 public:
  virtual ~TrajectoryTable() = default;
  // A column by its name: of CSV as in its first line; of npz and HDF5 the array's name, "q[3]" for a column
  // of one with two dimensions. Throws InputError that names the file and the column: there is none, another
  // length than the others, NaN.
  std::vector<double> Column(const std::string& name);
  // "FILE:12" or "FILE, row 12".
  virtual std::string Place(size_t row) const;

 protected:
  explicit TrajectoryTable(std::string file) : file_(std::move(file)) {}
  virtual std::vector<double> Read(const std::string& name) = 0;
  std::string file_;

 private:
  std::string first_;
  size_t rows_ = 0;
};

// By the file's ending. Throws InputError.
std::unique_ptr<TrajectoryTable> OpenTable(const std::filesystem::path& file);

// The arrays of an uncompressed zip file, of which npz is one; by name, their bytes in `bytes`. Throws
// InputError that names the file.
struct ZipEntry {
  std::string name;
  std::span<const uint8_t> bytes;
};
std::vector<ZipEntry> ZipEntries(std::span<const uint8_t> bytes, const std::string& file);

}  // namespace evalbus::launch
