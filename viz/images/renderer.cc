#include "viz/images/renderer.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <list>
#include <mutex>

#include "base/environment_choice.h"
#include "base/errors.h"
#include "base/suggestion.h"
#include "models/mujoco_errors.h"
#include "models/randomized_model.h"
#include "models/task_description.h"
#include "viz/images/painter/gl_context.h"
#include "viz/images/painter/gl_functions.h"
#include "viz/images/painter/scene_painter.h"

namespace evalbus::viz {
namespace {

constexpr int kMaxGeoms = 10000;
// Supersampling: each block of 2 x 2 output pixels is computed from 3 x 3 drawn pixels, weighted by
// overlapping area. In software, this is faster than OpenGL's multisampling. It also smooths the edges of
// shadows and textures.
constexpr int kDrawn = 3, kShown = 2;
// Limit on the total number of drawn pixels in cached images (16 bytes per pixel). A video of 1280x720 with
// three insets needs 3 million.
constexpr size_t kMaxPixelsKept = 8000000;

// Computes one row of pixels from the drawn row that it covers fully and the drawn row that it covers half.
// kRed: index of the red byte in a pixel of kPixelBytes bytes. Green is always in the middle.
template <size_t kPixelBytes, size_t kRed>
void Shrink(const uint8_t* whole, const uint8_t* half, size_t width, uint8_t* pixel) {
  for (size_t i = 0; i < width; i += 2, whole += 12, half += 12, pixel += 2 * kPixelBytes) {
    for (size_t c = 0; c < 3; ++c) {
      const int left = 2 * whole[c] + half[c];
      const int middle = 2 * whole[c + 4] + half[c + 4];
      const int right = 2 * whole[c + 8] + half[c + 8];
      const size_t place = kRed == 0 ? c : kRed - c;
      pixel[place] = static_cast<uint8_t>((2 * left + middle + 4) / 9);
      pixel[place + kPixelBytes] = static_cast<uint8_t>((2 * right + middle + 4) / 9);
    }
    for (size_t unused = 3; unused < kPixelBytes; ++unused) pixel[unused] = pixel[unused + kPixelBytes] = 0;
  }
}

// Downscales by kDrawn : kShown and writes rows from the top. Only rows that depend on the drawn rows
// [bottom, top) are updated. OpenGL stores rows from the bottom up.
template <size_t kPixelBytes, size_t kRed>
void ShrinkRows(const std::vector<uint8_t>& drawn, FrameSize size, size_t bottom, size_t top,
                std::vector<uint8_t>* pixels) {
  static_assert(kDrawn == 3 && kShown == 2);
  const size_t width = static_cast<size_t>(size.width), height = static_cast<size_t>(size.height);
  const size_t row_bytes = width / 2 * 3 * 4;
  for (size_t row = height - 2 * ((top + 2) / 3); row < height - 2 * (bottom / 3); row += 2) {
    const uint8_t* lower = &drawn[(height - 2 - row) / 2 * 3 * row_bytes];
    const uint8_t* middle = lower + row_bytes;
    const uint8_t* upper = middle + row_bytes;
    uint8_t* const pixel = &(*pixels)[row * width * kPixelBytes];
    Shrink<kPixelBytes, kRed>(upper, middle, width, pixel);
    Shrink<kPixelBytes, kRed>(lower, middle, width, pixel + width * kPixelBytes);
  }
}

// Downscales images that are drawn at twice their size. This works for any output size.
template <size_t kPixelBytes, size_t kRed>
void HalveRows(const std::vector<uint8_t>& drawn, FrameSize size, size_t bottom, size_t top,
               std::vector<uint8_t>* pixels) {
  const size_t width = static_cast<size_t>(size.width), height = static_cast<size_t>(size.height);
  const size_t row_bytes = 2 * width * 4;
  for (size_t row = height - (top + 1) / 2; row < height - bottom / 2; ++row) {
    const uint8_t* below = &drawn[2 * (height - 1 - row) * row_bytes];
    const uint8_t* above = below + row_bytes;
    uint8_t* pixel = &(*pixels)[row * width * kPixelBytes];
    for (size_t i = 0; i < width; ++i, below += 8, above += 8, pixel += kPixelBytes) {
      for (size_t c = 0; c < 3; ++c) {
        pixel[kRed == 0 ? c : kRed - c] =
            static_cast<uint8_t>((below[c] + below[c + 4] + above[c] + above[c + 4] + 2) / 4);
      }
    }
  }
}

// Draws with MuJoCo's mjr_render into the lower left corner of MuJoCo's offscreen buffer. The buffer must be
// large enough for the image.
class MujocoPainter : public Painter {
 public:
  // context: created by mjr_makeContext. Throws EnvironmentError if OpenGL has no glReadPixels.
  explicit MujocoPainter(const mjrContext& context) : context_(context) {}

