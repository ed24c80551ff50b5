#include "metrics/episode/part_of_run.h"

#include "base/json_file.h"
#include "base/run_layout.h"

namespace evalbus::metrics {

bool IsPartOfRun(const std::filesystem::path& run_folder) {
  std::error_code none;
  const auto size = std::filesystem::file_size(run_folder / kEpisodesJsonl, none);
  if (!none && size > 0) return true;
  if (!std::filesystem::exists(run_folder / kRunJson)) return false;
  const nlohmann::json run = ReadJsonFile(run_folder / kRunJson);
  const auto workers = run.find("workers");
  return workers != run.end() && workers->is_number() && *workers > 1;
}

}  // namespace evalbus::metrics
