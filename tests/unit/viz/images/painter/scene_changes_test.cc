// The part of an image that can have changed is compared with positions that were computed by hand. The
// camera is 2 m above a floor, with a field of view of 90 degrees and 400 x 400 pixels, so a point at height
// z is at 200 + 200 x / (2 - z).
#include "viz/images/painter/scene_changes.h"

#include <gtest/gtest.h>

#include <vector>

namespace evalbus::viz::scene_changes_test {

constexpr int kSize = 400, kPlaces = 1024;
constexpr float kClip = 2;

mjvGeom GeomOf(int type, Vec size, Vec pos) {
  mjvGeom geom{};
  geom.type = type;
  geom.dataid = -1;
  geom.category = mjCAT_STATIC;
  geom.mat[0] = geom.mat[4] = geom.mat[8] = 1;
  geom.rgba[3] = 1;
  const float sizes[] = {size.x, size.y, size.z}, place[] = {pos.x, pos.y, pos.z};
  std::copy_n(sizes, 3, geom.size);
  std::copy_n(place, 3, geom.pos);
  return geom;
}

mjvGeom Floor() { return GeomOf(mjGEOM_PLANE, {2, 2, 0.1f}, {0, 0, 0}); }
mjvGeom Box(float x) { return GeomOf(mjGEOM_BOX, {0.1f, 0.1f, 0.1f}, {x, 0, 1}); }

struct SceneOf {
  explicit SceneOf(std::vector<mjvGeom> geoms_) : geoms(std::move(geoms_)) {
    mjv_defaultScene(&scene);
    scene.geoms = geoms.data();
    scene.ngeom = static_cast<int>(geoms.size());
  }
  std::vector<mjvGeom> geoms;
  mjvScene scene;
};

EyeView Eye() {
  constexpr float kNear = 0.01f, kFar = 10;
  Matrix projection{};
  projection[0] = projection[5] = 1;
  projection[10] = -(kFar + kNear) / (kFar - kNear);
  projection[11] = -1;
  projection[14] = -2 * kFar * kNear / (kFar - kNear);
  const Vec place = {0, 0, 2};
  return {place, projection * LookAlong(place, {0, 0, -1}, {0, 1, 0}), kSize, kSize};
}

// The light shines along x and down, at 45 degrees.
LightView SlantingLight() { return {LookAlong({-3, 0, 3}, {1, 0, -1}, {0, 1, 0}), kClip, kPlaces}; }

class SceneChanges : public testing::Test {
 protected:
  SceneChanges() : model_() {}

  Part Changed(const std::vector<mjvGeom>& before, const std::vector<mjvGeom>& now,
               const std::optional<LightView>& light) {
    const SceneOf was(before), is(now);
    const DrawnScene drawn(was.scene);
    EXPECT_TRUE(drawn.IsComparable(is.scene));
    return ChangedPart(drawn, is.scene, GeomBoxes(model_), Eye(), light);
  }

