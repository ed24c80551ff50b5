#include "cli/commands/scene_words.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/angles.h"
#include "base/errors.h"
#include "viz/images/png.h"

namespace evalbus::commands {

std::string Vector(const double* values, size_t size) {
  std::string text;
  for (size_t i = 0; i < size; ++i) text += fmt::format("{}{:.6g}", i == 0 ? "" : ", ", values[i]);
  return "(" + text + ")";
}

std::string PoseInWords(const Pose& pose) {
  std::string text = Vector(pose.position.data(), 3) + " m";
  const auto& q = pose.quaternion;
  if (q[1] != 0 || q[2] != 0) return text + ", quaternion " + Vector(q.data(), 4);
  const double yaw = ToDegrees(2 * std::atan2(q[3], q[0]));
  return yaw == 0 ? text : text + fmt::format(", yaw {:.6g} degrees", yaw);
}

std::string Joined(const Lines& names) { return fmt::format("{}", fmt::join(names, ", ")); }

void PrintSection(const std::string& title, const Lines& lines) {
  std::string head = title;
  for (const std::string& line : lines) {
    fmt::print("{:<14}{}\n", head, line);
    head.clear();
  }
}

void PrintTable(const std::vector<Lines>& rows) {
  std::vector<size_t> widths(rows[0].size());
  for (const Lines& row : rows) {
    for (size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  }
  for (const Lines& row : rows) {
    std::string line;
    for (size_t i = 0; i < row.size(); ++i) line += fmt::format("{:<{}}", row[i], widths[i] + 2);
    fmt::print("{}\n", line.substr(0, line.find_last_not_of(' ') + 1));
  }
}

void AddModelSources(CLI::App* app, std::vector<std::filesystem::path>* model_path,
                     std::vector<std::string>* assets) {
  app->add_option("--model-path", *model_path,
                  "folder to search for a robot's MJCF files, e.g. a MuJoCo Menagerie; can be repeated")
      ->allow_extra_args(false);
  app->add_option(
         "--assets", *assets,
         "NAME=FOLDER: files of a task that are not part of evalbus, e.g. roboeval=CHECKOUT; can be repeated")
      ->allow_extra_args(false);
}

void AddImageOptions(CLI::App* app, ImageOptions* options) {
  CLI::Option* const image =
      app->add_option("--image", options->file, "render the scene after a reset into this PNG file");
  app->add_option("--camera", options->camera, "camera of the image")->needs(image)->capture_default_str();
  app->add_option("--size", options->size, "WIDTHxHEIGHT of the image in pixels")
      ->needs(image)
      ->capture_default_str();
}

void DrawScene(ModelPtr visual, const state_t& state, const ImageOptions& options, const model_info_t* info,
               int64_t seed) {
  if (options.file.extension() != ".png") {
    throw InputError("--image " + options.file.string() + ": expected a name that ends in .png");
  }
  const viz::FrameSize size = viz::ParseFrameSize(options.size);
  const int camera = viz::FindCamera(*visual, options.camera);
  viz::Renderer renderer(std::move(visual), size);
  if (info) renderer.SetAppearance(*info, seed);
  renderer.SetState(state);
  viz::Frame frame(size);
  renderer.Render(camera, &frame);
  viz::WritePng(frame, options.file);
}

}  // namespace evalbus::commands
