#include "viz/camera_component.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "base/errors.h"
#include "bus/channels.h"
#include "bus/message.h"
#include "lcmtypes/message_equality.h"
#include "models/physics_model.h"
#include "viz/images/painter/gl_context.h"
#include "viz/images/view_image.h"
#include "viz/viz_component.h"

namespace evalbus::viz {
namespace {

// Number of images of one tick that are cached for repeated requests.
constexpr size_t kMaxViews = 32;

}  // namespace

CameraComponent::CameraComponent(Bus* bus, const std::string& gl) : Component(bus, "cameras") {
  UseGl(gl);
  bus->Subscribe(channels::kModel, [this](const model_info_t& m) { OnModel(m); });
  bus->Subscribe(channels::kEpisodeBegin, [this](const episode_begin_t& m) { OnEpisodeBegin(m); });
  bus->Subscribe(channels::kState, [this](const state_t& m) { OnState(m); });
  bus->Subscribe(channels::kRequestImage, [this](const image_request_t& m) { OnImageRequest(m); });
}

void CameraComponent::OnModel(const model_info_t& model) {
  if (!IsNewModel()) return;
  model_ = model;
  model_is_new_ = true;  // used for the next and later episodes; the current episode keeps its model
}

void CameraComponent::OnEpisodeBegin(const episode_begin_t& begin) {
  EnterEpisode(begin);
  // EPISODE_BEGIN is repeated. If MODEL arrives late, a later repetition prepares the episode.
  if (status_.state != component_status_t::IDLE || !model_) return;
  if (std::exchange(model_is_new_, false)) {
    renderer_ = std::make_unique<Renderer>(LoadVisualModel(*model_), kUsualViewSize);
  }
  renderer_->SetAppearance(*model_, begin.seed);
  for (state_t& state : states_) state.header.tick = -1;
  shown_.tick = -1;
  waiting_.reset();
  drawn_.clear();
  PublishReady();
}

void CameraComponent::OnState(const state_t& state) {
  if (!IsOurs(state.header) || status_.state != component_status_t::READY) return;
  if (state.header.tick <= status_.last_tick) {
    ++status_.foreign_messages;
    return;
  }
  status_.missing_ticks += state.header.tick - status_.last_tick - 1;
  states_[static_cast<size_t>(state.header.tick) % kKeptStates] = state;
  Progress(state.header);
  if (waiting_ && waiting_->header.tick <= state.header.tick) Answer(*std::exchange(waiting_, std::nullopt));
}

void CameraComponent::OnImageRequest(const image_request_t& request) {
  if (!IsOurs(request.header) || status_.state != component_status_t::READY) return;
  try {
    if (request.view.size() > kMaxViews) {
      throw InputError(fmt::format("{} views: expected at most {}", request.view.size(), kMaxViews));
    }
    for (const view_t& view : request.view) CheckView(view, renderer_->model());
  } catch (const InputError& error) {
    throw InputError(fmt::format("REQUEST_IMAGE of tick {}: {}", request.header.tick, error.what()));
  }
  if (request.header.tick > status_.last_tick) {
    waiting_ = request;
  } else {
    Answer(request);
  }
}

void CameraComponent::Answer(const image_request_t& request) {
  for (const view_t& view : request.view) {
    const image_t* image = Find(request.header, view);
    image_t gone{};
    if (!image) {
      gone.header = request.header;
      gone.view = view;
    }
    const std::string channel = channels::ImageChannel(view.camera);
    bus().Publish(Channel<image_t>{channel.c_str(), status_.component}, image ? *image : gone);
    if (image) continue;
    ++status_.skipped_ticks;
    log().Warn("a REQUEST_IMAGE for tick {} arrived at tick {}, too late for its images", request.header.tick,
               status_.last_tick);
    return;
  }
}

const image_t* CameraComponent::Find(const header_t& header, const view_t& view) {
  const auto known = std::ranges::find_if(drawn_, [&](const image_t& image) {
    return SameTick(image.header, header) && SameView(image.view, view);
  });
  if (known != drawn_.end()) return &*known;
  const state_t& state = states_[static_cast<size_t>(header.tick) % kKeptStates];
  if (!SameTick(header, state.header)) return nullptr;
  if (drawn_.size() == kMaxViews || (!drawn_.empty() && !SameTick(drawn_[0].header, header))) drawn_.clear();
  drawn_.emplace_back();
  Draw(state, view, &drawn_.back());
  return &drawn_.back();
}

void CameraComponent::Draw(const state_t& state, const view_t& view, image_t* image) {
  if (!SameTick(shown_, state.header)) renderer_->SetState(state);
  shown_ = state.header;
  DrawView(view, state.header, renderer_.get(), image);
  ++num_drawn_;
}

}  // namespace evalbus::viz
