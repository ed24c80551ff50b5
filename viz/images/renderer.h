// Renders the images of a model's cameras off screen, in software (OSMesa) or with EGL
// (painter/gl_context.h). Needs no display.
//
// A renderer may be used by only one thread at a time. Several renderers may draw concurrently in different
// threads. An image depends only on the model, its look and appearance, the state and the shot.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "evalbus/model_info_t.hpp"
#include "evalbus/state_t.hpp"
#include "models/mujoco_ptr.h"
#include "viz/images/frame.h"
#include "viz/images/painter/painter.h"
#include "viz/images/projection.h"

namespace evalbus::viz {

// Default camera of images and videos. Every scene has it.
inline constexpr char kDefaultCamera[] = "overview";

// Returns the camera's id. Throws InputError with the available names if the model does not have this camera.
int FindCamera(const mjModel& model, const std::string& name);

// An image as requested by a policy.
struct Shot {
  int camera;
  // Each side has 1 to 2048 pixels. Odd sizes are allowed.
  FrameSize size;
  // Vertical field of view, degrees. 0: the field of view of the camera in the model.
  double fovy_deg = 0;
  bool shadows = true;

  bool operator==(const Shot&) const = default;
};

class Renderer {
 public:
  // model: must have visual geoms; light and shadow settings are taken from its <visual>. look: must be
  // kPlain for a policy's images. outlined_bodies: for each body id, whether the opaque geoms of the body get
  // a white outline; must be empty for a policy's images. If it is not empty, rendering throws InputError if
  // ScenePainter cannot draw the scene. Throws InputError for an odd or out-of-range size, and
  // EnvironmentError if OpenGL is missing or fails.
  Renderer(ModelPtr model, FrameSize size, Look look = Look::kPlain, std::vector<bool> outlined_bodies = {});
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  const mjModel& model() const { return *model_; }
  FrameSize size() const { return size_; }

  // Sets the colors, lights and cameras that the task variation in MODEL draws for an episode with this seed.
  // Without a seed, restores those that the model defines. Throws InputError if the task description cannot
  // be parsed.
  void SetAppearance(const model_info_t& info, std::optional<int64_t> seed);
  // Sets the state that is rendered. The poses of mocap bodies are the body poses of STATE; the poses of
  // other bodies follow from its joint coordinates. Throws InputError if the state does not match the model.
  void SetState(const state_t& state);
  void Render(int camera, Frame* frame);
  // Returns the pose of the camera in the current state.
  CameraPose PoseOf(int camera) const;
  // Writes an image as rows from the top, with one byte each for red, green and blue. The first image of a
  // shot takes longer, because its buffers are created. Gives the same pixels as Render if size, field of
  // view and shadows are equal.
  void RenderRgb(const Shot& shot, std::vector<uint8_t>* rgb);
  // Writes a depth image as rows from the top. A value is the distance along the optical axis from the camera
  // plane to the surface at the center of the pixel, m. Where no surface is visible, the value is the
  // distance of MuJoCo's far plane (zfar * extent of the model), as in MuJoCo's Python renderer.
  void RenderDepth(const Shot& shot, std::vector<float>* depth_m);

 private:
  struct Gl;

  // Creates the OpenGL context if necessary and enlarges MuJoCo's buffer to at least this size.
  void Prepare(FrameSize buffer);
  void UpdateScene(const Shot& shot, bool is_depth);
  // Updates the scene and returns the painter that draws it. If this is MujocoPainter, first enlarges
  // MuJoCo's buffer to at least this size.
  Painter* PrepareToDraw(const Shot& shot, FrameSize size);
  // Returns rows from the top with kPixelBytes bytes per pixel. kRed: index of the red byte. The result is
  // valid until the next image is drawn.
  template <size_t kPixelBytes, size_t kRed>
  const std::vector<uint8_t>& Draw(const Shot& shot);

  ModelPtr model_;
  // The original model. Null unless the appearance of an episode has been applied to model_.
  ModelPtr unchanged_;
  FrameSize size_;
  // Result of MujocoPaints() at construction. Later changes of the environment have no effect.
  bool mujoco_paints_;
  Look look_;
  std::vector<bool> outlined_bodies_;
  DataPtr data_;
  std::unique_ptr<Gl> gl_;
};

}  // namespace evalbus::viz
