// What a page links: files of runs, relative to its own folder, so that all can be moved together.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "viz/report/page.h"

namespace evalbus::results {

class PageLinks {
 public:
  explicit PageLinks(const std::filesystem::path& page);

  // Of an episode; empty where there are none.
  std::vector<viz::ReportLink> Videos(const std::filesystem::path& run, int episode) const;
  std::vector<viz::ReportLink> Log(const std::filesystem::path& run, int episode) const;

 private:
  viz::ReportLink To(const std::filesystem::path& file, const std::string& text) const;

  std::filesystem::path folder_;
};

}  // namespace evalbus::results
