#include "report/page_links.h"

#include <algorithm>

#include "base/run_layout.h"

namespace evalbus::report {

namespace fs = std::filesystem;

PageLinks::PageLinks(const fs::path& page)
    : folder_(fs::weakly_canonical(fs::absolute(page).parent_path())) {}

ReportLink PageLinks::To(const fs::path& file, const std::string& text) const {
  return {text, Url(fs::weakly_canonical(file).lexically_relative(folder_))};
}

std::vector<ReportLink> PageLinks::Videos(const fs::path& run, int episode) const {
  const fs::path folder = EpisodeFolder(run, episode);
  if (!fs::is_directory(folder)) return {};
  std::vector<fs::path> videos;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == ".mp4") videos.push_back(entry.path());
  }
  std::sort(videos.begin(), videos.end());
  std::vector<ReportLink> links;
  for (const fs::path& video : videos) links.push_back(To(video, video.stem().string()));
  return links;
}

std::vector<ReportLink> PageLinks::Log(const fs::path& run, int episode) const {
  const fs::path log = EpisodeLog(run, episode);
  if (!fs::exists(log)) return {};
  return {To(log, "log")};
}

}  // namespace evalbus::report