  // Has no meshes.
  mjModel model_;
};

TEST_F(SceneChanges, NothingMovedNothingChanged) {
  EXPECT_TRUE(Changed({Floor(), Box(0)}, {Floor(), Box(0)}, SlantingLight()).is_empty());
}

// The box's top is at 1.1 m. -0.1 to 0.3 m are at pixels 177.8 to 266.7, and +-0.1 m at 177.8 to 222.2. Two
// pixels are added on each side.
TEST_F(SceneChanges, WithoutShadowsItIsWhereItWasAndWhereItIs) {
  EXPECT_EQ(Changed({Floor(), Box(0)}, {Floor(), Box(0.2f)}, {}), (Part{175, 175, 269, 225}));
  mjvGeom red = Box(0);
  red.rgba[0] = 1;
  EXPECT_EQ(Changed({Floor(), Box(0)}, {Floor(), red}, {}), (Part{175, 175, 225, 225}));
}

// A shadow is shifted along x by the height of the object. For 0.9 to 1.1 m, the shadow is at 0.8 to 1.4 m,
// at pixels 280 to 340. Columns of light are 0.125 m wide, which is 0.18 m or 18 pixels on the floor; 5
// pixels are for the margins.
TEST_F(SceneChanges, ShadowsChangeToo) {
  const Part part = Changed({Floor(), Box(0)}, {Floor(), Box(0.2f)}, SlantingLight());
  EXPECT_EQ(part.left, 175);
  EXPECT_GE(part.right, 340);
  EXPECT_LE(part.right, 340 + 23);
  EXPECT_LE(part.bottom, 175);
  EXPECT_GE(part.top, 225);
  EXPECT_LE(part.top - part.bottom, 2 * 25 + 2 * 18);
}

// A table that is 0.8 m high, from -0.3 to 0.9 m, receives the shadow at 0 to 0.6 m, at pixels 200 to 300.
// The floor below is in the table's own shadow.
TEST_F(SceneChanges, WhatLiesInTheShadowOfSomethingElseStays) {
  const mjvGeom table = GeomOf(mjGEOM_BOX, {0.6f, 0.6f, 0.02f}, {0.3f, 0, 0.78f});
  const Part part = Changed({Floor(), table, Box(0)}, {Floor(), table, Box(0.2f)}, SlantingLight());
  EXPECT_GE(part.right, 300);
  EXPECT_LT(part.right, 340);
  // A shorter table ends at 0.53 m, and the shadow ends at 1.35 m. The last 2 cm of the shadow fall on the
  // floor, up to pixel 335, in one column.
  const mjvGeom shorter = GeomOf(mjGEOM_BOX, {0.415f, 0.6f, 0.02f}, {0.115f, 0, 0.78f});
  EXPECT_GE(Changed({Floor(), shorter, Box(0)}, {Floor(), shorter, Box(0.15f)}, SlantingLight()).right, 335);
  // A table that has moved hides nothing.
  mjvGeom moved = table;
  moved.pos[1] = 0.01f;
  EXPECT_GE(Changed({Floor(), table, Box(0)}, {Floor(), moved, Box(0.2f)}, SlantingLight()).right, 340);
}

TEST_F(SceneChanges, WhatIsUnknownIsEverywhere) {
  const Part whole{0, 0, kSize, kSize};
  const auto with = [](const mjvGeom& geom) { return std::vector<mjvGeom>{Floor(), geom}; };
  const mjvGeom hills = GeomOf(mjGEOM_HFIELD, {1, 1, 1}, {0, 0, 0});
  EXPECT_EQ(Changed(with(hills), with(hills), {}), whole);
  // The box is to the side of the eye and extends behind it.
  mjvGeom high = GeomOf(mjGEOM_BOX, {0.1f, 0.1f, 1.5f}, {0.5f, 0, 1});
  mjvGeom turned = high;
  turned.rgba[1] = 1;
  EXPECT_EQ(Changed(with(high), with(turned), {}), whole);
}

TEST_F(SceneChanges, OtherCamerasLightsAndCountsAreNotComparable) {
  const SceneOf one({Floor(), Box(0)}), more({Floor(), Box(0), Box(1)});
  const DrawnScene drawn(one.scene);
  EXPECT_TRUE(drawn.IsComparable(one.scene));
  EXPECT_FALSE(drawn.IsComparable(more.scene));
  mjvScene other = one.scene;
  other.camera[0].pos[2] += 0.1f;
  EXPECT_FALSE(drawn.IsComparable(other));
  other = one.scene;
  other.flags[mjRND_SHADOW] ^= 1;
  EXPECT_FALSE(drawn.IsComparable(other));
  other = one.scene;
  other.nlight = 1;
  EXPECT_FALSE(drawn.IsComparable(other));
  const DrawnScene lit(other);
  other.lights[0].dir[0] += 0.1f;
  EXPECT_FALSE(lit.IsComparable(other));
}

// A light shines from above with a map of 4 m, so a point at x has the texel 1 + 1022 (x + 2) / 4. The box of
// half width 0.1 m moves from x = 0 to 0.2 m. Its two places cover x from -0.1 to 0.3 m (texels 486.4 to
// 588.7) and y from -0.1 to 0.1 m (486.4 to 537.6). Three texels are added on each side.
TEST_F(SceneChanges, MapChangesWhereSomethingMoved) {
  const LightView light = {LookAlong({0, 0, 3}, {0, 0, -1}, {0, 1, 0}), kClip, kPlaces};
  const SceneOf was({Floor(), Box(0)}), is({Floor(), Box(0.2f)});
  const GeomBoxes boxes(model_);
  EXPECT_EQ(ChangedShadows(DrawnScene(was.scene), is.scene, boxes, light), (Part{483, 483, 592, 541}));
  EXPECT_TRUE(ChangedShadows(DrawnScene(was.scene), was.scene, boxes, light).is_empty());
}

}  // namespace evalbus::viz::scene_changes_test
