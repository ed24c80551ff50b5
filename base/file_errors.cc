#include "base/file_errors.h"

#include <cerrno>
#include <cstring>

#include "base/errors.h"

namespace evalbus {

void ThrowFileError(const std::string& what, int error) {
  const std::string text = what + ": " + std::strerror(error);
  switch (error) {
    case ENOENT:
    case ENOTDIR:
    case EISDIR:
    case EEXIST:
    case EACCES:
    case EPERM:
    case ENAMETOOLONG:
    case ELOOP:
      throw InputError(text);
    default:
      throw EnvironmentError(text);
  }
}

}  // namespace evalbus