  bool Supports(const mjvScene&) const override { return true; }
  std::unique_ptr<PaintedImage> NewImage(int width, int height) const override {
    return std::make_unique<PaintedImage>(width, height);
  }
  Part Paint(const mjvScene& scene, PaintedImage* image) override {
    // MuJoCo 2.2 takes a non-const scene, because it stores the order of transparent geoms there.
    mjr_render({0, 0, image->width, image->height}, const_cast<mjvScene*>(&scene), &context_);
    read_pixels_(0, 0, image->width, image->height, GL_RGBA, GL_UNSIGNED_BYTE, image->rgba.data());
    return {0, 0, image->width, image->height};
  }

 private:
  const mjrContext& context_;
  decltype(glReadPixels)* const read_pixels_ = FindGl<decltype(glReadPixels)>("glReadPixels");
};

}  // namespace

bool MujocoPaints() { return EnvironmentSelects("EVALBUS_PAINTER", "mujoco", "evalbus"); }

int FindCamera(const mjModel& model, const std::string& name) {
  const int camera = mj_name2id(&model, mjOBJ_CAMERA, name.c_str());
  if (camera >= 0) return camera;
  std::vector<std::string> names;
  for (int i = 0; i < model.ncam; ++i) {
    if (const char* known = mj_id2name(&model, mjOBJ_CAMERA, i)) names.emplace_back(known);
  }
  const std::string list = names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "));
  throw InputError("no camera '" + name + "'" + Suggestion(name, names, "; this scene has " + list));
}

// The cached image of a shot, with the drawn pixels and the downscaled result.
struct Kept {
  Kept(Painter* by, const Shot& of, size_t bytes, FrameSize drawn_size)
      : painter(by),
        shot(of),
        pixel_bytes(bytes),
        drawn(by->NewImage(drawn_size.width, drawn_size.height)),
        pixels(static_cast<size_t>(of.size.width) * static_cast<size_t>(of.size.height) * bytes) {}

  Painter* painter;
  Shot shot;
  size_t pixel_bytes;
  std::unique_ptr<PaintedImage> drawn;
  std::vector<uint8_t> pixels;
};

struct Renderer::Gl {
  Gl(const mjModel& model, bool mujoco_paints, Look look, const std::vector<bool>& outlined_bodies)
      : buffer{model.vis.global.offwidth, model.vis.global.offheight} {
    mjv_defaultScene(&scene);
    mjr_defaultContext(&context);
    mjv_defaultOption(&option);
    mjv_defaultCamera(&camera);
    camera.type = mjCAMERA_FIXED;
    try {
      mjv_makeScene(&model, &scene, kMaxGeoms);
      {
        // mjr_makeContext looks up the OpenGL functions on every call and stores them in global variables.
        static std::mutex one_at_a_time;
        const std::lock_guard lock(one_at_a_time);
        mjr_makeContext(&model, &context, mjFONTSCALE_50);
      }
      mjr_setBuffer(mjFB_OFFSCREEN, &context);
      if (context.currentBuffer != mjFB_OFFSCREEN) {
        throw EnvironmentError(
            fmt::format("OpenGL offers no offscreen buffer of {}x{} pixels", buffer.width, buffer.height));
      }
      mujoco_painter = std::make_unique<MujocoPainter>(context);
      if (!mujoco_paints) {
        scene_painter = std::make_unique<ScenePainter>(context, model, look, outlined_bodies);
      }
    } catch (...) {
      Free();
      throw;
    }
  }
  ~Gl() {
    gl.MakeCurrent();
    Free();
  }
  Gl(const Gl&) = delete;
  Gl& operator=(const Gl&) = delete;

