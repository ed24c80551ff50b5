// Tests how both painters (EVALBUS_PAINTER) render an episode's textures and lights.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <map>
#include <memory>
#include <vector>

#include "models/randomized_model.h"
#include "models/scene.h"
#include "tests/unit/dressed_scene.h"
#include "tests/unit/viz/viz_scene.h"
#include "viz/images/renderer.h"

namespace evalbus::viz::appearance_test {

using Pixels = std::vector<uint8_t>;

// The scene of cube_handover with this randomization.
class Dressed {
 public:
  explicit Dressed(const std::string& randomize) : dressed_(BuildDressed("cube_handover", randomize)) {}
  const Scene& scene() const { return dressed_.scene; }

  std::unique_ptr<Renderer> RendererWith(const char* painter) const {
    setenv("EVALBUS_PAINTER", painter, 1);
    auto renderer = std::make_unique<Renderer>(Copy(*scene().visual), FrameSize{320, 240});
    unsetenv("EVALBUS_PAINTER");
    renderer->SetState(StateOf(HomeQpos(*scene().visual)));
    return renderer;
  }
  Pixels Image(Renderer* renderer, std::optional<int64_t> seed) const {
    renderer->SetAppearance(scene().info, seed);
    renderer->SetState(StateOf(HomeQpos(*scene().visual)));
    Pixels rgb;
    renderer->RenderRgb({FindCamera(*scene().visual, "overview"), {320, 240}}, &rgb);
    return rgb;
  }
  double Value(int64_t seed) const {
    const ModelPtr model = Copy(*scene().visual);
    return RandomizeAppearance(dressed_.task.variation("dressed"), seed, model.get()).at(0).value;
  }

 private:
  DressedScene dressed_;
};

// Returns the share of pixels in which a channel differs by more than `levels`.
double ShareThatDiffers(const Pixels& a, const Pixels& b, int levels) {
  EXPECT_EQ(a.size(), b.size());
  int count = 0;
  for (size_t i = 0; i < a.size(); i += 3) {
    bool differs = false;
    for (size_t c = i; c < i + 3; ++c) differs = differs || std::abs(a[c] - b[c]) > levels;
    count += differs;
  }
  return 3.0 * count / static_cast<double>(a.size());
}

double Mean(const Pixels& a, const Pixels& b) {
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i) sum += std::abs(a[i] - b[i]);
  return sum / static_cast<double>(a.size());
}

TEST(Appearance, EachTextureHasItsImage) {
  const Dressed dressed("      - texture: {of: [table], choices: [table/oak, plain, checker, marble]}\n");
  const auto ours = dressed.RendererWith("evalbus"), mujocos = dressed.RendererWith("mujoco");
  const Pixels without = dressed.Image(ours.get(), std::nullopt);
  std::map<double, Pixels> images;
  for (int seed = 0; seed < 20; ++seed) {
    const Pixels image = dressed.Image(ours.get(), seed);
    const auto [known, is_new] = images.emplace(dressed.Value(seed), image);
    EXPECT_EQ(known->second, image) << "equal textures, equal bytes";
    if (!is_new) continue;
    EXPECT_LE(Mean(image, dressed.Image(mujocos.get(), seed)), 0.5) << "both painters draw the texture";
  }
  ASSERT_EQ(images.size(), 4U);
  EXPECT_EQ(images.at(0), without) << "the table's own texture";
  // The table top covers a ninth of the image.
  for (const auto& [a, image] : images) {
    for (const auto& [b, other] : images) {
      if (a == b) continue;
      EXPECT_GT(ShareThatDiffers(image, other, 10), 0.05) << a << " and " << b;
    }
  }
  EXPECT_EQ(dressed.Image(ours.get(), std::nullopt), without);
}

TEST(Appearance, ATurnedLightShadesAnew) {
  const Dressed dressed("      - light: {name: key, turn_deg: 25}\n");
  const auto ours = dressed.RendererWith("evalbus"), mujocos = dressed.RendererWith("mujoco");
  const Pixels without = dressed.Image(ours.get(), std::nullopt);
  for (int seed = 1; seed < 4; ++seed) {
    const Pixels image = dressed.Image(ours.get(), seed);
    EXPECT_GT(ShareThatDiffers(image, without, 10), 0.05) << seed;
    EXPECT_EQ(dressed.Image(ours.get(), seed), image);
    // The painters differ in few pixels, at the edges of shadows.
    EXPECT_LE(Mean(image, dressed.Image(mujocos.get(), seed)), 1) << seed;
  }
  EXPECT_EQ(dressed.Image(ours.get(), std::nullopt), without);
}

}  // namespace evalbus::viz::appearance_test
