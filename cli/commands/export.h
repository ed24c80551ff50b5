// evalbus export: the episodes of a run, or of a suite, as a table for other programs.
#pragma once

#include <filesystem>

namespace CLI {
class App;
}

namespace evalbus::commands {

struct ExportOptions {
  std::filesystem::path run;
  std::filesystem::path csv;
};

void AddExportOptions(CLI::App* app, ExportOptions* options);

// Returns the exit code. Throws InputError.
int Export(const ExportOptions& options);

}  // namespace evalbus::commands
