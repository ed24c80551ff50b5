// Links of a page to files of runs. The links are relative to the page's folder, so that page and runs can be
// moved together.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "report/page/page.h"

namespace evalbus::report {

class PageLinks {
 public:
  explicit PageLinks(const std::filesystem::path& page);

  // Return links to the files of an episode; empty if there are no such files.
  std::vector<ReportLink> Videos(const std::filesystem::path& run, int episode) const;
  std::vector<ReportLink> Log(const std::filesystem::path& run, int episode) const;

 private:
  ReportLink To(const std::filesystem::path& file, const std::string& text) const;

  std::filesystem::path folder_;
};

}  // namespace evalbus::report
