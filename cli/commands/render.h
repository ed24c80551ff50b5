// evalbus render: films episodes of a run from their logs.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace evalbus::commands {

struct RenderOptions {
  std::filesystem::path run;
  // Empty: every finished episode.
  std::vector<int> episodes;
  std::vector<std::string> cameras = {"front"};
  std::string size = "640x480";
};

void AddRenderOptions(CLI::App* app, RenderOptions* options);

// Prints the films' paths. Returns the exit code. Throws InputError, EnvironmentError.
int Render(const RenderOptions& options);

}  // namespace evalbus::commands
