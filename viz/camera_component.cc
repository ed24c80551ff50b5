#include "viz/camera_component.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <string>
#include <utility>

#include "base/errors.h"
#include "bus/channels.h"
#include "bus/message.h"
#include "models/physics_model.h"
#include "viz/viz_component.h"

namespace evalbus::viz {
namespace {

constexpr char kColour[] = "rgb8", kDepth[] = "depth32";
constexpr int kMaxPixels = 2048;
// Pictures of one tick that are kept to be said again.
constexpr size_t kMaxViews = 32;
// Of the renderer's buffer before anybody has asked: most policies look at no more.
constexpr FrameSize kUsualSize{256, 256};

bool AreEqual(const header_t& a, const header_t& b) {
  return a.episode == b.episode && a.attempt == b.attempt && a.tick == b.tick &&
         a.sim_time_us == b.sim_time_us;
}

bool AreEqual(const view_t& a, const view_t& b) {
  return a.camera == b.camera && a.width_px == b.width_px && a.height_px == b.height_px &&
         a.fovy_deg == b.fovy_deg && a.shadows == b.shadows && a.encoding == b.encoding;
}

// Throws InputError for what cannot be drawn.
void Check(const view_t& view, const mjModel& model) {
  FindCamera(model, view.camera);
  const auto is_good = [](int pixels) { return pixels >= 1 && pixels <= kMaxPixels; };
  if (!is_good(view.width_px) || !is_good(view.height_px)) {
    throw InputError(fmt::format("a picture of {}x{}: expected 1 to {} pixels each way", view.width_px,
                                 view.height_px, kMaxPixels));
  }
  if (view.fovy_deg != 0 && !(view.fovy_deg >= 1 && view.fovy_deg <= 170)) {
    throw InputError(fmt::format(
        "a field of view of {}: expected 1 to 170 degrees, or 0 for the camera's own", view.fovy_deg));
  }
  if (view.encoding != kColour && view.encoding != kDepth) {
    throw InputError(fmt::format("encoding '{}': expected {} or {}", view.encoding, kColour, kDepth));
  }
}

}  // namespace

CameraComponent::CameraComponent(Bus* bus) : Component(bus, "cameras") {
  LoadOsMesa();
  bus->Subscribe(channels::kModel, [this](const model_info_t& m) { OnModel(m); });
  bus->Subscribe(channels::kEpisodeBegin, [this](const episode_begin_t& m) { OnEpisodeBegin(m); });
  bus->Subscribe(channels::kState, [this](const state_t& m) { OnState(m); });
  bus->Subscribe(channels::kObserve, [this](const observe_t& m) { OnObserve(m); });
}

void CameraComponent::OnModel(const model_info_t& model) {
  if (!IsNewModel(model)) return;
  model_ = model;
  model_is_new_ = true;  // for the next episode; this one goes on as it began
}

void CameraComponent::OnEpisodeBegin(const episode_begin_t& begin) {
  if (!IsOfOurRun(begin.session)) return;
  EnterEpisode(begin);
  // EPISODE_BEGIN is repeated, so an episode whose MODEL comes late is prepared then.
  if (status_.state != component_status_t::IDLE || !model_) return;
  if (std::exchange(model_is_new_, false)) {
    renderer_ = std::make_unique<Renderer>(LoadVisualModel(*model_), kUsualSize);
  }
  renderer_->SetAppearance(*model_, begin.seed);
  waiting_.reset();
  drawn_.clear();
  SayReady();
}

void CameraComponent::OnState(const state_t& state) {
  if (!IsOurs(state.header) || status_.state != component_status_t::READY) return;
  if (state.header.tick <= status_.last_tick) {
    ++status_.foreign_messages;
    return;
  }
  status_.missing_ticks += state.header.tick - status_.last_tick - 1;
  state_ = state;
  state_is_set_ = false;
  Progress(state.header);
  if (waiting_ && waiting_->header.tick <= state.header.tick) Answer(*std::exchange(waiting_, std::nullopt));
}

void CameraComponent::OnObserve(const observe_t& observe) {
  if (!IsOurs(observe.header) || status_.state != component_status_t::READY) return;
  try {
    if (observe.view.size() > kMaxViews) {
      throw InputError(fmt::format("{} views: expected {} at most", observe.view.size(), kMaxViews));
    }
    for (const view_t& view : observe.view) Check(view, renderer_->model());
  } catch (const InputError& error) {
    throw InputError(fmt::format("OBSERVE of tick {}: {}", observe.header.tick, error.what()));
  }
  if (observe.header.tick > status_.last_tick) {
    waiting_ = observe;
  } else {
    Answer(observe);
  }
}

void CameraComponent::Answer(const observe_t& observe) {
  for (const view_t& view : observe.view) {
    const image_t* image = Find(observe.header, view);
    if (!image) {
      ++status_.skipped_ticks;
      log().Warn("is asked for tick {} when tick {} has come: not answered", observe.header.tick,
                 status_.last_tick);
      return;
    }
    const std::string channel = ImageChannel(view.camera);
    bus().Publish(Channel<image_t>{channel.c_str(), status_.component}, *image);
  }
}

const image_t* CameraComponent::Find(const header_t& header, const view_t& view) {
  const auto known = std::ranges::find_if(drawn_, [&](const image_t& image) {
    return AreEqual(image.header, header) && AreEqual(image.view, view);
  });
  if (known != drawn_.end()) return &*known;
  if (!AreEqual(header, state_.header)) return nullptr;
  if (drawn_.size() == kMaxViews || (!drawn_.empty() && !AreEqual(drawn_[0].header, header))) drawn_.clear();
  drawn_.emplace_back();
  Draw(view, &drawn_.back());
  return &drawn_.back();
}

void CameraComponent::Draw(const view_t& view, image_t* image) {
  if (!std::exchange(state_is_set_, true)) renderer_->SetState(state_);
  image->header = state_.header;
  image->view = view;
  const Shot shot{FindCamera(renderer_->model(), view.camera),
                  {view.width_px, view.height_px},
                  view.fovy_deg,
                  view.shadows != 0};
  if (view.encoding == kColour) {
    renderer_->RenderRgb(shot, &image->data);
  } else {
    static_assert(std::endian::native == std::endian::little);
    renderer_->RenderDepth(shot, &depth_m_);
    image->data.resize(depth_m_.size() * sizeof(float));
    std::memcpy(image->data.data(), depth_m_.data(), image->data.size());
  }
  image->num_bytes = static_cast<int32_t>(image->data.size());
  ++num_drawn_;
}

}  // namespace evalbus::viz
