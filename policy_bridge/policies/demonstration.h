// A demonstration of RoboEval (helen9975/RoboEval_data): what was commanded, one safetensors file per
// episode.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace evalbus::policy {

// At each step: joint targets of the left arm (7), then of the right one (7), rad; then what the left and the
// right gripper are told, 0 open, 1 closed.
inline constexpr size_t kDemoJoints = 14, kDemoWidth = 16;
inline constexpr double kDemoHz = 500;  // what RoboEval records

struct Demonstration {
  std::filesystem::path file;
  // The task's folder in RoboEval's archive, ROBOT/TASK/ACTIONS/...: what the file itself says is sometimes
  // that of another one. Empty where the file lies elsewhere.
  std::string task;
  // As the file has it: the seed of RoboEval's scene, ...
  std::map<std::string, std::string> metadata;
  // Steps per second: the folder NNhz that a converted one lies in, or what we wrote into it; else 500.
  double hz = kDemoHz;
  std::vector<std::array<double, kDemoWidth>> steps;

  double seconds() const { return static_cast<double>(steps.size()) / hz; }
};

// Throws InputError, one line: no such file or tensor, another shape, NaN, delta or pose actions, angles that
// are degrees.
Demonstration ReadDemonstration(const std::filesystem::path& file);

// A file, or all *.safetensors below a folder, sorted. Throws InputError where there is none.
std::vector<std::filesystem::path> DemonstrationFiles(const std::filesystem::path& path);

// RoboEval's own rule for fewer steps: of each window of hz/HZ steps the mean of the joints and the last of
// the grippers; a last window that is short is filled up with its last step. Throws InputError where the rate
// is no whole part of the demonstration's.
Demonstration AtRate(const Demonstration& demonstration, double hz);

// In RoboEval's layout (info_demo_action, termination, truncation, reward).
std::string AsSafetensors(const Demonstration& demonstration);
// A line for each step: time_s, left_joint1 ... right_joint7, left_gripper, right_gripper.
std::string AsCsv(const Demonstration& demonstration);

}  // namespace evalbus::policy
