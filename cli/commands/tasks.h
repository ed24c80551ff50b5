// evalbus tasks: what there is to run, what a task is in words and as a picture, and whether a task file is
// right.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace CLI {
class App;
}

namespace evalbus::commands {

struct TasksOptions {
  const CLI::App* list = nullptr;
  const CLI::App* show = nullptr;
  const CLI::App* check = nullptr;
  // As FindTask takes it.
  std::string task;
  // Where to draw the scene as PNG; empty: nowhere.
  std::filesystem::path image;
  std::string camera = "overview";
  std::string size = "960x720";
  // Of the reset that is drawn.
  int64_t seed = 0;
  // To check.
  std::filesystem::path file;
};

void AddTasksOptions(CLI::App* app, TasksOptions* options);

// Returns the exit code. Throws InputError, EnvironmentError.
int Tasks(const TasksOptions& options);

}  // namespace evalbus::commands
