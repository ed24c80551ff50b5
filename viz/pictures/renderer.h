// Draws a model off screen, in software (OSMesa), as its cameras see it. Needs no display and no GPU.
#pragma once

#include <memory>
#include <string>

#include "evalbus/state_t.hpp"
#include "models/mujoco_ptr.h"
#include "viz/pictures/frame.h"

namespace evalbus::viz {

// Throws InputError, with the names there are, for a camera that the model has not.
int FindCamera(const mjModel& model, const std::string& name);

// Throws EnvironmentError if OSMesa is missing. A Renderer does so itself; this is for those who want to know
// before they have a model.
void LoadOsMesa();

class Renderer {
 public:
  // model: with visual geoms; light and shadows are those of its <visual>. Throws InputError for an odd or
  // absurd size, EnvironmentError if OSMesa is missing or refuses.
  Renderer(ModelPtr model, FrameSize size);
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  const mjModel& model() const { return *model_; }
  FrameSize size() const { return size_; }

  // What Render shows from now on. Bodies that physics does not move (mocap) are where the STATE's body poses
  // say, all others where its coordinates put them. Throws InputError if it is not this model's.
  void SetState(const state_t& state);
  void Render(int camera, Frame* frame);

 private:
  struct Gl;

  ModelPtr model_;
  FrameSize size_;
  DataPtr data_;
  std::unique_ptr<Gl> gl_;
};

}  // namespace evalbus::viz
