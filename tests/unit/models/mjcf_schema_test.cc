#include "models/mjcf_schema.h"

#include <gtest/gtest.h>

namespace evalbus::mjcf::mjcf_schema_test {

const SchemaNode* Section(const std::string& name) { return ChildSchema(Schema(), "mujoco", name); }

TEST(MjcfSchema, HasTheSectionsAndAttributesOfMjcf) {
  for (const char* name : {"compiler", "option", "size", "visual", "statistic", "default", "custom", "asset",
                           "worldbody", "contact", "equality", "tendon", "actuator", "sensor", "keyframe"}) {
    EXPECT_TRUE(Section(name)) << name;
  }
  EXPECT_FALSE(Section("extension"));
  EXPECT_TRUE(Section("option")->attributes.contains("timestep"));
  EXPECT_FALSE(Section("option")->attributes.contains("timestepp"));
  // This element takes several lines of MuJoCo's table.
  const SchemaNode* geom = ChildSchema(*Section("worldbody"), "worldbody", "geom");
  ASSERT_TRUE(geom);
  for (const char* name : {"name", "class", "type", "friction", "solref", "euler", "mesh"}) {
    EXPECT_TRUE(geom->attributes.contains(name)) << name;
  }
  EXPECT_TRUE(ChildSchema(*Section("visual"), "visual", "global")->attributes.contains("offwidth"));
}

TEST(MjcfSchema, BodiesAndDefaultsContainThemselves) {
  const SchemaNode* body = ChildSchema(*Section("worldbody"), "worldbody", "body");
  ASSERT_TRUE(body);
  for (int depth = 0; depth < 5; ++depth) {
    EXPECT_TRUE(body->attributes.contains("childclass"));
    EXPECT_TRUE(ChildSchema(*body, "body", "joint"));
    body = ChildSchema(*body, "body", "body");
    ASSERT_TRUE(body);
  }
  const SchemaNode* defaults = Section("default");
  for (int depth = 0; depth < 5; ++depth) {
    EXPECT_TRUE(ChildSchema(*defaults, "default", "geom"));
    defaults = ChildSchema(*defaults, "default", "default");
    ASSERT_TRUE(defaults);
  }
  EXPECT_FALSE(ChildSchema(*Section("asset"), "asset", "body"));
  EXPECT_FALSE(ChildSchema(*Section("worldbody"), "worldbody", "frame"));
}

TEST(MjcfSchema, WhatPhysicsNeedsIsNeverDropped) {
  EXPECT_TRUE(CanBeDropped("body", "gravcomp"));
  EXPECT_TRUE(CanBeDropped("material", "metallic"));
  EXPECT_TRUE(CanBeDropped("mesh", "inertia"));
  EXPECT_FALSE(CanBeDropped("geom", "inertia"));
  EXPECT_FALSE(CanBeDropped("position", "kv"));
  EXPECT_FALSE(CanBeDropped("joint", "damping"));
}

}  // namespace evalbus::mjcf::mjcf_schema_test