  // Returns the cache entry of this shot. Creates it if necessary.
  Kept& KeptOf(Painter* painter, const Shot& shot, size_t pixel_bytes, FrameSize drawn_size) {
    const auto found = std::ranges::find_if(kept, [&](const Kept& k) {
      return k.painter == painter && k.shot == shot && k.pixel_bytes == pixel_bytes;
    });
    if (found != kept.end()) {
      kept.splice(kept.begin(), kept, found);
      return kept.front();
    }
    kept.emplace_front(painter, shot, pixel_bytes, drawn_size);
    size_t pixels_kept = 0;
    for (auto k = kept.begin(); k != kept.end();) {
      pixels_kept += k->drawn->rgba.size() / 4;
      const bool is_wanted = k == kept.begin() || pixels_kept <= kMaxPixelsKept;
      k = is_wanted ? std::next(k) : kept.erase(k);
    }
    return kept.front();
  }
  void Free() {
    kept.clear();
    scene_painter.reset();
    mujoco_painter.reset();
    mjr_freeContext(&context);
    mjv_freeScene(&scene);
  }

  GlContext gl;
  mjvScene scene;
  mjrContext context;
  mjvOption option;
  mjvCamera camera;
  // Null if MujocoPainter draws everything.
  std::unique_ptr<ScenePainter> scene_painter;
  std::unique_ptr<MujocoPainter> mujoco_painter;
  FrameSize buffer;
  // Cached images, the most recently used first.
  std::list<Kept> kept;
};

Renderer::Renderer(ModelPtr model, FrameSize size, Look look, std::vector<bool> outlined_bodies)
    : model_(std::move(model)),
      size_(size),
      mujoco_paints_(MujocoPaints()),
      look_(look),
      outlined_bodies_(std::move(outlined_bodies)) {
  CheckFrameSize(size);
  InstallMujocoHandlers();
  if (!outlined_bodies_.empty() && outlined_bodies_.size() != static_cast<size_t>(model_->nbody)) {
    throw InputError(fmt::format("MODEL has {} bodies, expected {} as in the visual model",
                                 outlined_bodies_.size(), model_->nbody));
  }
  model_->vis.global.offwidth = size.width / kShown * kDrawn;
  model_->vis.global.offheight = size.height / kShown * kDrawn;
  model_->vis.quality.offsamples = 0;
  data_.reset(mj_makeData(model_.get()));
  mj_kinematics(model_.get(), data_.get());
  gl_ = std::make_unique<Gl>(*model_, mujoco_paints_, look_, outlined_bodies_);
}

Renderer::~Renderer() = default;

void Renderer::SetAppearance(const model_info_t& info, std::optional<int64_t> seed) {
  const TaskDescription task = ParseTask(info.task_yaml, info.task_file, false);
  const Variation& variation = task.variation(info.variation);
  if (unchanged_) mj_copyModel(model_.get(), unchanged_.get());
  if (!seed || variation.appearance.empty()) return;
  if (!unchanged_) unchanged_.reset(mj_copyModel(nullptr, model_.get()));
  RandomizeAppearance(variation, *seed, model_.get());
}

void Renderer::SetState(const state_t& state) {
  if (state.num_qpos != model_->nq) {
    throw InputError(
        fmt::format("STATE has {} coordinates, but the visual model has {}", state.num_qpos, model_->nq));
  }
  if (model_->nmocap > 0 && state.num_bodies != model_->nbody) {
    throw InputError(
        fmt::format("STATE has {} bodies, but the visual model has {}", state.num_bodies, model_->nbody));
  }
  std::copy(state.qpos_mixed.begin(), state.qpos_mixed.end(), data_->qpos);
  for (int body = 0; body < model_->nbody && model_->nmocap > 0; ++body) {
    const int mocap = model_->body_mocapid[body];
    if (mocap < 0) continue;
    const size_t i = static_cast<size_t>(body);
    mju_copy3(data_->mocap_pos + 3 * mocap, state.body[i].position_m);
    mju_copy4(data_->mocap_quat + 4 * mocap, state.body[i].quat_wxyz);
  }
  mj_kinematics(model_.get(), data_.get());
  mj_comPos(model_.get(), data_.get());  // required by lights and cameras that track a subtree
  mj_camlight(model_.get(), data_.get());
}

CameraPose Renderer::PoseOf(int camera) const {
  CameraPose pose{};
  mju_copy3(pose.position_m, data_->cam_xpos + 3 * camera);
  mju_copy(pose.rotation, data_->cam_xmat + 9 * camera, 9);
  pose.fovy_deg = model_->cam_fovy[camera];
  return pose;
}

void Renderer::Prepare(FrameSize buffer) {
  if (!gl_ || buffer.width > gl_->buffer.width || buffer.height > gl_->buffer.height) {
    auto& global = model_->vis.global;
    global.offwidth = gl_ ? std::max(buffer.width, gl_->buffer.width) : buffer.width;
    global.offheight = gl_ ? std::max(buffer.height, gl_->buffer.height) : buffer.height;
    gl_.reset();
    gl_ = std::make_unique<Gl>(*model_, mujoco_paints_, look_, outlined_bodies_);
  }
  gl_->gl.MakeCurrent();
}

void Renderer::UpdateScene(const Shot& shot, bool is_depth) {
  gl_->camera.fixedcamid = shot.camera;
  gl_->scene.flags[mjRND_SHADOW] = shot.shadows && !is_depth;
  // Only geoms are drawn in a depth image, because the sky would appear at the distance at which it is drawn.
  gl_->scene.flags[mjRND_SEGMENT] = is_depth;
  double& fovy = model_->cam_fovy[shot.camera];
  const double own_fovy = fovy;
  if (shot.fovy_deg > 0) fovy = shot.fovy_deg;
  mjv_updateScene(model_.get(), data_.get(), &gl_->option, nullptr, &gl_->camera, mjCAT_ALL, &gl_->scene);
  fovy = own_fovy;
}

Painter* Renderer::PrepareToDraw(const Shot& shot, FrameSize size) {
  if (gl_->scene_painter) {
    Prepare({0, 0});  // ScenePainter has separate buffers
    UpdateScene(shot, false);
    if (gl_->scene_painter->Supports(gl_->scene)) return gl_->scene_painter.get();
    // MuJoCo will overwrite the shadow map that ScenePainter uses.
    if (gl_->scene.flags[mjRND_SHADOW]) gl_->scene_painter->ForgetShadows();
  }
  if (!outlined_bodies_.empty()) {
    throw InputError(
        "--outline: not possible in a scene with mirrors, fog, spot lights, skins or several lights with "
        "shadows, nor with EVALBUS_PAINTER=mujoco");
  }
  Prepare(size);
  UpdateScene(shot, false);
  return gl_->mujoco_painter.get();
}

template <size_t kPixelBytes, size_t kRed>
const std::vector<uint8_t>& Renderer::Draw(const Shot& shot) {
  const bool is_even = shot.size.width % kShown == 0 && shot.size.height % kShown == 0;
  const FrameSize drawn_size =
      is_even ? FrameSize{shot.size.width / kShown * kDrawn, shot.size.height / kShown * kDrawn}
              : FrameSize{2 * shot.size.width, 2 * shot.size.height};
  const auto shrink = [&](const std::vector<uint8_t>& rgba, const Part& part, std::vector<uint8_t>* pixels) {
    const size_t bottom = static_cast<size_t>(part.bottom), top = static_cast<size_t>(part.top);
    if (is_even) {
      ShrinkRows<kPixelBytes, kRed>(rgba, shot.size, bottom, top, pixels);
    } else {
      HalveRows<kPixelBytes, kRed>(rgba, shot.size, bottom, top, pixels);
    }
  };
  Painter* const painter = PrepareToDraw(shot, drawn_size);
  Kept& kept = gl_->KeptOf(painter, shot, kPixelBytes, drawn_size);
  const Part part = painter->Paint(gl_->scene, kept.drawn.get());
  if (!part.is_empty()) shrink(kept.drawn->rgba, part, &kept.pixels);
  return kept.pixels;
}

void Renderer::Render(int camera, Frame* frame) { frame->bgrx = Draw<4, 2>({camera, size_}); }

void Renderer::RenderRgb(const Shot& shot, std::vector<uint8_t>* rgb) { *rgb = Draw<3, 0>(shot); }

void Renderer::RenderDepth(const Shot& shot, std::vector<float>* depth_m) {
  const size_t width = static_cast<size_t>(shot.size.width), height = static_cast<size_t>(shot.size.height);
  depth_m->resize(width * height);
  Prepare(shot.size);
  UpdateScene(shot, true);
  mjr_render({0, 0, shot.size.width, shot.size.height}, &gl_->scene, &gl_->context);
  mjr_readPixels(nullptr, depth_m->data(), {0, 0, shot.size.width, shot.size.height}, &gl_->context);
  const double near = gl_->scene.camera[0].frustum_near, far = gl_->scene.camera[0].frustum_far;
  for (float& depth : *depth_m) depth = static_cast<float>(near / (1 - depth * (1 - near / far)));
  for (size_t row = 0; row < height / 2; ++row) {
    float* const upper = depth_m->data() + row * width;
    std::swap_ranges(upper, upper + width, depth_m->data() + (height - 1 - row) * width);
  }
}

}  // namespace evalbus::viz
