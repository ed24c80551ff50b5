// Draws a model off screen as its cameras see it, in software (OSMesa) or with EGL: gl_context.h. Needs no
// display.
//
// A renderer is one thread's at a time; several may draw in threads of their own. What is drawn depends on
// the model, the state and the shot alone.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "evalbus/model_info_t.hpp"
#include "evalbus/state_t.hpp"
#include "models/mujoco_ptr.h"
#include "viz/images/frame.h"
#include "viz/images/projection.h"

namespace evalbus::viz {

// Which camera images and videos are made with unless another is named. Every scene has it.
inline constexpr char kDefaultCamera[] = "overview";

// Throws InputError, with the names there are, for a camera that the model has not.
int FindCamera(const mjModel& model, const std::string& name);

// An image as a policy asks for it.
struct Shot {
  int camera;
  // 1 to 2048 pixels each way, odd ones, too.
  FrameSize size;
  // Vertical field of view; 0: the camera's own.
  double fovy_deg = 0;
  bool shadows = true;

  bool operator==(const Shot&) const = default;
};

class Renderer {
 public:
  // model: with visual geoms; light and shadows are those of its <visual>. Throws InputError for an odd or
  // absurd size, EnvironmentError if OpenGL is missing or refuses.
  Renderer(ModelPtr model, FrameSize size);
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  const mjModel& model() const { return *model_; }
  FrameSize size() const { return size_; }

  // From now on colors, lights and cameras are those of the episode with this seed of MODEL's variation;
  // without a seed, those of the model. Throws InputError for a task description that cannot be read.
  void SetAppearance(const model_info_t& info, std::optional<int64_t> seed);
  // What Render shows from now on. Bodies that physics does not move (mocap) are where the STATE's body poses
  // say, all others where its coordinates put them. Throws InputError if it is not this model's.
  void SetState(const state_t& state);
  void Render(int camera, Frame* frame);
  // Where it is at that STATE.
  CameraPose PoseOf(int camera) const;
  // Rows from the top; red, green and blue of each pixel, a byte each. The first image that is larger than
  // any before takes longer. Equal to what Render shows where size, field of view and shadows are.
  void RenderRgb(const Shot& shot, std::vector<uint8_t>* rgb);
  // Rows from the top: distance of what is seen in the middle of each pixel from the camera's plane, m. Where
  // there is nothing it is that of MuJoCo's far plane, zfar * extent of the model, as in MuJoCo's own
  // renderer for Python.
  void RenderDepth(const Shot& shot, std::vector<float>* depth_m);

 private:
  struct Gl;

  // OpenGL is there, with room for an image of this size where MuJoCo draws.
  void Prepare(FrameSize buffer);
  void UpdateScene(const Shot& shot, bool is_depth);
  // Into the lower left corner of MuJoCo's buffer, of this size.
  void DrawByMujoco(const Shot& shot, FrameSize size, bool is_depth);
  // Rows from the top, so many bytes a pixel, of which red is this one. Valid until the next image.
  template <size_t kPixelBytes, size_t kRed>
  const std::vector<uint8_t>& Draw(const Shot& shot);

  ModelPtr model_;
  // As it was, where an episode has changed it.
  ModelPtr unchanged_;
  FrameSize size_;
  DataPtr data_;
  std::unique_ptr<Gl> gl_;
};

}  // namespace evalbus::viz
