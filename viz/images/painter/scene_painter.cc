#include "viz/images/painter/scene_painter.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/errors.h"
#include "viz/images/painter/outlines.h"

namespace evalbus::viz {
namespace {

bool IsStatic(const mjvGeom& geom) { return geom.category == mjCAT_STATIC; }

// Returns the index of the light whose shadow is drawn; -1 if there is none.
int ShadowLight(const mjvScene& scene, const mjrContext& context) {
  if (!scene.flags[mjRND_SHADOW] || !context.shadowFBO) return -1;
  for (int i = 0; i < scene.nlight; ++i) {
    if (scene.lights[i].castshadow) return i;
  }
  return -1;
}

Matrix Projection(const LightView& light, const mjvScene& scene) {
  const float near = scene.camera[0].frustum_near, far = scene.camera[0].frustum_far;
  Matrix projection{};
  projection[0] = projection[5] = 1 / light.clip;
  projection[10] = -2 / (far - near);
  projection[14] = -(far + near) / (far - near);
  projection[15] = 1;
  return projection;
}

// Returns the view of a light, which must be directional.
LightView LightViewOf(const mjrContext& context, const mjvLight& light) {
  const Vec direction = Of(light.dir);
  Vec up = Cross(direction, {-1, 0, 0});
  if (Dot(up, up) <= 0.01f) up = Cross(direction, {0, 1, 0});
  return {LookAlong(Of(light.pos), direction, up), context.shadowClip, context.shadowSize};
}

// Returns the transform from the world frame to shadow map coordinates, which are from 0 to 1.
Matrix ShadowFromWorld(const LightView& light, const mjvScene& scene) {
  const Matrix halve = {0.5f, 0, 0, 0, 0, 0.5f, 0, 0, 0, 0, 0.5f, 0, 0.5f, 0.5f, 0.5f, 1};
  return halve * Projection(light, scene) * light.light_from_world;
}

// Draws only `part` of MuJoCo's shadow map, which contains depths as seen from the light, in the same way as
// MuJoCo does. The part must not be empty. Does not restore OpenGL's matrices, viewport, scissor box and
// framebuffer. On return, color writes and back-face culling are enabled.
void DrawShadowMap(const GlFunctions& gl, const SceneGeoms& geoms, const mjrContext& context,
                   const mjvScene& scene, const LightView& light, const Part& part) {
  gl.BindFramebuffer(GL_FRAMEBUFFER, context.shadowFBO);
  gl.DrawBuffer(GL_NONE);
  // The border texels stay empty, so that points outside the map are not in shadow.
  gl.Viewport(1, 1, light.size - 2, light.size - 2);
  gl.Scissor(part.left, part.bottom, part.width(), part.height());
  gl.Enable(GL_SCISSOR_TEST);
  gl.Clear(GL_DEPTH_BUFFER_BIT);
  gl.ColorMask(0, 0, 0, 0);
  gl.CullFace(GL_FRONT);
  gl.MatrixMode(GL_PROJECTION);
  gl.LoadMatrixf(Projection(light, scene).data());
  gl.MatrixMode(GL_MODELVIEW);
  gl.LoadMatrixf(light.light_from_world.data());
  const auto meters = [&](int place) {
    return (2 * static_cast<float>(place - 1) / static_cast<float>(light.size - 2) - 1) * light.clip;
  };
  const float left = meters(part.left), right = meters(part.right), bottom = meters(part.bottom),
              top = meters(part.top);
  for (int i = 0; i < scene.ngeom; ++i) {
    const mjvGeom& geom = scene.geoms[i];
    if (geom.category == mjCAT_DECOR) continue;
    const Vec center = Place(light.light_from_world, Of(geom.pos));
    const float reach = geom.modelrbound;
    const bool is_outside = reach > 0 && (center.x + reach < left || center.x - reach > right ||
                                          center.y + reach < bottom || center.y - reach > top);
    if (!is_outside) geoms.Draw(geom);
  }
  gl.Disable(GL_SCISSOR_TEST);
  gl.CullFace(GL_BACK);
  gl.ColorMask(1, 1, 1, 1);
}

}  // namespace

KeptImage::KeptImage(const GlFunctions& gl, int width_pixels, int height_pixels)
    : PaintedImage(width_pixels, height_pixels), gl_(gl) {
  gl_.GenFramebuffers(1, &framebuffer_);
  gl_.BindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
  gl_.GenRenderbuffers(2, renderbuffers_);
  const std::pair<GLenum, GLenum> kinds[] = {{GL_RGBA8, GL_COLOR_ATTACHMENT0},
                                             {GL_DEPTH_COMPONENT24, GL_DEPTH_ATTACHMENT}};
  for (size_t i = 0; i < 2; ++i) {
    gl_.BindRenderbuffer(GL_RENDERBUFFER, renderbuffers_[i]);
    gl_.RenderbufferStorage(GL_RENDERBUFFER, kinds[i].first, width, height);
    gl_.FramebufferRenderbuffer(GL_FRAMEBUFFER, kinds[i].second, GL_RENDERBUFFER, renderbuffers_[i]);
  }
  if (gl_.CheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
    Free();
    throw EnvironmentError(fmt::format("OpenGL offers no offscreen buffer of {}x{} pixels", width, height));
  }
}

KeptImage::~KeptImage() { Free(); }

void KeptImage::Free() {
  gl_.DeleteFramebuffers(1, &framebuffer_);
  gl_.DeleteRenderbuffers(2, renderbuffers_);
}

ScenePainter::ScenePainter(const mjrContext& context, const mjModel& model, Look look,
                           const std::vector<bool>& outlined_bodies)
    : context_(context),
      boxes_(model),
      look_(look),
      shaders_(gl_, look == Look::kVideo ? context.shadowSize : 0) {
  for (int i = 0; i < model.ngeom && !outlined_bodies.empty(); ++i) {
    is_outlined_.push_back(outlined_bodies[static_cast<size_t>(model.geom_bodyid[i])]);
  }
  for (int i = 0; i < context.ntexture && sky_ < 0; ++i) {
    if (context.textureType[i] == mjTEXTURE_SKYBOX) sky_ = i;
  }
}

std::unique_ptr<PaintedImage> ScenePainter::NewImage(int width, int height) const {
  return std::make_unique<KeptImage>(gl_, width, height);
}

bool ScenePainter::Supports(const mjvScene& scene) const {
  if (!SceneGeoms::Supports(context_) || scene.nlight == 0 || scene.nskin > 0 || scene.enabletransform ||
      scene.stereo != mjSTEREO_NONE || scene.framewidth > 0 || scene.flags[mjRND_FOG] ||
      scene.flags[mjRND_WIREFRAME] || scene.flags[mjRND_ADDITIVE] || scene.flags[mjRND_SEGMENT] ||
      !scene.flags[mjRND_CULL_FACE]) {
    return false;
  }
  int with_shadow = 0;
  for (int i = 0; i < scene.nlight; ++i) {
    if (!scene.lights[i].directional) return false;
    with_shadow += scene.lights[i].castshadow != 0;
  }
  if (with_shadow > 1) return false;
  for (int i = 0; i < scene.ngeom; ++i) {
    const mjvGeom& geom = scene.geoms[i];
    const bool is_endless = geom.type == mjGEOM_PLANE && geom.size[0] <= 0 && geom.size[1] <= 0;
    const bool is_mirror = (geom.type == mjGEOM_PLANE || geom.type == mjGEOM_BOX) && geom.reflectance > 0 &&
                           geom.rgba[3] >= 0.995f;
    if (geom.type > mjGEOM_MESH || is_endless || is_mirror || geom.label[0]) return false;
    if (geom.texid >= 0 && geom.texcoord && context_.textureType[geom.texid] != mjTEXTURE_2D) return false;
  }
  return true;
}

bool ScenePainter::IsBehind(const mjvGeom& geom) const {
  return geom.type == mjGEOM_PLANE && Dot(eye_ - Of(geom.pos), {geom.mat[2], geom.mat[5], geom.mat[8]}) < 0;
}

bool ScenePainter::IsOutside(const mjvGeom& geom) const {
  if (geom.modelrbound <= 0) return false;
  const Vec center = Of(geom.pos) - eye_;
  return std::ranges::any_of(sides_, [&](Vec side) { return Dot(side, center) > geom.modelrbound; });
}

SceneLights ScenePainter::LightsOf(const mjvScene& scene, int shadow_light, Vec forward,
                                   const Matrix& eye_from_world) {
  SceneLights lights;
  const auto add = [&](int i) {
    const mjvLight& light = scene.lights[i];
    const Vec d = Turn(eye_from_world, Unit(light.headlight ? forward : Of(light.dir)));
    lights.direction.push_back({-d.x, -d.y, -d.z});
    lights.ambient.push_back(Of(light.ambient));
    lights.diffuse.push_back(Of(light.diffuse));
    lights.specular.push_back(Of(light.specular));
  };
  for (int i = 0; i < scene.nlight; ++i) {
    if (i != shadow_light) add(i);
  }
  if (look_ == Look::kVideo) {
    // Brightens faces that are turned toward a viewer in front of the robot. Faces that point up are hardly
    // affected.
    const Vec d = Turn(eye_from_world, Unit({0.8f, -0.5f, 0.15f}));
    lights.direction.push_back(d);
    lights.ambient.push_back({0, 0, 0});
    lights.diffuse.push_back({0.1f, 0.1f, 0.1f});
    lights.specular.push_back({0, 0, 0});
  }
  if (shadow_light >= 0) add(shadow_light);
  lights.shadow_from_eye = shadow_from_world_ * Inverse(eye_from_world);
  return lights;
}

void ScenePainter::PlaceTexture(const SceneShaders::Program& program, const mjvGeom& geom, bool is_cube) {
  const bool uniform = geom.texuniform != 0;
  if (is_cube) {
    const float s[4] = {uniform ? geom.size[0] : 1, 0, 0, 0}, t[4] = {0, uniform ? geom.size[1] : 1, 0, 0},
                r[4] = {0, 0, uniform ? geom.size[2] : 1, 0};
    gl_.Uniform4fv(program.plane_s, 1, s);
    gl_.Uniform4fv(program.plane_t, 1, t);
    gl_.Uniform4fv(program.plane_r, 1, r);
    return;
  }
  float scale[2] = {geom.texrepeat[0], geom.texrepeat[1]};
  for (int i = 0; i < 2; ++i) {
    if (geom.size[i] <= 0) continue;
    // The display lists of planes and meshes already include the geom's size. A texture with `texuniform`
    // repeats per meter, so its scale must be multiplied by the size.
    if (geom.dataid >= 0) scale[i] /= geom.size[i];
    if (uniform) scale[i] *= geom.size[i];
  }
  const float s[4] = {0.5f * scale[0], 0, 0, -0.5f}, t[4] = {0, -0.5f * scale[1], 0, -0.5f};
  gl_.Uniform4fv(program.plane_s, 1, s);
  gl_.Uniform4fv(program.plane_t, 1, t);
}

bool ScenePainter::FadesIntoSky(const mjvGeom& geom) const {
  return look_ == Look::kVideo && sky_ >= 0 && geom.type == mjGEOM_PLANE && geom.category == mjCAT_STATIC &&
         geom.texid < 0 && geom.dataid >= 0;
}

void ScenePainter::BindSky() {
  gl_.BindTexture(GL_TEXTURE_CUBE_MAP, context_.texture[sky_]);
  // The sky texture is never minified. The selection of a mipmap level is disabled, because it would take
  // half of the time.
  gl_.TexParameteri(GL_TEXTURE_CUBE_MAP, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
}

void ScenePainter::PlaceSky(const SceneShaders::Program& program, const mjvGeom& geom) {
  const float* const r = geom.mat;
  const Vec d = Of(geom.pos) - eye_;
  const float s[4] = {r[0], r[1], r[2], d.x}, t[4] = {r[6], r[7], r[8], d.z},
              u[4] = {-r[3], -r[4], -r[5], -d.y}, size[3] = {geom.size[0], geom.size[1], 0};
  gl_.Uniform4fv(program.plane_s, 1, s);
  gl_.Uniform4fv(program.plane_t, 1, t);
  gl_.Uniform4fv(program.plane_r, 1, u);
  gl_.Uniform3fv(program.floor_size, 1, size);
}

void ScenePainter::Paint(const mjvGeom& geom, bool with_shadow) {
  const bool is_behind = IsBehind(geom);
  const int type = geom.texid >= 0 ? context_.textureType[geom.texid] : -1;
  const Texture texture = type < 0               ? Texture::kNone
                          : geom.texcoord        ? Texture::kExplicit
                          : type == mjTEXTURE_2D ? Texture::kFlat
                                                 : Texture::kCube;
  const bool fades = FadesIntoSky(geom);
  const SceneShaders::Program& program = shaders_.Use(fades ? Texture::kFloor : texture, with_shadow);
  if (fades) {
    BindSky();
    PlaceSky(program, geom);
  } else if (texture != Texture::kNone) {
    const bool is_cube = texture == Texture::kCube;
    gl_.BindTexture(is_cube ? GL_TEXTURE_CUBE_MAP : GL_TEXTURE_2D, context_.texture[geom.texid]);
    if (texture != Texture::kExplicit) PlaceTexture(program, geom, is_cube);
  }
  // A plane that is seen from behind is drawn translucent.
  const bool is_outlined = !is_outlined_.empty() && geom.objtype == mjOBJ_GEOM && IsOpaque(geom) &&
                           is_outlined_[static_cast<size_t>(geom.objid)];
  const float alpha = is_outlined ? 0 : geom.rgba[3] * (is_behind ? 0.3f : 1);
  const float color[4] = {geom.rgba[0], geom.rgba[1], geom.rgba[2], alpha};
  gl_.Color4fv(color);
  const float material[3] = {geom.emission, geom.specular, 128 * geom.shininess};
  gl_.Uniform3fv(program.material, 1, material);
  if (is_behind) gl_.CullFace(GL_FRONT);
  geoms_.Draw(geom);
  if (is_behind) gl_.CullFace(GL_BACK);
}

void ScenePainter::PaintOpaque(const mjvScene& scene, bool with_shadow,
                               const std::function<bool(const mjvGeom&)>& wanted) {
  for (int i = 0; i < scene.ngeom; ++i) {
    const mjvGeom& geom = scene.geoms[i];
    if (wanted(geom) && IsOpaque(geom) && !IsOutside(geom)) Paint(geom, with_shadow);
  }
}

// As in MuJoCo, each transparent geom is drawn twice: first in order of increasing distance, then in reverse
// order.
void ScenePainter::PaintTransparent(const mjvScene& scene) {
  std::vector<std::pair<float, const mjvGeom*>> by_distance;
  for (int i = 0; i < scene.ngeom; ++i) {
    const mjvGeom& geom = scene.geoms[i];
    if (IsOpaque(geom) || IsOutside(geom)) continue;
    const Vec to = Of(geom.pos) - eye_;
    const float distance = geom.type == mjGEOM_PLANE ? 1e10f : std::sqrt(Dot(to, to)) - geom.modelrbound;
    by_distance.emplace_back(distance, &geom);
  }
  std::ranges::stable_sort(by_distance, {}, [](const auto& entry) { return entry.first; });
  gl_.DepthMask(GL_FALSE);
  gl_.Enable(GL_BLEND);
  gl_.BlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
  for (size_t i = 0; i < by_distance.size(); ++i) Paint(*by_distance[i].second, false);
  for (size_t i = by_distance.size(); i-- > 0;) Paint(*by_distance[i].second, false);
  gl_.DepthMask(GL_TRUE);
  gl_.Disable(GL_BLEND);
}

void ScenePainter::PaintSky(float far) {
  const SceneShaders::Program& program = shaders_.Use(Texture::kSky, false);
  BindSky();
  const float s[4] = {1, 0, 0, 0}, t[4] = {0, 0, 1, 0}, r[4] = {0, -1, 0, 0};
  gl_.Uniform4fv(program.plane_s, 1, s);
  gl_.Uniform4fv(program.plane_t, 1, t);
  gl_.Uniform4fv(program.plane_r, 1, r);
  gl_.CullFace(GL_FRONT);
  geoms_.DrawSky(eye_, 0.7f * far);
  gl_.CullFace(GL_BACK);
}

void ScenePainter::PaintShadows(const mjvScene& scene, const LightView& light) {
  const Matrix shadow_from_world = ShadowFromWorld(light, scene);
  Part part{0, 0, light.size, light.size};
  if (map_shows_ && map_shows_->HasAsManyGeoms(scene) && shadow_from_world_ == shadow_from_world) {
    part = ChangedShadows(*map_shows_, scene, boxes_, light);
  }
  if (!part.is_empty()) DrawShadowMap(gl_, geoms_, context_, scene, light, part);
  map_shows_.emplace(scene);
  shadow_from_world_ = shadow_from_world;
}

Part ScenePainter::Paint(const mjvScene& scene, PaintedImage* painted) {
  auto* const image = static_cast<KeptImage*>(painted);
  const int width = image->width, height = image->height;
  const mjvGLCamera camera = mjv_averageCamera(scene.camera, scene.camera + 1);
  const Vec forward = Of(camera.forward);
  eye_ = Of(camera.pos);
  const Matrix eye_from_world = LookAlong(eye_, forward, Of(camera.up));
  const float near = camera.frustum_near, far = camera.frustum_far, bottom = camera.frustum_bottom,
              top = camera.frustum_top, middle = camera.frustum_center,
              half = 0.5f * static_cast<float>(width) / static_cast<float>(height) * (top - bottom);
  Matrix projection{};
  projection[0] = near / half;
  projection[5] = 2 * near / (top - bottom);
  projection[8] = middle / half;
  projection[9] = (top + bottom) / (top - bottom);
  projection[10] = -(far + near) / (far - near);
  projection[11] = -1;
  projection[14] = -2 * far * near / (far - near);

  const int shadow_light = ShadowLight(scene, context_);
  std::optional<LightView> light;
  if (shadow_light >= 0) light = LightViewOf(context_, scene.lights[shadow_light]);
  Part part{0, 0, width, height};
  if (image->shows_ && image->shows_->IsComparable(scene)) {
    part =
        ChangedPart(*image->shows_, scene, boxes_, {eye_, projection * eye_from_world, width, height}, light);
  }
  if (part.is_empty()) {
    image->shows_.emplace(scene);
    return part;
  }
  if (!is_outlined_.empty()) part = WithOutlines(part, *image);
  // Marks the image as invalid until it is complete, in case an OpenGL call throws.
  image->shows_.reset();

  gl_.Disable(GL_BLEND);
  gl_.Disable(GL_FOG);
  gl_.Disable(GL_LIGHTING);
  gl_.Enable(GL_DEPTH_TEST);
  gl_.Enable(GL_CULL_FACE);
  gl_.FrontFace(GL_CCW);
  gl_.CullFace(GL_BACK);
  gl_.PolygonMode(GL_FRONT_AND_BACK, GL_FILL);
  gl_.DepthMask(GL_TRUE);
  gl_.DepthFunc(GL_LEQUAL);
  gl_.DepthRange(0, 1);
  gl_.ClearColor(0, 0, 0, is_outlined_.empty() ? 0 : 1);
  gl_.ClearDepth(1);
  shaders_.Release();
  if (light) PaintShadows(scene, *light);

  // The view frustum is restricted to the changed part.
  const auto across = [&](int column) {
    return middle + half * (2 * static_cast<float>(column) / static_cast<float>(width) - 1);
  };
  const auto up = [&](int row) {
    return bottom + (top - bottom) * static_cast<float>(row) / static_cast<float>(height);
  };
  const auto in_world = [&](Vec v) { return TurnBack(eye_from_world, Unit(v)); };
  sides_ = {in_world({near, 0, across(part.right)}), in_world({-near, 0, -across(part.left)}),
            in_world({0, near, up(part.top)}), in_world({0, -near, -up(part.bottom)})};
  gl_.MatrixMode(GL_PROJECTION);
  gl_.LoadMatrixf(projection.data());
  gl_.MatrixMode(GL_MODELVIEW);
  gl_.LoadMatrixf(eye_from_world.data());
  shaders_.SetLights(LightsOf(scene, shadow_light, forward, eye_from_world));
  gl_.BindFramebuffer(GL_FRAMEBUFFER, image->framebuffer_);
  gl_.DrawBuffer(GL_COLOR_ATTACHMENT0);
  gl_.Viewport(0, 0, width, height);
  gl_.Scissor(part.left, part.bottom, part.width(), part.height());
  gl_.Enable(GL_SCISSOR_TEST);
  PaintPart(scene, light.has_value(), far);
  gl_.Disable(GL_SCISSOR_TEST);
  gl_.ReadBuffer(GL_COLOR_ATTACHMENT0);
  gl_.PixelStorei(GL_PACK_ROW_LENGTH, width);
  const size_t first = static_cast<size_t>(part.bottom * width + part.left) * 4;
  gl_.ReadPixels(part.left, part.bottom, part.width(), part.height(), GL_RGBA, GL_UNSIGNED_BYTE,
                 &image->rgba[first]);
  gl_.PixelStorei(GL_PACK_ROW_LENGTH, 0);
  if (!is_outlined_.empty()) DrawOutlines(part, image);
  // Restores the framebuffer into which MuJoCo draws.
  gl_.BindFramebuffer(GL_FRAMEBUFFER, context_.offFBO);
  image->shows_.emplace(scene);
  return part;
}

void ScenePainter::PaintPart(const mjvScene& scene, bool with_shadow, float far) {
  gl_.Clear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  gl_.ActiveTexture(GL_TEXTURE1);
  gl_.BindTexture(GL_TEXTURE_2D, context_.shadowTex);
  if (look_ == Look::kVideo) {
    for (const GLenum filter : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER}) {
      gl_.TexParameteri(GL_TEXTURE_2D, filter, GL_LINEAR);
    }
  }
  gl_.ActiveTexture(GL_TEXTURE0);
  // Moving geoms are drawn first, because they are mostly in front, and planes last, because they are behind
  // everything. The depth test then rejects most hidden surfaces before they are shaded.
  const auto is_plane = [](const mjvGeom& geom) { return geom.type == mjGEOM_PLANE; };
  PaintOpaque(scene, with_shadow, [](const mjvGeom& geom) { return !IsStatic(geom); });
  PaintOpaque(scene, with_shadow, [&](const mjvGeom& geom) { return IsStatic(geom) && !is_plane(geom); });
  PaintOpaque(scene, with_shadow, [&](const mjvGeom& geom) { return IsStatic(geom) && is_plane(geom); });
  if (sky_ >= 0 && scene.flags[mjRND_SKYBOX]) PaintSky(far);
  PaintTransparent(scene);
  shaders_.Release();
}

}  // namespace evalbus::viz
