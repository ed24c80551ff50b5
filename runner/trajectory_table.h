// Reads columns of numbers from external files: CSV with a header line, NumPy's npz (np.savez), HDF5.
#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace evalbus::runner {

class TrajectoryTable {
 public:
  virtual ~TrajectoryTable() = default;
  // Returns a column by its name. In CSV, this is a name in the header line. In npz and HDF5, it is the
  // array's name, or "q[3]" for a column of a two-dimensional array. Throws InputError with file and column
  // if the column does not exist, is empty, differs in length from the other columns, or contains values that
  // are not finite.
  std::vector<double> Column(const std::string& name);
  // Returns the place of a row for messages, for example "FILE:12" or "FILE, row 12".
  virtual std::string Place(size_t row) const;

 protected:
  explicit TrajectoryTable(std::string file) : file_(std::move(file)) {}
  virtual std::vector<double> Read(const std::string& name) = 0;
  std::string file_;

 private:
  std::string first_;
  size_t rows_ = 0;
};

// Opens a table by the file's extension. Throws InputError.
std::unique_ptr<TrajectoryTable> OpenTable(const std::filesystem::path& file);

// Returns the entries of an uncompressed zip file, such as an npz file; their data refer to `bytes`. Throws
// InputError with the file's name.
struct ZipEntry {
  std::string name;
  std::span<const uint8_t> bytes;
};
std::vector<ZipEntry> ZipEntries(std::span<const uint8_t> bytes, const std::string& file);

}  // namespace evalbus::runner
