// Describes a scene as text and as an image, for the commands that show one.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <vector>

#include "evalbus/model_info_t.hpp"
#include "evalbus/state_t.hpp"
#include "models/mujoco_ptr.h"
#include "models/pose.h"
#include "viz/images/renderer.h"

namespace evalbus::commands {

using Lines = std::vector<std::string>;

// For example "(1, 2, 3)".
std::string Vector(const double* values, size_t size);
std::string PoseInWords(const Pose& pose);
// Joins with commas.
std::string Joined(const Lines& names);

// Prints lines, with the title in front of the first one.
void PrintSection(const std::string& title, const Lines& lines);
// Prints rows under a heading; columns are as wide as their widest cell.
void PrintTable(const std::vector<Lines>& rows);

// --model-path and --assets.
void AddModelSources(CLI::App* app, std::vector<std::filesystem::path>* model_path,
                     std::vector<std::string>* assets);

struct ImageOptions {
  // PNG file; empty: no image.
  std::filesystem::path file;
  std::string camera = viz::kDefaultCamera;
  std::string size = "960x720";
};
void AddImageOptions(CLI::App* app, ImageOptions* options);
// info: determines the task and variation whose colors, lights and cameras for this seed are used; null:
// those of the model. Throws InputError, EnvironmentError.
void DrawScene(ModelPtr visual, const state_t& state, const ImageOptions& options,
               const model_info_t* info = nullptr, int64_t seed = 0);

}  // namespace evalbus::commands
