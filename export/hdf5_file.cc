#include "export/hdf5_file.h"

#include <hdf5.h>

#include <utility>

#include "base/errors.h"
#include "base/input_file.h"

namespace evalbus::exports {
namespace {

// Owns an identifier of the HDF5 library and closes it with the function for its kind.
class Handle {
 public:
  Handle(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  ~Handle() {
    if (id_ >= 0) close_(id_);
  }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  operator hid_t() const { return id_; }
  // Must be called for every object that is written, because the library buffers small data until then.
  // Returns false if writing fails.
  bool Close() { return close_(std::exchange(id_, -1)) >= 0; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

std::vector<hsize_t> Extents(const std::vector<int64_t>& shape) { return {shape.begin(), shape.end()}; }

// Returns link properties that create the missing groups of a dataset's path.
hid_t WithGroups() {
  const hid_t list = H5Pcreate(H5P_LINK_CREATE);
  H5Pset_create_intermediate_group(list, 1);
  return list;
}

// Returns dataset properties without a creation time, so that equal data give equal bytes.
hid_t NewLayout() {
  const hid_t list = H5Pcreate(H5P_DATASET_CREATE);
  H5Pset_obj_track_times(list, false);
  return list;
}

hid_t TextType() {
  const hid_t type = H5Tcopy(H5T_C_S1);
  H5Tset_size(type, H5T_VARIABLE);
  H5Tset_cset(type, H5T_CSET_UTF8);
  return type;
}

// Returns the operating system's reason for the last failure, for example "No space left on device", from the
// library's message. Empty if the library itself failed.
std::string SystemsReason() {
  std::string reason;
  const auto look = [](unsigned, const H5E_error2_t* error, void* found) -> herr_t {
    constexpr std::string_view kBefore = "error message = '";
    const std::string_view text = error->desc ? error->desc : "";
    const size_t begin = text.find(kBefore);
    if (begin == std::string_view::npos) return 0;
    const std::string_view rest = text.substr(begin + kBefore.size());
    *static_cast<std::string*>(found) = rest.substr(0, rest.find('\''));
    return 1;
  };
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, look, &reason);
  return reason;
}

// Must be called before any other function of the library. It disables the library's exit handler, which
// would write again to files that remained open because the disk is full, and crash. All files are closed
// explicitly instead.
void StartLibrary() {
  H5dont_atexit();
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

// A dataset that is opened for reading.
class OpenSet {
 public:
  // hint: added to the error if the dataset does not exist. Throws InputError.
  OpenSet(const std::filesystem::path& name, const std::string& path, const std::string& hint = "")
      : file_(OpenFile(name), H5Fclose),
        access_(WithoutExternalLinks(), H5Pclose),
        set_(H5Dopen2(file_, path.c_str(), access_), H5Dclose) {
    const auto fail = [&](const std::string& what) { throw InputError(name.string() + ": " + what); };
    if (file_ < 0) fail("not an HDF5 file, or truncated");
    if (set_ < 0) fail("no dataset '" + path + "'" + hint);
    const Handle creation(H5Dget_create_plist(set_), H5Pclose);
    if (H5Pget_external_count(creation) != 0 || H5Pget_layout(creation) == H5D_VIRTUAL) {
      fail("the numbers of '" + path +
           "' are stored in another file or dataset; expected them in this dataset");
    }
  }
  operator hid_t() const { return set_; }

 private:
  static hid_t OpenFile(const std::filesystem::path& name) {
    StartLibrary();
    CheckInput(name);
    return H5Fopen(name.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  }
  // Returns access properties that forbid external links, which may lead to other files, including pipes.
  static hid_t WithoutExternalLinks() {
    const hid_t access = H5Pcreate(H5P_DATASET_ACCESS);
    H5Pset_elink_cb(
        access, [](auto...) -> herr_t { return -1; }, nullptr);
    return access;
  }

  const Handle file_, access_, set_;
};

}  // namespace

Hdf5Numbers ReadHdf5(const std::filesystem::path& name, const std::string& path) {
  constexpr hsize_t kMax = 100'000'000;
  const auto fail = [&](const std::string& what) { throw InputError(name.string() + ": " + what); };
  const OpenSet set(name, path);
  const Handle type(H5Dget_type(set), H5Tclose), space(H5Dget_space(set), H5Sclose);
  const H5T_class_t kind = H5Tget_class(type);
  if (kind != H5T_INTEGER && kind != H5T_FLOAT) fail("'" + path + "' does not contain numbers");
  const int dimensions = H5Sget_simple_extent_ndims(space);
  if (dimensions < 1 || dimensions > 2) fail("'" + path + "' is not an array of one or two dimensions");
  hsize_t extents[2] = {0, 1};
  H5Sget_simple_extent_dims(space, extents, nullptr);
  if (extents[0] > kMax || extents[1] > kMax || extents[0] * extents[1] > kMax) {
    fail("'" + path + "' has more than 100 million numbers");
  }
  Hdf5Numbers result;
  for (int i = 0; i < dimensions; ++i) result.shape.push_back(static_cast<int64_t>(extents[i]));
  result.numbers.resize(extents[0] * extents[1]);
  if (H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, result.numbers.data()) < 0) {
    fail("'" + path + "' cannot be read: is the file damaged?");
  }
  return result;
}

std::vector<std::string> ReadHdf5Texts(const std::filesystem::path& name, const std::string& path) {
  constexpr hsize_t kMax = 10'000'000;
  const auto fail = [&](const std::string& what) { throw InputError(name.string() + ": " + what); };
  const OpenSet set(name, path, "; written by another program or an older version of evalbus?");
  const Handle found(H5Dget_type(set), H5Tclose), space(H5Dget_space(set), H5Sclose);
  const hssize_t size = H5Sget_simple_extent_npoints(space);
  if (H5Tis_variable_str(found) <= 0 || size < 0 || static_cast<hsize_t>(size) > kMax)
    fail("'" + path + "' does not contain strings of variable length, or contains more than 10 million");
  const Handle type(TextType(), H5Tclose);
  std::vector<char*> pointers(static_cast<size_t>(size));
  if (size > 0 && H5Dread(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, pointers.data()) < 0)
    fail("'" + path + "' cannot be read: is the file damaged?");
  std::vector<std::string> texts;
  for (const char* text : pointers) texts.emplace_back(text ? text : "");
  if (size > 0) H5Dvlen_reclaim(type, space, H5P_DEFAULT, pointers.data());
  return texts;
}

void Hdf5File::Need(bool good, const std::string& what) const {
  if (good) return;
  const std::string reason = SystemsReason();
  throw EnvironmentError("cannot write " + file_.string() + ": " +
                         (reason.empty() ? "HDF5 failed at " + what : reason + " (" + what + ")"));
}

Hdf5File::Hdf5File(const std::filesystem::path& file) : file_(file), whole_(file) {
  StartLibrary();
  id_ = H5Fcreate(whole_.path().c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  Need(id_ >= 0, "the beginning of the file");
}

Hdf5File::~Hdf5File() {
  if (id_ >= 0) H5Fclose(id_);
}

void Hdf5File::Finish() {
  Need(H5Fflush(id_, H5F_SCOPE_GLOBAL) >= 0, "the end of the file");
  Need(H5Fclose(std::exchange(id_, -1)) >= 0, "the end of the file");
  whole_.Finish();
}

void Hdf5File::Write(const std::string& path, const std::vector<double>& numbers,
                     const std::vector<int64_t>& shape) {
  const std::vector<hsize_t> extents = Extents(shape);
  const Handle space(H5Screate_simple(static_cast<int>(extents.size()), extents.data(), nullptr), H5Sclose);
  const Handle links(WithGroups(), H5Pclose), layout(NewLayout(), H5Pclose);
  Handle set(H5Dcreate2(id_, path.c_str(), H5T_IEEE_F64LE, space, links, layout, H5P_DEFAULT), H5Dclose);
  Need(set >= 0 && H5Dwrite(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, numbers.data()) >= 0 &&
           set.Close(),
       path);
}

void Hdf5File::Write(const std::string& path, const std::vector<std::string>& texts) {
  const hsize_t extent = texts.size();
  const Handle space(H5Screate_simple(1, &extent, nullptr), H5Sclose);
  const Handle links(WithGroups(), H5Pclose), layout(NewLayout(), H5Pclose);
  const Handle type(TextType(), H5Tclose);
  Handle set(H5Dcreate2(id_, path.c_str(), type, space, links, layout, H5P_DEFAULT), H5Dclose);
  std::vector<const char*> pointers;
  for (const std::string& text : texts) pointers.push_back(text.c_str());
  Need(set >= 0 &&
           (texts.empty() || H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, pointers.data()) >= 0) &&
           set.Close(),
       path);
}

void Hdf5File::WriteDeflated(const std::string& path, const std::vector<int64_t>& row_shape,
                             const std::vector<std::string_view>& rows) {
  std::vector<hsize_t> chunk = {1};
  chunk.insert(chunk.end(), row_shape.begin(), row_shape.end());
  std::vector<hsize_t> extents = chunk;
  extents[0] = rows.size();
  const Handle space(H5Screate_simple(static_cast<int>(extents.size()), extents.data(), nullptr), H5Sclose);
  const Handle links(WithGroups(), H5Pclose), layout(NewLayout(), H5Pclose);
  H5Pset_chunk(layout, static_cast<int>(chunk.size()), chunk.data());
  H5Pset_deflate(layout, 1);
  Handle set(H5Dcreate2(id_, path.c_str(), H5T_STD_U8LE, space, links, layout, H5P_DEFAULT), H5Dclose);
  Need(set >= 0, path);
  std::vector<hsize_t> begin(extents.size(), 0);
  for (; begin[0] < rows.size(); ++begin[0]) {
    const std::string_view row = rows[begin[0]];
    Need(H5Dwrite_chunk(set, H5P_DEFAULT, 0, begin.data(), row.size(), row.data()) >= 0, path);
  }
  Need(set.Close(), path);
}

void Hdf5File::WriteShifted(const std::string& path, const std::vector<int64_t>& shape,
                            const std::string& rows, const std::string& last) {
  std::vector<hsize_t> extents = Extents(shape), begin(extents.size(), 0), count = extents;
  const int dimensions = static_cast<int>(extents.size());
  const Handle space(H5Screate_simple(dimensions, extents.data(), nullptr), H5Sclose);
  const Handle links(WithGroups(), H5Pclose), layout(NewLayout(), H5Pclose);
  // Maps rows of a source dataset to rows of the view. The file name "." refers to this file.
  const auto take = [&](hsize_t to, const std::string& source, hsize_t source_rows, hsize_t from) {
    std::vector<hsize_t> source_extents = extents, source_begin = begin;
    source_extents[0] = source_rows;
    source_begin[0] = from;
    begin[0] = to;
    const Handle taken(H5Screate_simple(dimensions, source_extents.data(), nullptr), H5Sclose);
    H5Sselect_hyperslab(taken, H5S_SELECT_SET, source_begin.data(), nullptr, count.data(), nullptr);
    H5Sselect_hyperslab(space, H5S_SELECT_SET, begin.data(), nullptr, count.data(), nullptr);
    Need(H5Pset_virtual(layout, space, ".", source.c_str(), taken) >= 0, path);
    begin[0] = 0;
  };
  count[0] = extents[0] - 1;
  if (count[0] > 0) take(0, "/" + rows, extents[0], 1);
  count[0] = 1;
  take(extents[0] - 1, "/" + last, 1, 0);
  Handle set(H5Dcreate2(id_, path.c_str(), H5T_STD_U8LE, space, links, layout, H5P_DEFAULT), H5Dclose);
  Need(set >= 0 && set.Close(), path);
}

void Hdf5File::SetAttribute(const std::string& path, const std::string& name, const std::string& text) {
  Handle object(H5Oopen(id_, path.c_str(), H5P_DEFAULT), H5Oclose);
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  const Handle type(TextType(), H5Tclose);
  Handle attribute(H5Acreate2(object, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  const char* pointer = text.c_str();
  Need(attribute >= 0 && H5Awrite(attribute, type, &pointer) >= 0 && attribute.Close() && object.Close(),
       path + ", attribute " + name);
}

void Hdf5File::SetAttribute(const std::string& path, const std::string& name, int64_t number) {
  Handle object(H5Oopen(id_, path.c_str(), H5P_DEFAULT), H5Oclose);
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  Handle attribute(H5Acreate2(object, name.c_str(), H5T_STD_I64LE, space, H5P_DEFAULT, H5P_DEFAULT),
                   H5Aclose);
  Need(attribute >= 0 && H5Awrite(attribute, H5T_NATIVE_INT64, &number) >= 0 && attribute.Close() &&
           object.Close(),
       path + ", attribute " + name);
}

void Hdf5File::SetAttribute(const std::string& path, const std::string& name,
                            const std::vector<double>& numbers) {
  Handle object(H5Oopen(id_, path.c_str(), H5P_DEFAULT), H5Oclose);
  const hsize_t extent = numbers.size();
  const Handle space(H5Screate_simple(1, &extent, nullptr), H5Sclose);
  Handle attribute(H5Acreate2(object, name.c_str(), H5T_IEEE_F64LE, space, H5P_DEFAULT, H5P_DEFAULT),
                   H5Aclose);
  Need(attribute >= 0 && H5Awrite(attribute, H5T_NATIVE_DOUBLE, numbers.data()) >= 0 && attribute.Close() &&
           object.Close(),
       path + ", attribute " + name);
}

}  // namespace evalbus::exports
