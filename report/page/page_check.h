// Compares a page with its expected content, for `evalbus verify`. Images, the 3D viewer, links, and elements
// with the attribute kUnchecked (page.h) are ignored, because they do not show results or contain notes and
// verdicts that users add later.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace evalbus::report {

// kSourceMeta: name of the <meta> element with the page's source. kMadeBy: beginning of the page's footer.
inline constexpr char kSourceMeta[] = "evalbus-source";
inline constexpr char kMadeBy[] = "Made by evalbus ";

// Values of the key "page" in a source.
inline constexpr char kReportPage[] = "report";
inline constexpr char kComparisonPage[] = "comparison";
inline constexpr char kPlanPage[] = "plan";
inline constexpr char kPlanComparisonPage[] = "plan comparison";

// Returns the path of a results folder relative to the page's folder, for the page's source.
std::string RelativeToPage(const std::filesystem::path& folder, const std::filesystem::path& page);

struct PageContent {
  // Source of the page (see Page()); null if the page does not contain it.
  nlohmann::ordered_json source;
  // Version and commit of the program that wrote the page; empty if it is not a page of evalbus.
  std::string made_by;
  // A text, or an attribute as `name="value"`, and a description of its place on the page.
  struct Item {
    std::string text, where;
  };
  std::vector<Item> items;
};

// Throws InputError if the page is not well-formed. file: for errors.
PageContent ReadPage(const std::string& html, const std::string& file);

// Returns a description of the first item that differs; nullopt if there is none.
std::optional<std::string> FirstDifference(const PageContent& stored, const PageContent& computed);

}  // namespace evalbus::report
