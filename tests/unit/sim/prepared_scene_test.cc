// A scene is composed once. Processes that start later load the compiled models.
#include "sim/prepared_scene.h"

#include <gtest/gtest.h>

#include <cstring>

#include "base/errors.h"
#include "base/run_layout.h"
#include "bus/message.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::sim::prepared_scene_test {

namespace fs = std::filesystem;

TEST(PreparedScene, IsLoadedAsItWasComposed) {
  const TemporaryFolder folder;
  const fs::path models = folder.path() / "models";
  fs::copy(fs::path(EVALBUS_SOURCE_DIR) / "models", models, fs::copy_options::recursive);
  SimOptions options;
  options.task = models / "tasks/lift_pot.yaml/position";
  options.out = folder.path() / "run";
  options.after_success_s = 1;
  const PreparedScene composed = PrepareScene(options);
  EXPECT_FALSE(composed.scene.xml.empty());

  // Without its meshes, the scene can no longer be composed.
  for (const auto& entry : fs::recursive_directory_iterator(models)) {
    if (entry.path().extension() == ".obj") fs::remove(entry.path());
  }
  EXPECT_THROW(ComposeScene(options), InputError);
  options.physics_sha256 = composed.info.physics_sha256;
  options.visual_sha256 = composed.info.visual_sha256;
  options.scene_warnings = {"something"};
  const PreparedScene loaded = PrepareScene(options);
  EXPECT_EQ(Encode(loaded.info), Encode(composed.info));
  EXPECT_EQ(loaded.scene.warnings, options.scene_warnings);
  const mjModel &a = *composed.scene.physics, &b = *loaded.scene.physics;
  ASSERT_EQ(a.nbuffer, b.nbuffer);
  EXPECT_EQ(std::memcmp(a.buffer, b.buffer, static_cast<size_t>(a.nbuffer)), 0);

  // The models belong to another run.
  options.visual_sha256 = std::string(64, '0');
  EXPECT_THROW(PrepareScene(options), InputError);
  fs::remove(options.out / kModelFolder / kPhysicsModel);
  EXPECT_THROW(PrepareScene(options), InputError);
}

}  // namespace evalbus::sim::prepared_scene_test
