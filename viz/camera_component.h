// Answers each REQUEST_IMAGE with one IMAGE_<camera> per requested view. Images are lossless and show exactly
// the STATE that the request names. No other images are rendered.
//
// A REQUEST_IMAGE received before its STATE is held until the STATE arrives. If a REQUEST_IMAGE of the last
// answered tick is repeated, the cached images are published again. The last kKeptStates ticks can be
// requested. A REQUEST_IMAGE of an older tick, which happens only with a real-time clock, is answered with an
// image without data, counted in STATUS (skipped_ticks) and logged.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bus/component.h"
#include "evalbus/image_request_t.hpp"
#include "evalbus/image_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "evalbus/state_t.hpp"
#include "viz/images/painter/gl_context.h"
#include "viz/images/renderer.h"

namespace evalbus::viz {

class CameraComponent : public Component {
 public:
  static constexpr size_t kKeptStates = 64;

  // gl: see UseGl. Throws EnvironmentError if the selected library is missing. If a REQUEST_IMAGE of this
  // episode cannot be rendered (e.g. unknown camera, more than 2048 pixels per side), Bus::Handle throws
  // InputError.
  explicit CameraComponent(Bus* bus, const std::string& gl = kDefaultGl);

  // Returns the number of images that this component has rendered.
  int64_t num_drawn() const { return num_drawn_; }

 private:
  void OnModel(const model_info_t& model);
  void OnEpisodeBegin(const episode_begin_t& begin);
  void OnState(const state_t& state);
  void OnImageRequest(const image_request_t& request);
  void Answer(const image_request_t& request);
  // Returns the cached image, or renders it. Returns null if the tick is no longer kept.
  const image_t* Find(const header_t& header, const view_t& view);
  void Draw(const state_t& state, const view_t& view, image_t* image);

  std::optional<model_info_t> model_;
  bool model_is_new_ = false;
  // Renderer of the model's scene; null before the first episode.
  std::unique_ptr<Renderer> renderer_;
  // Ring buffer of the newest states of this episode. Tick k is at index k modulo the size.
  std::array<state_t, kKeptStates> states_{};
  // Header of the STATE that the renderer shows. Its tick is -1 if the renderer shows no STATE of this
  // episode.
  header_t shown_{};
  // A request that waits for its STATE.
  std::optional<image_request_t> waiting_;
  // Cached images of one tick.
  std::vector<image_t> drawn_;
  int64_t num_drawn_ = 0;
};

}  // namespace evalbus::viz
