// Compares a page with what it should contain, for `evalbus verify`. Images, the 3D viewer, links, and
// elements with the attribute kUnchecked (page.h) are left out: they do not show results, or they are notes
// and verdicts that users add later.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace evalbus::report {

// Name of the <meta> element with the page's source; beginning of its footer.
inline constexpr char kSourceMeta[] = "evalbus-source";
inline constexpr char kMadeBy[] = "Made by evalbus ";

// Values of "page" in a source.
inline constexpr char kReportPage[] = "report";
inline constexpr char kComparisonPage[] = "comparison";
inline constexpr char kPlanPage[] = "plan";
inline constexpr char kPlanComparisonPage[] = "plan comparison";

// Path of a folder of results relative to the page's folder, for its source.
std::string RelativeToPage(const std::filesystem::path& folder, const std::filesystem::path& page);

struct PageContent {
  // What the page was made from; null if the page does not name it.
  nlohmann::ordered_json source;
  // Version and commit of the program that made it; empty if it is not a page of evalbus.
  std::string made_by;
  // A text, or an attribute as `name="value"`, and where it is, for people.
  struct Item {
    std::string text, where;
  };
  std::vector<Item> items;
};

// Throws InputError if the page is not well-formed. file: for errors.
PageContent ReadPage(const std::string& html, const std::string& file);

// Describes the first item that differs; nullopt if there is none.
std::optional<std::string> FirstDifference(const PageContent& stored, const PageContent& computed);

}  // namespace evalbus::report
