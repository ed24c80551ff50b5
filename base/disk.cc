#include "base/disk.h"

#include <sys/statvfs.h>

#include <cstdint>

namespace evalbus {

std::string WhyNotWritable(const std::filesystem::path& folder) {
  constexpr uint64_t kAlmostNone = 64 << 10;  // bytes
  struct statvfs disk {};
  if (statvfs(folder.c_str(), &disk) != 0) return "";
  if ((disk.f_flag & ST_RDONLY) != 0) return "the disk of " + folder.string() + " is read-only";
  if (uint64_t{disk.f_bavail} * disk.f_frsize <= kAlmostNone) {
    return "no space left on the disk of " + folder.string();
  }
  // Some file systems do not count inodes.
  if (disk.f_files > 0 && disk.f_favail == 0) return "no inodes left on the disk of " + folder.string();
  return "";
}

}  // namespace evalbus
