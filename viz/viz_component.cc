#include "viz/viz_component.h"

#include <fmt/format.h>

#include <cmath>

#include "base/errors.h"
#include "bus/channels.h"
#include "bus/message.h"
#include "lcmtypes/clock.h"
#include "lcmtypes/end_reason.h"
#include "models/physics_model.h"
#include "viz/images/video_timing.h"

namespace evalbus::viz {

VizComponent::VizComponent(Bus* bus, const VizOptions& options)
    : Component(bus, "viz"), options_(options), overlay_(options.size), frame_(options.size) {
  CheckFrameSize(options.size);
  if (!(options.fps > 0) || std::isinf(options.fps))
    throw InputError(fmt::format("--fps: expected a number above 0, got {}", options.fps));
  bus->Subscribe(channels::kModel, [this](const model_info_t& m) { OnModel(m); });
  bus->Subscribe(channels::kEpisodeBegin, [this](const episode_begin_t& m) { OnEpisodeBegin(m); });
  bus->Subscribe(channels::kState, [this](const state_t& m) { OnState(m); });
  bus->Subscribe(channels::kPartial, [this](const partial_metrics_t& m) { OnPartial(m); });
  bus->Subscribe(channels::kEpisodeEnd, [this](const episode_end_t& m) { OnEpisodeEnd(m); });
  bus->Subscribe(channels::kEpisodeSummary, [this](const episode_summary_t& m) { OnSummary(m); });
  bus->SetMaxBatchDelay(std::chrono::milliseconds(10));
}

void VizComponent::OnModel(const model_info_t& model) {
  try {
    Show(model);
  } catch (const InputError& error) {
    // Any process can publish MODEL. A MODEL that cannot be drawn must not end the display of the current
    // run.
    if (!renderer_) throw;
    ++status_.foreign_messages;
    log().Warn("ignoring a MODEL: {}", error.what());
  }
}

void VizComponent::Show(const model_info_t& model) {
  CheckMessageVersion(model);
  if (!model_ || model.visual_sha256 != model_->visual_sha256) {
    auto renderer = std::make_unique<Renderer>(LoadVisualModel(model), options_.size);
    std::vector<View> views;
    for (const std::string& camera : options_.cameras) {
      View view{FindCamera(renderer->model(), camera), channels::ImageChannel(camera), {}};
      view.image.view.camera = camera;
      view.image.view.width_px = options_.size.width;
      view.image.view.height_px = options_.size.height;
      view.image.view.encoding = "jpeg";
      views.push_back(std::move(view));
    }
    renderer->SetAppearance(model, seed_);
    renderer_ = std::move(renderer);
    views_ = std::move(views);
  } else if (model.task_yaml != model_->task_yaml || model.variation != model_->variation) {
    renderer_->SetAppearance(model, seed_);
  }
  model_ = model;
  Describe();
}

void VizComponent::OnEpisodeBegin(const episode_begin_t& begin) {
  // EPISODE_BEGIN is repeated only before tick 0. A later EPISODE_BEGIN begins a new episode, e.g. in a
  // replay of the same run.
  if (newest_tick_ >= 0) status_.attempt = -1;
  Enter(begin, begin.seed);
}

void VizComponent::Describe() {
  if (!model_) return;
  text_.title = model_->task + "/" + model_->variation;
  text_.maker = MakerText(options_.policy, model_->robot);
}

void VizComponent::Enter(const episode_begin_t& begin, std::optional<int64_t> seed) {
  if (!EnterEpisode(begin)) return;
  status_.skipped_ticks += passing_;
  newest_tick_ = -1;
  undrawn_ = passing_ = false;
  text_ = {};
  Describe();
  text_.subtitle = EpisodeSubtitle(begin.header.episode);
  seed_ = seed;
  if (renderer_) renderer_->SetAppearance(*model_, seed);
  PublishReady();
}

void VizComponent::OnState(const state_t& state) {
  if (!IsPlausible(state.header)) {
    ++status_.foreign_messages;
    return;
  }
  // If no EPISODE_BEGIN was received for this episode, this process started during the episode.
  if (state.header.episode != status_.episode) {
    episode_begin_t begin{};
    begin.header = state.header;
    Enter(begin, std::nullopt);
    newest_tick_ = state.header.tick - 1;
  }
  if (state.header.tick <= newest_tick_) {
    ++status_.foreign_messages;
    return;
  }
  status_.missing_ticks += state.header.tick - newest_tick_ - 1;
  status_.skipped_ticks += passing_;
  newest_tick_ = state.header.tick;
  state_ = state;
  undrawn_ = passing_ = true;
}

void VizComponent::OnPartial(const partial_metrics_t& partial) {
  if (partial.header.episode == status_.episode) AddScores(partial.metrics, &text_);
}

void VizComponent::OnEpisodeEnd(const episode_end_t& end) {
  if (end.header.episode != status_.episode || newest_tick_ < 0) return;
  if (!text_.end_reason.empty()) return;  // EPISODE_END is repeated, or the outcome is already known
  text_.end_reason = end_reason::Text(end.end_reason);
  undrawn_ = true;
}

void VizComponent::OnSummary(const episode_summary_t& summary) {
  if (summary.header.episode != status_.episode || newest_tick_ < 0) return;
  const std::string outcome = end_reason::Outcome(summary.failure_reason);
  if (text_.end_reason == outcome) return;
  text_.end_reason = outcome;
  undrawn_ = true;
}

void VizComponent::Poll(SteadyTime now) {
  Component::Poll(now);
  if (now < next_poll()) return;
  // Handles all messages that arrived while the last frame was drawn, so that only the newest state is shown.
  while (bus().Handle()) {
  }
  if (undrawn_) Draw();
  next_frame_ =
      now + std::chrono::duration_cast<SteadyTime::duration>(std::chrono::duration<double>(1 / options_.fps));
}

SteadyTime VizComponent::next_poll() const { return renderer_ && undrawn_ ? next_frame_ : SteadyTime::max(); }

void VizComponent::Draw() {
  undrawn_ = passing_ = false;
  text_.clock = ClockText({Seconds(state_.header.sim_time_us), 1});
  renderer_->SetState(state_);
  for (View& view : views_) {
    renderer_->Render(view.camera, &frame_);
    overlay_.Draw(text_, &frame_);
    view.image.header = state_.header;
    view.image.data = jpeg_.Encode(frame_);
    view.image.num_bytes = static_cast<int32_t>(view.image.data.size());
    bus().Publish(Channel<image_t>{view.channel.c_str(), channels::kImage.from}, view.image);
  }
  Progress(state_.header);
}

}  // namespace evalbus::viz
