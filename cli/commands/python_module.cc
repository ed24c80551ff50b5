#include "cli/commands/python_module.h"

#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "base/errors.h"
#include "base/installed.h"

namespace evalbus::commands {
namespace {

namespace fs = std::filesystem;

// Returns the folder that contains the Python package `evalbus`, in an installation, the source tree, or a
// wheel. In a wheel, the package itself contains the programs.
fs::path PackageParent() {
  const fs::path programs = ProgramFolder();
  for (const fs::path& folder : {SharedData("python", ""), programs.parent_path().parent_path() / "python",
                                 programs.parent_path().parent_path()}) {
    if (fs::exists(folder / "evalbus/__init__.py")) return folder;
  }
  throw EnvironmentError(programs.string() +
                         ": the Python package evalbus is not installed with this program");
}

}  // namespace

void ExecPythonModule(const std::string& module, const std::vector<std::string>& arguments) {
  const char* const chosen = std::getenv("EVALBUS_PYTHON");
  const std::string python = chosen && *chosen ? chosen : "python3";
  const char* const path = std::getenv("PYTHONPATH");
  const fs::path package = PackageParent();
  setenv("PYTHONPATH", (package.string() + (path && *path ? std::string(":") + path : "")).c_str(), 1);
  setenv("EVALBUS_BIN", ProgramFolder().c_str(), 1);
  std::vector<std::string> words = {python, "-B", package / "evalbus/start_module.py", module};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  execvp(argv[0], argv.data());
  throw EnvironmentError(python + ": " + std::strerror(errno) + "; set EVALBUS_PYTHON to another Python");
}

}  // namespace evalbus::commands
