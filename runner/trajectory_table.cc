#include "runner/trajectory_table.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <string_view>

#include "base/errors.h"
#include "base/input_file.h"
#include "base/number_from.h"
#include "base/text.h"
#include "export/hdf5_file.h"
#include "models/yaml_reader.h"
#include "policy_bridge/wire/codecs.h"
#include "policy_bridge/wire/policy_client.h"

namespace evalbus::runner {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> Cells(std::string line) {
  if (line.ends_with('\r')) line.pop_back();
  std::vector<std::string> cells;
  for (size_t begin = 0;;) {
    const size_t end = line.find(',', begin);
    std::string cell = line.substr(begin, end - begin);
    const size_t first = cell.find_first_not_of(" \t"), last = cell.find_last_not_of(" \t");
    cell = first == std::string::npos ? "" : cell.substr(first, last - first + 1);
    const bool is_quoted = cell.size() >= 2 && cell.starts_with('"') && cell.ends_with('"');
    cells.push_back(is_quoted ? cell.substr(1, cell.size() - 2) : cell);
    if (end == std::string::npos) return cells;
    begin = end + 1;
  }
}

class Csv : public TrajectoryTable {
 public:
  explicit Csv(const fs::path& file) : TrajectoryTable(file.string()) {
    const std::string text = ReadInput(file);
    // Spreadsheet programs write a byte order mark before UTF-8 text.
    constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
    int line_number = 0;
    for (size_t begin = text.starts_with(kByteOrderMark) ? kByteOrderMark.size() : 0; begin < text.size();) {
      const size_t end = std::min(text.find('\n', begin), text.size());
      const std::string line = text.substr(begin, end - begin);
      begin = end + 1;
      ++line_number;
      const auto fail = [&](const std::string& what) {
        throw InputError(fmt::format("{}:{}: {}", file_, line_number, what));
      };
      if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
      const std::vector<std::string> cells = Cells(line);
      if (names_.empty()) {
        names_ = cells;
        columns_.resize(names_.size());
        continue;
      }
      if (cells.size() != names_.size()) {
        fail(fmt::format("expected {} values, one for each column, got {}", names_.size(), cells.size()));
      }
      for (size_t k = 0; k < cells.size(); ++k) {
        const auto number = NumberFrom<double>(cells[k]);
        if (!number) {
          fail(fmt::format("column '{}': expected a number, got '{}'", Printable(names_[k]),
                           Printable(Cut(cells[k], 40))));
        }
        columns_[k].push_back(*number);
      }
      lines_.push_back(line_number);
    }
    if (lines_.empty()) throw InputError(file_ + ": expected a line of names, then lines of numbers");
  }
  std::string Place(size_t row) const override { return fmt::format("{}:{}", file_, lines_[row]); }

 protected:
  std::vector<double> Read(const std::string& name) override {
    const auto found = std::ranges::find(names_, name);
    if (found == names_.end()) {
      throw InputError(file_ + ": no column '" + Printable(name) + "'" + Suggestion(name, names_));
    }
    if (std::ranges::count(names_, name) > 1)
      throw InputError(file_ + ": column '" + name + "' is given twice");
    return columns_[static_cast<size_t>(found - names_.begin())];
  }

 private:
  std::vector<std::string> names_;
  std::vector<std::vector<double>> columns_;
  std::vector<int> lines_;
};

// Splits a name such as "q[3]" into "q" and 3.
std::pair<std::string, std::optional<size_t>> SplitIndex(const std::string& name) {
  const size_t open = name.rfind('[');
  if (open == std::string::npos || !name.ends_with(']')) return {name, {}};
  const auto index = NumberFrom<size_t>(name.substr(open + 1, name.size() - open - 2));
  return {index ? name.substr(0, open) : name, index};
}

class Arrays : public TrajectoryTable {
 protected:
  explicit Arrays(std::string file) : TrajectoryTable(std::move(file)) {}
  virtual exports::Hdf5Numbers Array(const std::string& name) = 0;
  std::vector<double> Read(const std::string& name) override {
    const auto [array, index] = SplitIndex(name);
    auto found = arrays_.find(array);
    if (found == arrays_.end()) found = arrays_.emplace(array, Array(array)).first;
    const exports::Hdf5Numbers& numbers = found->second;
    if (numbers.shape.size() == 1 && !index) return numbers.numbers;
    if (numbers.shape.size() != 2 || !index || *index >= static_cast<size_t>(numbers.shape[1])) {
      throw InputError(fmt::format(
          "{}: '{}': the array has shape [{}]; expected {}", file_, Printable(name),
          fmt::join(numbers.shape, ", "),
          numbers.shape.size() == 1   ? "'" + array + "'"
          : numbers.shape.size() == 2 ? fmt::format("'{}[0]' to '{}[{}]'", array, array, numbers.shape[1] - 1)
                                      : "one or two dimensions"));
    }
    std::vector<double> column;
    const auto width = static_cast<size_t>(numbers.shape[1]);
    for (size_t i = *index; i < numbers.numbers.size(); i += width) column.push_back(numbers.numbers[i]);
    return column;
  }

