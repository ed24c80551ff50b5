// Live images: draws the newest STATE of a run or replay, with the scores of PARTIAL, and publishes JPEG
// frames on EVALBUS_IMAGE_<camera>.
//
// The component may start at any time, because MODEL is repeated while an episode is running. No other
// component waits for it. If ticks arrive faster than it draws, it skips some and counts them in STATUS
// (skipped_ticks).
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bus/component.h"
#include "evalbus/episode_end_t.hpp"
#include "evalbus/episode_summary_t.hpp"
#include "evalbus/image_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "evalbus/partial_metrics_t.hpp"
#include "evalbus/state_t.hpp"
#include "viz/images/frame.h"
#include "viz/images/jpeg.h"
#include "viz/images/overlay.h"
#include "viz/images/renderer.h"

namespace evalbus::viz {

struct VizOptions {
  std::vector<std::string> cameras = {kDefaultCamera};
  FrameSize size;
  // Maximum number of frames per second of wall time, per camera.
  double fps = 15;
  // Policy name, written into the image; empty if unknown.
  std::string policy{};
};

class VizComponent : public Component {
 public:
  // Throws InputError for invalid options, and EnvironmentError if the font is missing. When the first MODEL
  // arrives, Bus::Handle throws InputError if the scene lacks a camera, and EnvironmentError if OpenGL is
  // missing.
  VizComponent(Bus* bus, const VizOptions& options);

  void Poll(SteadyTime now) override;
  SteadyTime next_poll() const override;

 private:
  struct View {
    int camera;
    std::string channel;
    image_t image;
  };

  void OnModel(const model_info_t& model);
  void Show(const model_info_t& model);
  void OnEpisodeBegin(const episode_begin_t& begin);
  void OnState(const state_t& state);
  void OnPartial(const partial_metrics_t& partial);
  void OnEpisodeEnd(const episode_end_t& end);
  // Replaces the end reason in the overlay by the outcome.
  void OnSummary(const episode_summary_t& summary);
  // Begins to show an episode. seed: the episode's seed, if it is known.
  void Enter(const episode_begin_t& begin, std::optional<int64_t> seed);
  // Updates the overlay text from MODEL.
  void Describe();
  void Draw();

  VizOptions options_;
  Overlay overlay_;
  Frame frame_;
  JpegEncoder jpeg_;

  std::optional<model_info_t> model_;
  // Seed of the episode, if its EPISODE_BEGIN was received.
  std::optional<int64_t> seed_;
  // Renderer of the model's scene; null before MODEL.
  std::unique_ptr<Renderer> renderer_;
  std::vector<View> views_;

  OverlayText text_;
  state_t state_{};
  int64_t newest_tick_ = -1;  // newest tick received in this episode
  bool undrawn_ = false;      // whether anything has changed since the last frame
  bool passing_ = false;      // whether the newest tick has not been drawn yet
  SteadyTime next_frame_{};
};

}  // namespace evalbus::viz
