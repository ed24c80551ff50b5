#include "runner/suite.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <set>

#include "base/errors.h"
#include "models/task_description.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::runner::suite_test {

using testing::ElementsAre;
using testing::HasSubstr;

TEST(ExpandTasks, NamesStandForVariationsInTheirOrder) {
  EXPECT_THAT(ExpandTasks({"rotate_valve/base", "LiftPotPosition", "lift_pot"}),
              ElementsAre("rotate_valve/base", "lift_pot/position", "lift_pot/base"));
  const auto family = ExpandTasks({"lift_pot/all"});
  EXPECT_GT(family.size(), 2u);
  for (const std::string& task : family) EXPECT_TRUE(task.starts_with("lift_pot/")) << task;
}

// A changed copy has the same name as the shipped task, but the named file must be used.
TEST(ExpandTasks, TheFileThatWasNamedIsWhatRuns) {
  TemporaryFolder folder;
  for (const TaskDescription& task : AllTasks()) {
    std::ifstream stream(task.file);
    std::string text(std::istreambuf_iterator<char>(stream), {});
    for (size_t at = 0; (at = text.find("../", at)) != std::string::npos;) {
      text.replace(at, 3, ModelsFolder().string() + "/");
    }
    const std::string file = folder.path() / (task.name + ".yaml");
    std::ofstream(file) << text;
    const auto tasks = ExpandTasks({file + "/all"});
    ASSERT_EQ(tasks.size(), task.variations.size());
    for (size_t i = 0; i < tasks.size(); ++i) EXPECT_EQ(tasks[i], file + "/" + task.variations[i].name);
    EXPECT_EQ(FindTask(tasks[0]).task.file, file);
  }
}

TEST(ExpandTasks, AllIsEveryFamilyWhole) {
  const auto all = ExpandTasks({"all"});
  std::set<std::string> families;
  for (const std::string& task : all) families.insert(task.substr(0, task.find('/')));
  EXPECT_GE(families.size(), 8u);
  size_t together = 0;
  for (const std::string& family : families) together += ExpandTasks({family + "/all"}).size();
  EXPECT_EQ(together, all.size());
}

TEST(ExpandTasks, WhatIsThereTwiceOrUnknownIsRefused) {
  const auto error_of = [](const std::vector<std::string>& names) -> std::string {
    try {
      ExpandTasks(names);
    } catch (const InputError& error) {
      return error.what();
    }
    return "none";
  };
  EXPECT_EQ(error_of({"lift_pot/position", "LiftPotPosition"}), "task 'lift_pot/position' is given twice");
  EXPECT_THAT(error_of({"all", "lift_pot/base"}), HasSubstr("'lift_pot/base' is given twice"));
  EXPECT_THAT(error_of({"lift_pan"}), HasSubstr("lift_pan"));
  EXPECT_THAT(error_of({"lift_pan/all"}), HasSubstr("lift_pan"));
}

// Both files would have the same run folder, so one run would be counted twice.
TEST(ExpandTasks, TwoFilesOfOneFolderNameAreRefused) {
  TemporaryFolder folder;
  std::filesystem::create_directory(folder.path() / "x");
  const TaskSelection task = FindTask("lift_pot");
  std::ifstream stream(task.task.file);
  std::string text(std::istreambuf_iterator<char>(stream), {});
  for (size_t at = 0; (at = text.find("../", at)) != std::string::npos;) {
    text.replace(at, 3, ModelsFolder().string() + "/");
  }
  const std::string in_folder = folder.path() / "x/t.yaml", with_dash = folder.path() / "x-t.yaml";
  std::ofstream(in_folder) << text;
  std::ofstream(with_dash) << text;
  try {
    ExpandTasks({in_folder + "/base", with_dash + "/base"});
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("x-t.yaml-base of the suite: rename one of the files"));
  }
  EXPECT_EQ(ExpandTasks({in_folder + "/base", with_dash + "/position"}).size(), 2u);
}

}  // namespace evalbus::runner::suite_test
