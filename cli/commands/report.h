// evalbus report: a run, or a suite of runs, as one HTML page.
#pragma once

#include <filesystem>
#include <vector>

namespace CLI {
class App;
}

namespace evalbus::commands {

struct ReportOptions {
  // Folder of a run or of a suite.
  std::filesystem::path run;
  // Empty: report.html in that folder.
  std::filesystem::path out;
  // Whose curves are drawn; empty: the first failures and the median success.
  std::vector<int> episodes;
};

void AddReportOptions(CLI::App* app, ReportOptions* options);

// Prints the page's path. Returns the exit code. Throws InputError, EnvironmentError.
int WriteReport(const ReportOptions& options);

}  // namespace evalbus::commands
