#include "viz/viewer/scene_blocks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "base/sha256.h"
#include "models/randomized_model.h"
#include "models/scene.h"
#include "tests/unit/dressed_scene.h"
#include "viz/viewer/block.h"

namespace evalbus::viz::scene_blocks_test {

ModelPtr Copy(const mjModel& model) { return ModelPtr(mj_copyModel(nullptr, &model)); }

Scene SceneOf(const std::string& task) {
  const TaskSelection selection = FindTask(task);
  return BuildScene(selection.task, LoadRobot(selection.task.robot_file, {}));
}

TEST(SceneBlocks, DrawWhatTheModelHas) {
  const Scene scene = SceneOf("lift_pot");
  const mjModel& m = *scene.visual;
  const SceneBlocks blocks(scene.info, Copy(m), *scene.physics);
  for (const auto& [id, bytes] : blocks.blocks()) EXPECT_EQ(id, Sha256Text(bytes));
  const BlockReader block(blocks.blocks().at(blocks.id()));
  const auto& head = block.head();
  ASSERT_EQ(head["bodies"].size(), static_cast<size_t>(m.nbody));

  // A body moves if it or one of its ancestors has a joint.
  for (int body = 0; body < m.nbody; ++body) {
    bool moves = false;
    for (int b = body; b != 0; b = m.body_parentid[b]) moves = moves || m.body_jntnum[b] > 0;
    EXPECT_EQ(head["bodies"][static_cast<size_t>(body)]["moves"], moves) << body;
    EXPECT_EQ(std::ranges::count(blocks.moving_bodies(), body), moves);
  }
  // The block has each geom of MODEL once, at MuJoCo's position.
  std::vector<int> collision;
  size_t meshes = 0;
  std::set<std::string> mesh_blocks;
  for (const auto& geom : head["geoms"]) {
    if (geom.contains("mesh")) {
      ++meshes;
      mesh_blocks.insert(geom["mesh"].get<std::string>());
      EXPECT_TRUE(blocks.blocks().contains(geom["mesh"].get<std::string>()));
    }
    if (geom.value("collision", false)) {
      const int id = geom["geom"];
      collision.push_back(id);
      EXPECT_EQ(geom["name"], scene.info.geom_name[static_cast<size_t>(id)]);
      EXPECT_EQ(geom["body"], scene.physics->geom_bodyid[id]);
      EXPECT_EQ(geom["position_m"][2], scene.physics->geom_pos[3 * id + 2]);
    } else if (geom.contains("material")) {
      EXPECT_LT(geom["material"].get<int>(), m.nmat);
    }
  }
  EXPECT_EQ(collision.size(), static_cast<size_t>(scene.info.num_geoms));
  EXPECT_GT(meshes, 20u);
  EXPECT_EQ(head["cameras"].size(), static_cast<size_t>(m.ncam));
  EXPECT_EQ(head["wrists"].size(), 2u);
  EXPECT_EQ(head["entities"][0]["kind"], "world");
  // The two arms have the same meshes, and each mesh is stored only once.
  EXPECT_LT(mesh_blocks.size(), meshes);
  EXPECT_LE(mesh_blocks.size(), static_cast<size_t>(m.nmesh));
}

TEST(SceneBlocks, AMeshIsTheModelsToTheSixteenthBit) {
  const Scene scene = SceneOf("lift_pot");
  const mjModel& m = *scene.visual;
  const SceneBlocks blocks(scene.info, Copy(m), *scene.physics);
  const BlockReader block(blocks.blocks().at(blocks.id()));
  int compared = 0;
  // Visual geoms are in the order of the model.
  auto geom = block.head()["geoms"].begin();
  for (int id = 0; id < m.ngeom; ++id) {
    if (m.geom_group[id] >= 3) continue;
    if (m.geom_type[id] == mjGEOM_MESH) {
      const BlockReader mesh(blocks.blocks().at((*geom)["mesh"].get<std::string>()));
      const std::vector<double> vertices = mesh.Values("vertices_m"), normals = mesh.Values("normals"),
                                faces = mesh.Values("faces");
      const int data = m.geom_dataid[id];
      ASSERT_EQ(faces.size(), static_cast<size_t>(3 * m.mesh_facenum[data]));
      const float* vertex = m.mesh_vert + 3 * m.mesh_vertadr[data];
      const float* normal = m.mesh_normal + 3 * m.mesh_vertadr[data];
      for (size_t corner = 0; corner < faces.size(); ++corner) {
        const int from = m.mesh_face[3 * m.mesh_faceadr[data] + static_cast<int>(corner)];
        for (size_t k = 0; k < 3; ++k) {
          const size_t to = 3 * static_cast<size_t>(faces[corner]) + k;
          // The tolerance is a quantization step of a mesh of 0.5 m.
          ASSERT_NEAR(vertices[to], vertex[3 * from + static_cast<int>(k)], 0.5 / 65535);
          ASSERT_NEAR(normals[to], normal[3 * from + static_cast<int>(k)], 2e-5);
        }
      }
      ++compared;
    }
    ++geom;
  }
  EXPECT_GT(compared, 20);
}

TEST(SceneBlocks, AppearanceIsWhatTheSeedChanges) {
  const auto [task, scene] =
      BuildDressed("lift_pot",
                   "      - color: {of: [pot], min_rgb: [0, 0, 0], max_rgb: [1, 1, 1]}\n"
                   "      - light: {name: key, min_factor: 0.5, max_factor: 0.9}\n"
                   "      - camera: {name: overview, shift_m: [0.1, 0.1, 0.1], turn_deg: 5}\n");
  const SceneBlocks blocks(scene.info, Copy(*scene.visual), *scene.physics);
  const ModelPtr changed = Copy(*scene.visual);
  RandomizeAppearance(task.variation("dressed"), 5, changed.get());

  const nlohmann::ordered_json appearance = blocks.Appearance(5);
  EXPECT_EQ(blocks.Appearance(5), appearance);
  EXPECT_NE(blocks.Appearance(6), appearance);
  // The appearance consists of the pot's two materials, one light and one camera.
  ASSERT_EQ(appearance["materials"].size(), 2u);
  for (const auto& change : appearance["materials"]) {
    const int id = change[0];
    EXPECT_TRUE(std::string(mj_id2name(changed.get(), mjOBJ_MATERIAL, id)).starts_with("pot/"));
    for (size_t k = 0; k < 4; ++k) {
      EXPECT_EQ(change[1]["rgba"][k].get<float>(), changed->mat_rgba[4 * id + static_cast<int>(k)]);
    }
    EXPECT_EQ(change[1].size(), 1u);
  }
  EXPECT_TRUE(appearance["geoms"].empty());
  ASSERT_EQ(appearance["lights"].size(), 1u);
  EXPECT_EQ(appearance["lights"][0][0], 0);
  EXPECT_EQ(appearance["lights"][0][1]["diffuse"][0].get<float>(), changed->light_diffuse[0]);
  ASSERT_EQ(appearance["cameras"].size(), 1u);
  const int camera = mj_name2id(changed.get(), mjOBJ_CAMERA, "overview");
  EXPECT_EQ(appearance["cameras"][0][0], camera);
  EXPECT_EQ(appearance["cameras"][0][1]["position_m"][1], changed->cam_pos[3 * camera + 1]);
  EXPECT_EQ(appearance["cameras"][0][1]["quat_wxyz"][1], changed->cam_quat[4 * camera + 1]);
}

TEST(SceneBlocks, AnEpisodesTextureIsOneOfTheScenesBlocks) {
  const Scene scene = BuildDressed("cube_handover",
                                   "      - texture: {of: [table], choices: [plain, checker, marble]}\n"
                                   "      - light: {name: key, turn_deg: 10}\n")
                          .scene;
  const SceneBlocks blocks(scene.info, Copy(*scene.visual), *scene.physics);
  const BlockReader block(blocks.blocks().at(blocks.id()));
  ASSERT_EQ(block.head()["textures"].size(), 2U);
  std::set<nlohmann::ordered_json> seen;
  for (int seed = 0; seed < 20; ++seed) {
    const nlohmann::ordered_json appearance = blocks.Appearance(seed);
    ASSERT_EQ(appearance["materials"].size(), 1U);
    const int material = appearance["materials"][0][0];
    EXPECT_STREQ(mj_id2name(scene.visual.get(), mjOBJ_MATERIAL, material), "table/oak");
    const nlohmann::ordered_json& change = appearance["materials"][0][1];
    EXPECT_EQ(change.size(), 1U);
    seen.insert(change["texture"]);
    ASSERT_EQ(appearance["lights"].size(), 1U);
    EXPECT_TRUE(appearance["lights"][0][1].contains("direction"));
  }
  // The pot has no texture or one of two.
  EXPECT_EQ(seen.size(), 3U);
  for (const nlohmann::ordered_json& texture : seen)
    EXPECT_TRUE(texture.is_null() || blocks.blocks().contains(texture.get<std::string>()));
}

}  // namespace evalbus::viz::scene_blocks_test
