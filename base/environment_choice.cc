#include "base/environment_choice.h"

#include <cstdlib>

#include "base/errors.h"

namespace evalbus {

bool EnvironmentSelects(const char* variable, const std::string& other, const std::string& standard) {
  const char* const value = std::getenv(variable);
  if (!value || value == standard) return false;
  if (value == other) return true;
  throw InputError(std::string(variable) + ": expected " + standard + " or " + other + ", got " + value);
}

}  // namespace evalbus
