// Pictures that a policy asks for: answers each OBSERVE with one IMAGE_<camera> for each of its views,
// lossless and of exactly the STATE that it names. Nothing is drawn that nobody asked for.
//
// An OBSERVE that comes before its STATE waits for it. One of the tick last answered is answered again from
// what was drawn. One of a tick that is gone is not answered: counted in STATUS (skipped_ticks) and told in
// the log.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "bus/component.h"
#include "evalbus/image_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "evalbus/observe_t.hpp"
#include "evalbus/state_t.hpp"
#include "viz/pictures/renderer.h"

namespace evalbus::viz {

class CameraComponent : public Component {
 public:
  // Throws EnvironmentError if OSMesa is missing. An OBSERVE of our episode that asks for what cannot be
  // drawn (an unknown camera, a size beyond 2048 pixels, ...) is an InputError of Bus::Handle.
  explicit CameraComponent(Bus* bus);

  // Pictures, since the start.
  int64_t num_drawn() const { return num_drawn_; }

 private:
  void OnModel(const model_info_t& model);
  void OnEpisodeBegin(const episode_begin_t& begin);
  void OnState(const state_t& state);
  void OnObserve(const observe_t& observe);
  void Answer(const observe_t& observe);
  // As it was drawn, if it was; nothing for a tick that is gone.
  const image_t* Find(const header_t& header, const view_t& view);
  void Draw(const view_t& view, image_t* image);

  std::optional<model_info_t> model_;
  bool model_is_new_ = false;
  // Of the model's scene; empty before the first episode.
  std::unique_ptr<Renderer> renderer_;
  // The newest of this episode, and whether the renderer has it.
  state_t state_{};
  bool state_is_set_ = false;
  // Waits for its STATE.
  std::optional<observe_t> waiting_;
  // Of one tick.
  std::vector<image_t> drawn_;
  int64_t num_drawn_ = 0;
};

}  // namespace evalbus::viz
