#include "models/mesh_faces.h"

#include <gmock/gmock.h>

#include "models/compile_model.h"
#include "tests/unit/models/models_test_util.h"

namespace evalbus::mesh_faces_test {

using mjcf::SeparateFaces;

// A box of 1 x 2 x 3 m around the origin. In kInconsistent, the last face has the opposite orientation.
constexpr const char* kVertices = R"(v -0.5 -1 -1.5
v 0.5 -1 -1.5
v 0.5 1 -1.5
v -0.5 1 -1.5
v -0.5 -1 1.5
v 0.5 -1 1.5
v 0.5 1 1.5
v -0.5 1 1.5
vt 0 0
vt 1 0.25
)";
constexpr const char* kFaces = R"(f 1/1 4/1 3/1
f 1/1 3/1 2/1
f 5/1 6/1 7/1
f 5/1 7/1 8/1
f 1/1 2/1 6/1
f 1/1 6/1 5/1
f 2/1 3/1 7/1
f 2/1 7/1 6/1
f 3/1 4/1 8/1
f 3/1 8/1 7/1
f 4/1 1/1 5/1
)";
const std::string kConsistent = std::string(kVertices) + kFaces + "f 4/1 5/1 8/2\n";
const std::string kInconsistent = std::string(kVertices) + kFaces + "f 4/1 8/2 5/1\n";

TEST(SeparateFaces, ConsistentMeshesStayAsTheyAre) {
  TempFolder folder;
  EXPECT_FALSE(SeparateFaces(folder.Write("box.obj", kConsistent)));
  EXPECT_FALSE(SeparateFaces(folder.path() / "none.obj"));
}

TEST(SeparateFaces, HaveVerticesOfTheirOwn) {
  TempFolder folder;
  const std::optional<mjcf::MeshFaces> mesh = SeparateFaces(folder.Write("box.obj", kInconsistent));
  ASSERT_TRUE(mesh);
  EXPECT_EQ(mesh->face.size(), 36u);
  EXPECT_EQ(mesh->vertex.size(), 108u);
  // The last face has vertices 4, 8 and 5. The second of them has the texture coordinate (1, 0.25), counted
  // from below.
  EXPECT_EQ(std::vector<double>(mesh->vertex.end() - 9, mesh->vertex.end()),
            (std::vector<double>{-0.5, 1, -1.5, -0.5, 1, 1.5, -0.5, -1, 1.5}));
  EXPECT_EQ(std::vector<double>(mesh->texcoord.end() - 4, mesh->texcoord.end()),
            (std::vector<double>{1, 0.75, 0, 1}));
}

// MuJoCo refuses the file itself.
TEST(SeparateFaces, CompileToTheSameInertia) {
  TempFolder folder;
  folder.Write("box.obj", kInconsistent);
  const auto model = folder.Write("box.xml", R"(<mujoco><asset><mesh name="box" file="box.obj"/></asset>
    <worldbody><body name="box"><geom type="mesh" mesh="box" density="10"/></body></worldbody></mujoco>)");
  SceneComposer composer(folder.Write("base.xml", "<mujoco/>"));
  composer.Attach(model, "box/", {});
  std::vector<std::string> warnings;
  const ModelPtr compiled = CompileModel(composer, false, &warnings);
  const int body = mj_name2id(compiled.get(), mjOBJ_BODY, "box/box");
  // The mass is 10 kg/m^3 times 6 m^3. The inertias are m (b^2 + c^2) / 12, sorted as MuJoCo does.
  EXPECT_NEAR(compiled->body_mass[body], 60, 1e-6);
  EXPECT_NEAR(compiled->body_inertia[3 * body], 60 * (4 + 9) / 12.0, 1e-5);
  EXPECT_NEAR(compiled->body_inertia[3 * body + 1], 60 * (1 + 9) / 12.0, 1e-5);
  EXPECT_NEAR(compiled->body_inertia[3 * body + 2], 60 * (1 + 4) / 12.0, 1e-5);
}

TEST(WithoutBodies, LeavesOutABodyAndWhatIsOnIt) {
  TempFolder folder;
  const auto model =
      folder.Write("m.xml", R"(<mujoco><worldbody><body name="a"><body name="b"><geom size="1"/>
    </body></body><body name="c"/></worldbody></mujoco>)");
  SceneComposer composer(folder.Write("base.xml", "<mujoco/>"));
  composer.Attach(model, "m/", {}, {.without = {"a"}});
  const std::string xml = composer.ToXml();
  EXPECT_THAT(xml, testing::Not(testing::HasSubstr("m/a")));
  EXPECT_THAT(xml, testing::Not(testing::HasSubstr("m/b")));
  EXPECT_THAT(xml, testing::HasSubstr("m/c"));
  EXPECT_EQ(ErrorOf([&] { composer.Attach(model, "n/", {}, {.without = {"d"}}); }),
            model.string() + ":1: there is no body 'd' to leave out");
}

TEST(Sites, AreAddedToAPart) {
  TempFolder folder;
  const auto model = folder.Write(
      "m.xml", R"(<mujoco><worldbody><body name="a"><site name="tip"/></body></worldbody></mujoco>)");
  SceneComposer composer(folder.Write("base.xml", "<mujoco/>"));
  composer.Attach(model, "m/", {.position = {1, 0, 0}});
  composer.AddSite("m/handle", {.position = {0, 0.5, 0}}, "m");
  std::vector<std::string> warnings;
  const ModelPtr compiled = CompileModel(composer, false, &warnings);
  const DataPtr data(mj_makeData(compiled.get()));
  mj_kinematics(compiled.get(), data.get());
  const int site = mj_name2id(compiled.get(), mjOBJ_SITE, "m/handle");
  ASSERT_GE(site, 0);
  EXPECT_EQ(data->site_xpos[3 * site], 1);
  EXPECT_EQ(data->site_xpos[3 * site + 1], 0.5);
  EXPECT_EQ(ErrorOf([&] { composer.AddSite("m/tip", {}, "m"); }), "the scene has a site 'm/tip' already");
  EXPECT_EQ(ErrorOf([&] { composer.AddSite("m/new", {}, "n"); }), "the scene has no body 'n'");
}

}  // namespace evalbus::mesh_faces_test
