// The catalog is complete and agrees with docs/metrics.md.
#include "lcmtypes/metric_catalog.h"

#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

namespace evalbus::metric_catalog_test {

using Units = std::map<std::string, std::string>;

// Returns the names and units in the tables of a section of docs/metrics.md. A row lists names,
// their meaning, and either one unit for all names or one for each: | `a`, `b` | meaning | m, s |
Units UnitsOfSection(const std::string& heading, const std::string& prefix) {
  std::ifstream page(EVALBUS_SOURCE_DIR "/docs/metrics.md");
  Units units;
  bool here = false;
  for (std::string line; std::getline(page, line);) {
    if (line.starts_with("## ")) here = line == "## " + heading;
    std::smatch row;
    if (!here || !std::regex_match(line, row, std::regex(R"(\| (`.*?) \| .* \| (.*) \|)"))) continue;
    std::vector<std::string> names, each;
    const std::string cell = row[1], unit = row[2];
    const std::regex name("`([^`]*)`"), comma(", ");
    for (std::sregex_iterator i(cell.begin(), cell.end(), name), end; i != end; ++i) names.push_back((*i)[1]);
    std::copy(std::sregex_token_iterator(unit.begin(), unit.end(), comma, -1), {}, std::back_inserter(each));
    if (each.size() == 1) each.resize(names.size(), each[0]);
    EXPECT_EQ(each.size(), names.size()) << line;
    for (size_t k = 0; k < std::min(names.size(), each.size()); ++k) {
      EXPECT_TRUE(units.emplace(prefix + names[k], each[k]).second) << names[k] << " is there twice";
    }
  }
  return units;
}

TEST(MetricCatalog, IsThatOfTheDocumentation) {
  Units documented = UnitsOfSection("The result dictionary", "");
  documented.merge(UnitsOfSection("Extended metrics", "extended."));
  Units known;
  for (const MetricInfo& metric : Metrics()) {
    for (const std::string& name : NamesOf(metric)) known[name] = metric.unit;
  }
  for (const auto& [name, unit] : known) {
    ASSERT_TRUE(documented.contains(name)) << name << " is in no table of docs/metrics.md";
    EXPECT_EQ(documented[name], unit) << name;
  }
  for (const auto& [name, unit] : documented) EXPECT_TRUE(known.contains(name)) << name << " is not known";
}

TEST(MetricCatalog, ExtendedNamesAreThoseOfTheSchema) {
  std::ifstream file(EVALBUS_SOURCE_DIR "/docs/schema/episode.json");
  const auto schema = nlohmann::json::parse(file);
  std::set<std::string> known;
  for (const MetricInfo& metric : Metrics()) {
    if (metric.is_extended()) known.emplace(metric.wire_name());
  }
  EXPECT_EQ(schema["properties"]["extended"]["propertyNames"]["enum"].get<std::set<std::string>>(), known);
}

TEST(MetricCatalog, HasWhatPeopleReadOfEachMetric) {
  std::set<std::string_view> names;
  std::set<int> main;
  for (const MetricInfo& metric : Metrics()) {
    EXPECT_TRUE(names.insert(metric.name).second) << metric.name;
    EXPECT_FALSE(metric.label.empty()) << metric.name;
    EXPECT_FALSE(metric.unit.empty()) << metric.name;
    if (metric.main != 0) {
      EXPECT_TRUE(main.insert(metric.main).second) << metric.name << ": place is taken";
    }
    EXPECT_EQ(FindMetric(std::string(metric.name)).metric == &metric, metric.kind != MetricKind::kJerk);
    if (metric.is_extended()) continue;
    EXPECT_EQ(metric.number != nullptr, metric.kind == MetricKind::kNumber ||
                                            metric.kind == MetricKind::kOfStages ||
                                            metric.kind == MetricKind::kOfTwoArms)
        << metric.name;
    EXPECT_EQ(metric.count != nullptr, metric.kind == MetricKind::kCount) << metric.name;
    EXPECT_EQ(metric.jerk != nullptr, metric.kind == MetricKind::kJerk) << metric.name;
    EXPECT_EQ(metric.values != nullptr, metric.kind == MetricKind::kByName ||
                                            metric.kind == MetricKind::kByArm ||
                                            metric.kind == MetricKind::kSumByArm)
        << metric.name;
    EXPECT_EQ(metric.names != nullptr, metric.kind == MetricKind::kByName) << metric.name;
  }
  EXPECT_EQ(*main.rbegin(), static_cast<int>(main.size()));
}

TEST(FindMetric, KnowsEachNumberByItsName) {
  const auto expect = [](const std::string& name, const std::string& label, const std::string& unit) {
    const MetricNumber number = FindMetric(name);
    EXPECT_EQ(number.label(), label) << name;
    EXPECT_EQ(number.shown_unit(), unit) << name;
  };
  expect("completion_time", "completion time", "s");
  expect("subtask_progress", "subtask progress", "%");
  expect("slip_count", "slips", "");
  expect("slip_count_per_object.object_2", "slips, object 2", "");
  expect("target_distance", "target distance", "m");
  expect("target_distance.lift_distance", "lift distance", "m");
  expect("cartesian_path_length", "wrist path", "m");
  expect("cartesian_path_length.left", "wrist path, left", "m");
  expect("total_cartesian_path_length", "wrist path, both arms", "m");
  expect("avg_cartesian_path_length", "wrist path, average of the arms", "m");
  expect("avg_joint_jerk.right", "joint jerk, mean, right", "rad/s³");
  expect("rms_cartesian_jerk", "wrist jerk, rms", "m/s³");
  expect("overall_rms_cartesian_jerk", "wrist jerk, rms", "m/s³");
  expect("bimanual_gripper_vertical_difference", "gripper height difference", "mm");
  expect("extended.min_clearance_m", "smallest clearance", "mm");
  expect("extended.mechanical_work_J.right", "servo work, right", "J");
  expect("extended.peak_wrist_acceleration_mps2", "peak wrist acceleration", "m/s²");
  // The metric belongs to another evalbus version.
  expect("extended.wrist_angle_rad", "wrist angle rad", "");
  for (const char* name :
       {"", "min_clearance_m", "total_slip_count", "total_extended.mechanical_work_J", "cartesian_jerk",
        "overall_cartesian_jerk", "extended.", "extended.avg_slip_count"}) {
    EXPECT_EQ(FindMetric(name).metric, nullptr) << name;
  }
}

TEST(MainMetrics, AreThoseForBothArmsInTheOrderOfTheQuestions) {
  std::vector<std::string> names;
  for (const MetricNumber& number :
       MainMetrics({"extended.mechanical_work_J.left", "extended.mechanical_work_J.right",
                    "rms_cartesian_jerk.left", "rms_cartesian_jerk.right", "overall_avg_cartesian_jerk",
                    "overall_rms_cartesian_jerk", "cartesian_path_length.left", "total_cartesian_path_length",
                    "avg_cartesian_path_length", "success", "completion_time", "unknown"})) {
    names.push_back(number.name);
  }
  EXPECT_EQ(names, (std::vector<std::string>{
                       "completion_time", "total_cartesian_path_length", "extended.mechanical_work_J.left",
                       "extended.mechanical_work_J.right", "overall_rms_cartesian_jerk"}));
  names.clear();
  for (const MetricNumber& number : MainMetrics({"rms_joint_jerk", "avg_joint_jerk", "joint_path_length"}))
    names.push_back(number.name);
  EXPECT_EQ(names, (std::vector<std::string>{"joint_path_length", "rms_joint_jerk"}));
}

TEST(ShownValue, IsInTheShownUnit) {
  const auto shown = [](const char* name, double value) {
    return ShownValue(*FindMetric(name).metric, value);
  };
  EXPECT_EQ(shown("extended.min_clearance_m", 0.1634), "163.4");
  EXPECT_EQ(shown("slip_count", 3), "3");
  EXPECT_EQ(shown("slip_count", 1.5), "1.500");
  EXPECT_EQ(shown("subtask_progress", 0.5), "50");
  EXPECT_EQ(shown("cartesian_path_length", 2), "2.000");
}

}  // namespace evalbus::metric_catalog_test
