// Live images: draws the newest STATE of a run or a replay as its cameras see it, with the scores of
// PARTIAL, and publishes JPEG frames on EVALBUS_IMAGE_<camera>.
//
// It may begin to listen at any time: MODEL is repeated while an episode runs. Nobody waits for it: ticks
// that come faster than it draws are passed over and counted in STATUS (skipped_ticks).
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
  // At most so many frames per second of wall time, from each camera.
  double fps = 15;
  // Whose run it is, written into the image; empty where that is not known.
  std::string policy{};
};

class VizComponent : public Component {
 public:
  // Throws InputError for options that cannot be, EnvironmentError if OSMesa is missing. A camera that the
  // scene has not is an InputError of Bus::Handle when the first MODEL comes.
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
  // The word that tables have for how the episode came out.
  void OnSummary(const episode_summary_t& summary);
  // Enters the episode; seed: where it is known.
  void Enter(const episode_begin_t& begin, std::optional<int64_t> seed);
  // Writes into the images what MODEL says.
  void Describe();
  void Draw();

  VizOptions options_;
  Overlay overlay_;
  Frame frame_;
  JpegEncoder jpeg_;

  std::optional<model_info_t> model_;
  // Of the episode, where its begin was heard.
  std::optional<int64_t> seed_;
  // Of the model's scene; empty before MODEL.
  std::unique_ptr<Renderer> renderer_;
  std::vector<View> views_;

  OverlayText text_;
  state_t state_{};
  int64_t newest_tick_ = -1;  // of this episode
  bool undrawn_ = false;      // something has changed since the last frame
  bool passing_ = false;      // the newest tick is in no frame
  SteadyTime next_frame_{};
};

}  // namespace evalbus::viz
