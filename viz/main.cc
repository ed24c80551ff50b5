// evalbus-viz publishes live images of a run or a replay. If the first argument is --answer-image-requests,
// it is the component "cameras" of a run instead, and accepts the common component options from the launcher.
#include <CLI/CLI.hpp>
#include <iostream>
#include <string_view>

#include "base/arguments.h"
#include "base/errors.h"
#include "base/realtime.h"
#include "bus/attach.h"
#include "bus/host.h"
#include "viz/camera_component.h"
#include "viz/images/painter/gl_context.h"
#include "viz/viz_component.h"

int main(int argc, char** argv) {
  if (argc > 1 && std::string_view(argv[1]) == "--answer-image-requests") {
    std::string gl = evalbus::viz::kDefaultGl;
    return evalbus::HostMain(
        argc - 1, argv + 1, "Renders only the images that a policy requests with REQUEST_IMAGE.",
        [&](CLI::App* app) {
          // A run.json of an earlier version does not have the key "gl".
          evalbus::AddOptionsFile(
              app, [&](const std::string& file) { gl = evalbus::ReadJsonFile(file).value("gl", gl); });
          app->add_option("--gl", gl, evalbus::viz::kGlHelp)->capture_default_str();
        },
        [&](evalbus::Bus* bus) { return std::make_unique<evalbus::viz::CameraComponent>(bus, gl); });
  }
  CLI::App app{
      "Renders an active run or replay off screen, and publishes JPEG frames on\n"
      "EVALBUS_IMAGE_<camera>. The run does not wait for the frames.\n"
      "'evalbus-viz --answer-image-requests --help': renders a policy's images instead."};
  evalbus::Address address;
  evalbus::viz::VizOptions options;
  std::string size = "640x480";
  evalbus::AddAddressOptions(&app, &address);
  evalbus::AddList(&app, "--camera", &options.cameras, "names of cameras, separated by commas")
      ->capture_default_str();
  app.add_option("--size", size, "WIDTHxHEIGHT in pixels")->capture_default_str();
  app.add_option("--fps", options.fps, "maximum number of frames per second and camera")
      ->capture_default_str();
  std::string gl = evalbus::viz::kDefaultGl;
  app.add_option("--gl", gl, evalbus::viz::kGlHelp)->capture_default_str();
  if (const auto code = evalbus::ParseArguments(&app, argc, argv)) return *code;
  try {
    options.size = evalbus::viz::ParseFrameSize(size);
    evalbus::viz::CheckFrameSize(options.size);
    std::cerr << evalbus::viz::UseGlAndDescribe(gl);
    // Rendering uses all available CPU time, so the run takes priority.
    evalbus::LowerPriority();
    const evalbus::Attached attached = evalbus::Attach(address);
    options.policy = attached.policy;
    return evalbus::Host(attached.url, [&](evalbus::Bus* bus) {
      return std::make_unique<evalbus::viz::VizComponent>(bus, options);
    });
  } catch (const std::exception& error) {
    return evalbus::ReportError(error);
  }
}
