// Scenes with random appearance.
#pragma once

#include <string>
#include <utility>

#include "models/robot_description.h"
#include "models/scene.h"
#include "models/task_description.h"

namespace evalbus {

// Adds a variation to a task description.
inline std::string WithVariation(std::string task, const std::string& variation) {
  const std::string title = "\nvariations:\n";
  return task.insert(task.find(title) + title.size(), variation);
}

struct DressedScene {
  TaskDescription task;
  Scene scene;
};

// Returns the scene of a family's variation "dressed", which has this randomization.
inline DressedScene BuildDressed(const std::string& family, const std::string& randomize) {
  const TaskSelection selection = FindTask(family);
  const std::string text = WithVariation(selection.task.text, "  dressed:\n    randomize:\n" + randomize);
  TaskDescription task = ParseTask(text, selection.task.file, true);
  task.Apply("dressed");
  Scene scene = BuildScene(task, LoadRobot(task.robot_file, {}));
  scene.info.task_yaml = text;
  scene.info.task_file = task.file;
  scene.info.variation = "dressed";
  return {std::move(task), std::move(scene)};
}

}  // namespace evalbus
