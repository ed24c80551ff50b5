// RoboEval demonstrations (helen9975/RoboEval_data): the recorded commands, one safetensors file per episode.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace evalbus::policy {

// Layout of a step: 7 joint targets of the left arm and 7 of the right arm, rad; then the commands of the
// left and right grippers, 0 open, 1 closed.
inline constexpr size_t kDemoJoints = 14, kDemoWidth = 16;
inline constexpr double kDemoHz = 500;  // RoboEval's recording rate

struct Demonstration {
  std::filesystem::path file;
  // Name of the task's folder in RoboEval's archive (ROBOT/TASK/ACTIONS/...). It is used because the metadata
  // of some files name a different task. Empty if the file is not in such a folder.
  std::string task;
  // Metadata in the file, such as the seed of RoboEval's scene.
  std::map<std::string, std::string> metadata;
  // Steps per second, taken from the folder NNhz of a converted file or from metadata written by evalbus;
  // otherwise 500.
  double hz = kDemoHz;
  std::vector<std::array<double, kDemoWidth>> steps;

  double seconds() const { return static_cast<double>(steps.size()) / hz; }
};

// Throws InputError (one line) if the file or its tensor is missing; if the tensor has the wrong shape,
// numbers that are not finite, or numbers that are too large to be angles in radians; if the path or the
// metadata states that the actions are deltas or poses; or if the metadata has an invalid rate.
Demonstration ReadDemonstration(const std::filesystem::path& file);

// Returns the file `path`, or the *.safetensors files below the folder `path`, sorted. Throws InputError if
// there is none.
std::vector<std::filesystem::path> DemonstrationFiles(const std::filesystem::path& path);

// Reduces the rate by RoboEval's own rule: a window of steps becomes one step with the mean of the joint
// targets and the last gripper commands. An incomplete last window is padded with its last step. Throws
// InputError if the demonstration's rate is not a multiple of `hz`.
Demonstration AtRate(const Demonstration& demonstration, double hz);

// Returns the contents of a file in RoboEval's layout (info_demo_action, termination, truncation, reward).
std::string AsSafetensors(const Demonstration& demonstration);
// Returns CSV text with one line per step: time_s, left_joint1 ... right_joint7, left_gripper, right_gripper.
std::string AsCsv(const Demonstration& demonstration);

}  // namespace evalbus::policy
