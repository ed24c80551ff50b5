// Images on request: answers each REQUEST_IMAGE with one IMAGE_<camera> for each of its views, lossless and
// of exactly the STATE that it names. Nothing else is drawn.
//
// A REQUEST_IMAGE received before its STATE is held until the STATE arrives. A repeated REQUEST_IMAGE of the
// tick answered last returns the cached images. The last kKeptStates ticks can be requested; a REQUEST_IMAGE
// of an older one, which happens only on a realtime clock, is answered with images without data, counted in
// STATUS (skipped_ticks) and logged.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "bus/component.h"
#include "evalbus/image_request_t.hpp"
#include "evalbus/image_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "evalbus/state_t.hpp"
#include "viz/images/renderer.h"

namespace evalbus::viz {

class CameraComponent : public Component {
 public:
  static constexpr size_t kKeptStates = 64;

  // Throws EnvironmentError if OSMesa is missing. A REQUEST_IMAGE of our episode that asks for what cannot be
  // drawn (an unknown camera, a size beyond 2048 pixels, ...) is an InputError of Bus::Handle.
  explicit CameraComponent(Bus* bus);

  // Images, since the start.
  int64_t num_drawn() const { return num_drawn_; }

 private:
  void OnModel(const model_info_t& model);
  void OnEpisodeBegin(const episode_begin_t& begin);
  void OnState(const state_t& state);
  void OnImageRequest(const image_request_t& request);
  void Answer(const image_request_t& request);
  // The cached image, or one drawn now; null for a tick that is no longer kept.
  const image_t* Find(const header_t& header, const view_t& view);
  void Draw(const state_t& state, const view_t& view, image_t* image);

  std::optional<model_info_t> model_;
  bool model_is_new_ = false;
  // Of the model's scene; empty before the first episode.
  std::unique_ptr<Renderer> renderer_;
  // The newest ticks of this episode: that of tick k is at k modulo the size.
  std::array<state_t, kKeptStates> states_{};
  // Header of the state that the renderer shows; tick -1: none of this episode.
  header_t shown_{};
  // Waits for its STATE.
  std::optional<image_request_t> waiting_;
  // Of one tick.
  std::vector<image_t> drawn_;
  int64_t num_drawn_ = 0;
};

}  // namespace evalbus::viz