 private:
  std::map<std::string, exports::Hdf5Numbers> arrays_;
};

class Npz : public Arrays {
 public:
  explicit Npz(const fs::path& file) : Arrays(file.string()), bytes_(ReadInput(file)) {
    entries_ = ZipEntries({reinterpret_cast<const uint8_t*>(bytes_.data()), bytes_.size()}, file_);
  }

 protected:
  exports::Hdf5Numbers Array(const std::string& name) override {
    std::vector<std::string> names;
    for (const ZipEntry& entry : entries_) {
      names.push_back(entry.name.ends_with(".npy") ? entry.name.substr(0, entry.name.size() - 4)
                                                   : entry.name);
      if (names.back() != name) continue;
      try {
        const policy::Array array = policy::DecodeNpy(entry.bytes);
        return {array.shape, policy::Numbers(array)};
      } catch (const std::exception& error) {
        throw InputError(file_ + ": '" + Printable(name) + "': " + error.what());
      }
    }
    throw InputError(file_ + ": no array '" + Printable(name) + "'" + Suggestion(name, names));
  }

 private:
  std::string bytes_;
  std::vector<ZipEntry> entries_;
};

class Hdf5 : public Arrays {
 public:
  explicit Hdf5(const fs::path& file) : Arrays(file.string()) {}

 protected:
  exports::Hdf5Numbers Array(const std::string& name) override { return exports::ReadHdf5(file_, name); }
};

}  // namespace

std::string TrajectoryTable::Place(size_t row) const { return fmt::format("{}, row {}", file_, row); }

std::vector<double> TrajectoryTable::Column(const std::string& name) {
  std::vector<double> column = Read(name);
  if (column.empty()) throw InputError(file_ + ": '" + Printable(name) + "' is empty");
  if (first_.empty()) {
    first_ = name;
    rows_ = column.size();
  }
  if (column.size() != rows_) {
    throw InputError(fmt::format("{}: '{}' has {} rows, '{}' has {}", file_, Printable(name), column.size(),
                                 Printable(first_), rows_));
  }
  for (size_t row = 0; row < column.size(); ++row) {
    if (std::isfinite(column[row])) continue;
    throw InputError(fmt::format("{}: column '{}' is {}, expected a finite number", Place(row),
                                 Printable(name), column[row]));
  }
  return column;
}

std::unique_ptr<TrajectoryTable> OpenTable(const fs::path& file) {
  const std::string ending = file.extension();
  if (ending == ".csv") return std::make_unique<Csv>(file);
  if (ending == ".npz") return std::make_unique<Npz>(file);
  if (ending == ".hdf5" || ending == ".h5") return std::make_unique<Hdf5>(file);
  throw InputError(file.string() + ": expected a file that ends in .csv, .npz, .hdf5 or .h5");
}

// Reads the central directory at the end of the file (PKWARE's APPNOTE.TXT, 4.3).
std::vector<ZipEntry> ZipEntries(std::span<const uint8_t> bytes, const std::string& file) {
  const auto fail = [&](const std::string& what) { throw InputError(file + ": " + what); };
  const auto number = [&](size_t at, size_t size) {
    if (at > bytes.size() || size > bytes.size() - at) fail("truncated: not a complete zip file");
    uint64_t value = 0;
    for (size_t i = size; i-- > 0;) value = value << 8 | bytes[at + i];
    return value;
  };
  constexpr size_t kEnd = 22, kLongestComment = 65535;
  if (bytes.size() < kEnd) fail("not an npz file: too short");
  std::optional<size_t> end;
  for (size_t at = bytes.size() - kEnd; !end; --at) {
    if (number(at, 4) == 0x06054b50) end = at;
    if (at == 0 || bytes.size() - at > kLongestComment + kEnd) break;
  }
  if (!end) fail("not an npz file, or truncated: the end of the zip file is missing");
  const uint64_t count = number(*end + 10, 2);
  uint64_t at = number(*end + 16, 4);
  std::vector<ZipEntry> entries;
  for (uint64_t i = 0; i < count; ++i) {
    if (number(at, 4) != 0x02014b50) fail("damaged: its list of arrays is invalid");
    const uint64_t method = number(at + 10, 2), size = number(at + 20, 4), name_length = number(at + 28, 2);
    const uint64_t extra = number(at + 30, 2), comment = number(at + 32, 2), local = number(at + 42, 4);
    number(at + 46, name_length);
    std::string name(reinterpret_cast<const char*>(bytes.data()) + at + 46, name_length);
    if (method != 0) fail("'" + Printable(name) + "' is compressed; write it with np.savez");
    if (size == 0xffffffff || local == 0xffffffff) fail("'" + Printable(name) + "' is larger than 4 GB");
    if (number(local, 4) != 0x04034b50)
      fail("damaged: '" + Printable(name) + "' is not where the list of arrays locates it");
    const uint64_t begin = local + 30 + number(local + 26, 2) + number(local + 28, 2);
    if (begin > bytes.size() || size > bytes.size() - begin)
      fail("truncated: '" + Printable(name) + "' is not complete");
    const auto content = bytes.subspan(begin, size);
    if (crc32_z(0, content.data(), content.size()) != number(at + 16, 4))
      fail("damaged: '" + Printable(name) + "' does not match its checksum (CRC-32)");
    entries.push_back({std::move(name), content});
    at += 46 + name_length + extra + comment;
  }
  return entries;
}

}  // namespace evalbus::runner
