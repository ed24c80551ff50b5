// Searches for tasks; see task_description.h.
#include <algorithm>
#include <cstdlib>

#include "base/errors.h"
#include "base/installed.h"
#include "models/task_description.h"
#include "models/task_family.h"
#include "models/yaml_reader.h"

namespace evalbus {
namespace {

// Returns the position after the YAML file's extension in `name`, where "/VARIATION" may follow; npos if
// `name` is not the path of a YAML file.
size_t EndOfFile(const std::string& name) {
  for (const std::string extension : {".yaml", ".yml"}) {
    const size_t dot = name.rfind(extension);
    if (dot == std::string::npos) continue;
    const size_t end = dot + extension.size();
    if (end == name.size() || name[end] == '/') return end;
  }
  return std::string::npos;
}

std::vector<TaskDescription> TasksIn(const std::filesystem::path& folder) {
  std::vector<TaskDescription> tasks;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".yaml") tasks.push_back(LoadTask(entry.path()));
  }
  std::sort(tasks.begin(), tasks.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
  return tasks;
}

}  // namespace

bool IsTaskFile(const std::string& name) { return EndOfFile(name) != std::string::npos; }

TaskSelection FindTask(const std::string& name) {
  if (const size_t end = EndOfFile(name); end != std::string::npos) {
    TaskDescription task = LoadTask(name.substr(0, end));
    const std::string variation = end == name.size() ? task.variations[0].name : name.substr(end + 1);
    task.Apply(variation);
    return {std::move(task), variation};
  }

  std::vector<TaskDescription> tasks = AllTasks();
  // "roboeval/lift_pot/position" is the variation "position" of the task "roboeval_lift_pot".
  std::string wanted = name, alias_prefix;
  for (const std::string& assets : AssetNames()) {
    if (!name.starts_with(assets + "/") && !name.starts_with(assets + "_")) continue;
    alias_prefix = assets + "_";
    wanted[assets.size()] = '_';
    tasks = TasksOfAssets(assets);
  }
  const size_t slash = wanted.find('/');
  const std::string task_name = wanted.substr(0, slash);
  std::vector<std::string> known;
  for (TaskDescription& task : tasks) {
    if (task.name == task_name) {
      const std::string variation =
          slash == std::string::npos ? task.variations[0].name : wanted.substr(slash + 1);
      task.Apply(variation);
      return {std::move(task), variation};
    }
    for (const Variation& variation : task.variations) {
      if (!variation.alias.empty() && alias_prefix + variation.alias == wanted) {
        const std::string found = variation.name;
        task.Apply(found);
        return {std::move(task), found};
      }
      known.push_back(task.name + "/" + variation.name);
      if (!variation.alias.empty()) known.push_back(alias_prefix + variation.alias);
    }
    known.push_back(task.name);
  }

  const std::string nearest = NearestName(wanted, known);
  std::string message = "unknown task '" + name + "'";
  if (!nearest.empty()) {
    message += "; did you mean '" + nearest + "'?";
  } else {
    message += "; there are ";
    std::string list;
    for (const TaskDescription& task : tasks) list += (list.empty() ? "" : ", ") + task.name;
    message += list.empty() ? "none in " + TasksFolder().string() : list;
  }
  throw InputError(message);
}

std::vector<TaskDescription> AllTasks() {
  const std::filesystem::path folder = TasksFolder();
  if (!std::filesystem::is_directory(folder)) {
    throw InputError("no folder " + folder.string() +
                     "; EVALBUS_MODELS must name a folder with tasks/, robots/, props/");
  }
  return TasksIn(folder);
}

std::vector<TaskDescription> TasksOfAssets(const std::string& name) {
  const std::filesystem::path folder = TasksFolder() / name;
  // The folder may be missing, because $EVALBUS_MODELS may name a folder with other tasks.
  return std::filesystem::is_directory(folder) ? TasksIn(folder) : std::vector<TaskDescription>();
}

std::filesystem::path ModelsFolder() {
  namespace fs = std::filesystem;
  if (const char* folder = std::getenv("EVALBUS_MODELS"); folder && *folder) return folder;
  // This folder is next to the installed program, or in the source tree in which the program was built.
  const fs::path folder = SharedData("models", EVALBUS_MODELS_FOLDER);
  std::error_code error;
  return fs::is_directory(folder / "tasks", error) ? folder : "/usr/share/evalbus/models";
}

std::filesystem::path TasksFolder() { return ModelsFolder() / "tasks"; }

}  // namespace evalbus
