#include "base/plugins.h"

#include <dlfcn.h>

#include <cstdlib>
#include <sstream>
#include <string>

#include "base/errors.h"

namespace evalbus {

namespace fs = std::filesystem;

namespace {

void Load(const char* variable, const fs::path& plugin) {
  const std::string place = variable + (": " + plugin.string());
  // dlopen would search a bare name in the system's folders, and a relative path depends on the folder of
  // each process.
  if (!plugin.is_absolute()) throw InputError(place + ": expected an absolute path");
  // If the path is a FIFO, dlopen would block until a process opens it for writing.
  std::error_code ignored;
  if (fs::exists(plugin, ignored) && !fs::is_regular_file(plugin, ignored)) {
    throw InputError(place + ": is not a regular file");
  }
  void* const library = dlopen(plugin.c_str(), RTLD_NOW);
  if (!library) throw InputError(variable + std::string(": ") + dlerror());
  const auto* const version = static_cast<const char*>(dlsym(library, "evalbus_plugin_version"));
  const auto begin = reinterpret_cast<void (*)()>(dlsym(library, "evalbus_plugin"));
  if (!version || !begin)
    throw InputError(place + ": is not an evalbus plugin: it has no EVALBUS_PLUGIN { }");
  if (std::string(version) != EVALBUS_PLUGIN_VERSION) {
    throw InputError(place + ": was built for evalbus " + version + ", this is " EVALBUS_PLUGIN_VERSION);
  }
  begin();
}

}  // namespace

std::vector<fs::path> PluginsOf(const char* variable) {
  std::vector<fs::path> plugins;
  const char* const list = std::getenv(variable);
  std::istringstream words(list ? list : "");
  for (std::string word; std::getline(words, word, ':');) {
    if (!word.empty()) plugins.emplace_back(word);
  }
  return plugins;
}

std::optional<int> LoadPlugins(const char* variable) {
  try {
    for (const fs::path& plugin : PluginsOf(variable)) Load(variable, plugin);
    return std::nullopt;
  } catch (const std::exception& error) {
    return ReportError(error);
  } catch (...) {
    return ReportError(EnvironmentError(kNotAnException));
  }
}

}  // namespace evalbus
