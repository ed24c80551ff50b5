#include "base/installed.h"

namespace evalbus {

std::filesystem::path ProgramFolder() {
  return std::filesystem::read_symlink("/proc/self/exe").parent_path();
}

std::filesystem::path SharedData(const std::string& name, const std::filesystem::path& otherwise) {
  const auto beside = (ProgramFolder() / "../share/evalbus" / name).lexically_normal();
  std::error_code error;
  return std::filesystem::exists(beside, error) ? beside : otherwise;
}

}  // namespace evalbus
