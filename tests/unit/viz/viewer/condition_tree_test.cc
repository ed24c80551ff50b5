// Compares the tree of conditions with trees written by hand.
#include "viz/viewer/condition_tree.h"

#include <gtest/gtest.h>

namespace evalbus::viz::condition_tree_test {

using Json = nlohmann::ordered_json;

// Returns a predicate whose name does not matter.
Expression Leaf() {
  Expression leaf;
  leaf.name = "touching";
  return leaf;
}
Expression Joined(const char* name, std::vector<Expression> operands) {
  Expression joined;
  joined.name = name;
  joined.operands = std::move(operands);
  return joined;
}

TEST(ConditionTreeTest, PlacesStandUnderWhatJoinsThem) {
  EXPECT_EQ(ConditionTree(Leaf(), 3, 1), Json(3));
  EXPECT_EQ(ConditionTree(Joined("all", {Leaf(), Joined("any", {Leaf(), Leaf()}), Leaf()}), 0, 4),
            Json::parse(R"({"all": [0, {"any": [1, 2]}, 3]})"));
}

TEST(ConditionTreeTest, BelowNotAllBecomesAnyAndBack) {
  EXPECT_EQ(ConditionTree(Joined("not", {Joined("any", {Leaf(), Joined("all", {Leaf(), Leaf()})})}), 0, 3),
            Json::parse(R"({"all": [0, {"any": [1, 2]}]})"));
  EXPECT_EQ(ConditionTree(Joined("not", {Joined("not", {Joined("any", {Leaf(), Leaf()})})}), 0, 2),
            Json::parse(R"({"any": [0, 1]})"));
}

// EVALBUS_CRITERIA lists the operands of these conditions in order, followed by the conditions themselves.
TEST(ConditionTreeTest, LatchedAndLastsStandBehindTheirOperands) {
  EXPECT_EQ(ConditionTree(Joined("not", {Joined("lasts", {Joined("all", {Leaf(), Leaf()})})}), 0, 3),
            Json::parse(R"({"lasts": [{"all": [0, 1]}, 2]})"));
}

TEST(ConditionTreeTest, ThereIsNoneOfAnotherNumberOfConditions) {
  EXPECT_TRUE(ConditionTree(Joined("all", {Leaf(), Leaf()}), 0, 3).is_null());
  EXPECT_TRUE(ConditionTree(Joined("all", {Leaf(), Leaf()}), 0, 1).is_null());
  EXPECT_TRUE(ConditionTree(Expression(), 2, 0).is_null());
}

}  // namespace evalbus::viz::condition_tree_test
