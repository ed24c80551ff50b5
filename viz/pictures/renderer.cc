#include "viz/pictures/renderer.h"

#include <fmt/format.h>

#include <algorithm>
#include <mutex>
#include <vector>

#include "base/errors.h"
#include "models/mujoco_errors.h"
#include "models/randomised_model.h"
#include "models/task_description.h"
#include "viz/pictures/gl_context.h"
#include "viz/pictures/gl_functions.h"
#include "viz/pictures/scene_painter.h"

namespace evalbus::viz {
namespace {

constexpr int kMaxGeoms = 10000;
// A block of 2 x 2 pixels is made of 3 x 3 drawn ones, each weighted by the area that it shares with the
// pixel. In software that is both quicker than OpenGL's multisampling and better to look at: the edges of
// shadows and textures become smooth, too.
constexpr int kDrawn = 3, kShown = 2;

// One row of pixels from the drawn row that it covers wholly and the one that it covers half. kRed: where red
// stands in a pixel of so many bytes, green being in the middle.
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

// Rows from the top of what was drawn kDrawn : kShown as large. OpenGL's rows go upwards.
template <size_t kPixelBytes, size_t kRed>
void ShrinkAll(const std::vector<uint8_t>& drawn, FrameSize size, std::vector<uint8_t>* pixels) {
  static_assert(kDrawn == 3 && kShown == 2);
  const size_t width = static_cast<size_t>(size.width), height = static_cast<size_t>(size.height);
  const size_t row_bytes = width / 2 * 3 * 4;
  for (size_t row = 0; row < height; row += 2) {
    const uint8_t* bottom = &drawn[(height - 2 - row) / 2 * 3 * row_bytes];
    const uint8_t* middle = bottom + row_bytes;
    const uint8_t* top = middle + row_bytes;
    uint8_t* const pixel = &(*pixels)[row * width * kPixelBytes];
    Shrink<kPixelBytes, kRed>(top, middle, width, pixel);
    Shrink<kPixelBytes, kRed>(bottom, middle, width, pixel + width * kPixelBytes);
  }
}

// The same for what was drawn twice as large, which any size can be.
void HalveAll(const std::vector<uint8_t>& drawn, FrameSize size, std::vector<uint8_t>* rgb) {
  const size_t width = static_cast<size_t>(size.width), height = static_cast<size_t>(size.height);
  const size_t row_bytes = 2 * width * 4;
  for (size_t row = 0; row < height; ++row) {
    const uint8_t* below = &drawn[2 * (height - 1 - row) * row_bytes];
    const uint8_t* above = below + row_bytes;
    uint8_t* pixel = &(*rgb)[row * width * 3];
    for (size_t i = 0; i < width; ++i, below += 8, above += 8, pixel += 3) {
      for (size_t c = 0; c < 3; ++c) {
        pixel[c] = static_cast<uint8_t>((below[c] + below[c + 4] + above[c] + above[c + 4] + 2) / 4);
      }
    }
  }
}

}  // namespace

int FindCamera(const mjModel& model, const std::string& name) {
  const int camera = mj_name2id(&model, mjOBJ_CAMERA, name.c_str());
  if (camera >= 0) return camera;
  std::string names;
  for (int i = 0; i < model.ncam; ++i) {
    const char* known = mj_id2name(&model, mjOBJ_CAMERA, i);
    if (known) names += (names.empty() ? "" : ", ") + std::string(known);
  }
  throw InputError("no camera '" + name + "'; this scene has " + (names.empty() ? "none" : names));
}

struct Renderer::Gl {
  explicit Gl(const mjModel& model) : buffer{model.vis.global.offwidth, model.vis.global.offheight} {
    mjv_defaultScene(&scene);
    mjr_defaultContext(&context);
    mjv_defaultOption(&option);
    mjv_defaultCamera(&camera);
    camera.type = mjCAMERA_FIXED;
    read_pixels = FindGl<decltype(glReadPixels)>("glReadPixels");
    try {
      mjv_makeScene(&model, &scene, kMaxGeoms);
      {
        // It looks for OpenGL's functions each time, and keeps them where all threads find them.
        static std::mutex one_at_a_time;
        const std::lock_guard lock(one_at_a_time);
        mjr_makeContext(&model, &context, mjFONTSCALE_50);
      }
      mjr_setBuffer(mjFB_OFFSCREEN, &context);
      if (context.currentBuffer != mjFB_OFFSCREEN) {
        throw EnvironmentError("OpenGL offers no offscreen buffer of this size");
      }
      painter = std::make_unique<ScenePainter>(context);
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

  // Four bytes a pixel, as they are in the buffer.
  void ReadRgba() {
    rgba.resize(size_t(view.width) * size_t(view.height) * 4);
    read_pixels(0, 0, view.width, view.height, GL_RGBA, GL_UNSIGNED_BYTE, rgba.data());
  }
  void Free() {
    painter.reset();
    mjr_freeContext(&context);
    mjv_freeScene(&scene);
  }

  GlContext gl;
  mjvScene scene;
  mjrContext context;
  mjvOption option;
  mjvCamera camera;
  std::unique_ptr<ScenePainter> painter;
  decltype(glReadPixels)* read_pixels;
  FrameSize buffer;
  // The map of shadows is that of the state that is shown.
  bool has_shadows = false;
  // Of the picture that was drawn last.
  mjrRect view{};
  std::vector<uint8_t> rgba;
};

Renderer::Renderer(ModelPtr model, FrameSize size) : model_(std::move(model)), size_(size) {
  CheckFrameSize(size);
  InstallMujocoHandlers();
  model_->vis.global.offwidth = size.width / kShown * kDrawn;
  model_->vis.global.offheight = size.height / kShown * kDrawn;
  model_->vis.quality.offsamples = 0;
  data_.reset(mj_makeData(model_.get()));
  mj_kinematics(model_.get(), data_.get());
  gl_ = std::make_unique<Gl>(*model_);
}

Renderer::~Renderer() = default;

void Renderer::SetAppearance(const model_info_t& info, std::optional<int64_t> seed) {
  if (gl_) gl_->has_shadows = false;
  const TaskDescription task = ParseTask(info.task_yaml, info.task_file, false);
  const Variation& variation = task.variation(info.variation);
  if (unchanged_) mj_copyModel(model_.get(), unchanged_.get());
  if (!seed || variation.appearance.empty()) return;
  if (!unchanged_) unchanged_.reset(mj_copyModel(nullptr, model_.get()));
  RandomiseAppearance(variation, *seed, model_.get());
}

void Renderer::SetState(const state_t& state) {
  if (state.num_qpos != model_->nq) {
    throw InputError(
        fmt::format("STATE has {} coordinates, the visual model {}", state.num_qpos, model_->nq));
  }
  if (model_->nmocap > 0 && state.num_bodies != model_->nbody) {
    throw InputError(
        fmt::format("STATE has {} bodies, the visual model {}", state.num_bodies, model_->nbody));
  }
  if (gl_) gl_->has_shadows = false;
  std::copy(state.qpos_mixed.begin(), state.qpos_mixed.end(), data_->qpos);
  for (int body = 0; body < model_->nbody && model_->nmocap > 0; ++body) {
    const int mocap = model_->body_mocapid[body];
    if (mocap < 0) continue;
    const size_t i = static_cast<size_t>(body);
    mju_copy3(data_->mocap_pos + 3 * mocap, state.body[i].position_m);
    mju_copy4(data_->mocap_quat + 4 * mocap, state.body[i].quat_wxyz);
  }
  mj_kinematics(model_.get(), data_.get());
  mj_comPos(model_.get(), data_.get());  // lights and cameras that follow a subtree
  mj_camlight(model_.get(), data_.get());
}

CameraPose Renderer::PoseOf(int camera) const {
  CameraPose pose{};
  mju_copy3(pose.position_m, data_->cam_xpos + 3 * camera);
  mju_copy(pose.rotation, data_->cam_xmat + 9 * camera, 9);
  pose.fovy_deg = model_->cam_fovy[camera];
  return pose;
}

void Renderer::Draw(const Shot& shot, int width, int height, bool is_depth) {
  if (!gl_ || width > gl_->buffer.width || height > gl_->buffer.height) {
    auto& global = model_->vis.global;
    global.offwidth = gl_ ? std::max(width, gl_->buffer.width) : width;
    global.offheight = gl_ ? std::max(height, gl_->buffer.height) : height;
    gl_.reset();
    gl_ = std::make_unique<Gl>(*model_);
  }
  gl_->gl.MakeCurrent();
  gl_->camera.fixedcamid = shot.camera;
  gl_->scene.flags[mjRND_SHADOW] = shot.shadows && !is_depth;
  // Nothing but shapes: the sky would be as near as it is drawn.
  gl_->scene.flags[mjRND_SEGMENT] = is_depth;
  double& fovy = model_->cam_fovy[shot.camera];
  const double own_fovy = fovy;
  if (shot.fovy_deg > 0) fovy = shot.fovy_deg;
  mjv_updateScene(model_.get(), data_.get(), &gl_->option, nullptr, &gl_->camera, mjCAT_ALL, &gl_->scene);
  fovy = own_fovy;
  gl_->view = {0, 0, width, height};
  if (ScenePainter::Knows(gl_->scene, gl_->context)) {
    gl_->painter->Paint(gl_->view, gl_->scene, gl_->has_shadows);
    gl_->has_shadows |= gl_->scene.flags[mjRND_SHADOW] != 0;
  } else {
    mjr_render(gl_->view, &gl_->scene, &gl_->context);
    gl_->has_shadows = false;
  }
}

void Renderer::Render(int camera, Frame* frame) {
  Draw({camera, size_}, size_.width / kShown * kDrawn, size_.height / kShown * kDrawn);
  gl_->ReadRgba();
  ShrinkAll<4, 2>(gl_->rgba, size_, &frame->bgrx);
}

void Renderer::RenderRgb(const Shot& shot, std::vector<uint8_t>* rgb) {
  const auto [width, height] = shot.size;
  rgb->resize(size_t(width) * size_t(height) * 3);
  const bool is_even = width % kShown == 0 && height % kShown == 0;
  if (is_even) {
    Draw(shot, width / kShown * kDrawn, height / kShown * kDrawn);
    gl_->ReadRgba();
    ShrinkAll<3, 0>(gl_->rgba, shot.size, rgb);
  } else {
    Draw(shot, 2 * width, 2 * height);
    gl_->ReadRgba();
    HalveAll(gl_->rgba, shot.size, rgb);
  }
}

void Renderer::RenderDepth(const Shot& shot, std::vector<float>* depth_m) {
  const size_t width = static_cast<size_t>(shot.size.width), height = static_cast<size_t>(shot.size.height);
  depth_m->resize(width * height);
  Draw(shot, shot.size.width, shot.size.height, /*is_depth=*/true);
  mjr_readPixels(nullptr, depth_m->data(), gl_->view, &gl_->context);
  const double near = gl_->scene.camera[0].frustum_near, far = gl_->scene.camera[0].frustum_far;
  for (float& depth : *depth_m) depth = static_cast<float>(near / (1 - depth * (1 - near / far)));
  for (size_t row = 0; row < height / 2; ++row) {
    float* const upper = depth_m->data() + row * width;
    std::swap_ranges(upper, upper + width, depth_m->data() + (height - 1 - row) * width);
  }
}

}  // namespace evalbus::viz
