// Describes a scene as text and as an image, for the commands that show a robot or a task.
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

// Formats a vector, for example as "(1, 2, 3)".
std::string Vector(const double* values, size_t size);
std::string PoseInWords(const Pose& pose);
// Joins the names with commas.
std::string Joined(const Lines& names);

// Prints lines, with the title before the first line.
void PrintSection(const std::string& title, const Lines& lines);
// Prints a table whose columns are as wide as their widest cells.
void PrintTable(const std::vector<Lines>& rows);

// Adds the options --model-path and --assets.
void AddModelSources(CLI::App* app, std::vector<std::filesystem::path>* model_path,
                     std::vector<std::string>* assets);

struct ImageOptions {
  // PNG file to write; empty: no image.
  std::filesystem::path file;
  std::string camera = viz::kDefaultCamera;
  std::string size = "960x720";
};
void AddImageOptions(CLI::App* app, ImageOptions* options);
// Draws the scene as a PNG file. info: its task and variation determine colors, lights and cameras for the
// seed; null: uses the model's colors, lights and cameras. Throws InputError or EnvironmentError.
void DrawScene(ModelPtr visual, const state_t& state, const ImageOptions& options,
               const model_info_t* info = nullptr, int64_t seed = 0);

}  // namespace evalbus::commands
