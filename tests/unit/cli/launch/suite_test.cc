#include "cli/launch/suite.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "base/errors.h"

namespace evalbus::launch {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

TEST(ExpandTasks, NamesStandForVariationsInTheirOrder) {
  EXPECT_THAT(ExpandTasks({"rotate_valve/base", "LiftPotPosition", "lift_pot"}),
              ElementsAre("rotate_valve/base", "lift_pot/position", "lift_pot/base"));
  const auto family = ExpandTasks({"lift_pot/all"});
  EXPECT_GT(family.size(), 2u);
  for (const std::string& task : family) EXPECT_TRUE(task.starts_with("lift_pot/")) << task;
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
  EXPECT_EQ(error_of({"lift_pot/position", "LiftPotPosition"}), "task 'lift_pot/position' is there twice");
  EXPECT_THAT(error_of({"all", "lift_pot/base"}), HasSubstr("'lift_pot/base' is there twice"));
  EXPECT_THAT(error_of({"lift_pan"}), HasSubstr("lift_pan"));
  EXPECT_THAT(error_of({"lift_pan/all"}), HasSubstr("lift_pan"));
}

}  // namespace
}  // namespace evalbus::launch
