#include "runner/environment.h"

#include <fmt/format.h>

#include <utility>

#include "base/errors.h"
#include "base/random.h"
#include "base/run_layout.h"
#include "bus/channels.h"
#include "collision/collision_component.h"
#include "lcmtypes/end_reason.h"
#include "metrics/episode/result_json.h"
#include "metrics/metrics_component.h"
#include "models/task_family.h"
#include "policy_bridge/policy_component.h"
#include "policy_bridge/remote/remote_policy.h"
#include "results/episode_json.h"
#include "sim/sim_component.h"
#include "viz/camera_component.h"
#include "viz/images/renderer.h"

namespace evalbus::runner {

// Keeps the latest messages about the current episode.
class Environment::Observer : public Component {
 public:
  explicit Observer(Bus* bus) : Component(bus, "environment") {
    bus->Subscribe(channels::kEpisodeBegin, [this](const episode_begin_t& m) {
      if (m.header.attempt == attempt_ && EnterEpisode(m)) begin_ = m;
    });
    bus->Subscribe(channels::kPartial, [this](const partial_metrics_t& m) { Keep(m, &partial_); });
    bus->Subscribe(channels::kEpisodeEnd, [this](const episode_end_t& m) { Keep(m, &end_); });
    bus->Subscribe(channels::kEpisodeSummary, [this](const episode_summary_t& m) { Keep(m, &summary_); });
  }

  void Expect(int attempt) {
    attempt_ = attempt;
    partial_.reset();
    end_.reset();
    summary_.reset();
  }
  const episode_begin_t& begin() const { return begin_; }
  const std::optional<partial_metrics_t>& partial() const { return partial_; }
  const std::optional<episode_end_t>& end() const { return end_; }
  const std::optional<episode_summary_t>& summary() const { return summary_; }
  bool has_scored(int64_t tick) const { return partial_ && partial_->header.tick >= tick; }

 private:
  template <class Message>
  void Keep(const Message& message, std::optional<Message>* kept) {
    if (message.header.attempt == attempt_) *kept = message;
  }

  int attempt_ = 0;
  episode_begin_t begin_{};
  std::optional<partial_metrics_t> partial_;
  std::optional<episode_end_t> end_;
  std::optional<episode_summary_t> summary_;
};

namespace {

template <class Message>
nlohmann::ordered_json ScoresOf(const Message& message) {
  return {{"metrics", metrics::ResultJson(message.metrics)},
          {"extended", metrics::ExtendedJson(message.extended, message.metrics)}};
}

policy::Contract ContractOf(const EnvironmentOptions& options, const model_info_t& model) {
  policy::Contract contract = options.contract.empty()
                                  ? MakeContract(options.form, options.sim.control_hz, model)
                                  : policy::FindContract(options.contract);
  contract.execute_steps = 1;
  contract.chunk_steps.reset();
  // The limit on the first action is removed, because a caller that explores may begin with any action.
  contract.first_step_rad.reset();
  return contract;
}

}  // namespace

Environment::Environment(EnvironmentOptions options) : sim_(std::move(options.sim)) {
  sim_.out = folder_.path();
  // The sim waits as long as possible for an action, because the caller decides when it acts.
  sim_.policy_timeout_s = sim::kLongestTimeout;
  if (!options.contract.empty()) sim_.control_hz = policy::FindContract(options.contract).rate_hz;
  options.sim = sim_;
  {
    const sim::PreparedScene scene = sim::ComposeScene(sim_);
    model_ = scene.info;
    contract_ = ContractOf(options, model_);
    for (const policy::ObservationEntry& entry : contract_.observation) {
      if (entry.is_image()) viz::FindCamera(*scene.scene.visual, entry.image.view.camera);
    }
    changed_rate_ = sim::MakeControlRateReal(model_.timestep_us, &sim_);
    sim::WriteModels(scene, folder_.path());
    sim_.physics_sha256 = model_.physics_sha256;
    sim_.visual_sha256 = model_.visual_sha256;
    sim_.scene_warnings = scene.scene.warnings;
  }
  Log::SetFiles(
      [folder = folder_.path()](const std::string& component) { return LogFile(folder, component); });
  const auto add = [this](std::unique_ptr<Component> component) {
    if (component->status().component != "sim") required_.push_back(component->status().component);
    loop_.Add(std::move(component));
  };
  add(std::make_unique<collision::CollisionComponent>(&bus_, false));
  add(std::make_unique<metrics::MetricsComponent>(&bus_, false));
  if (contract_.needs_images()) add(std::make_unique<viz::CameraComponent>(&bus_, options.gl));
  add(std::make_unique<policy::PolicyComponent>(
      &bus_, "environment", [this](const mjModel& model, const model_info_t& info) {
        const auto wake = [event = bus_.wake_event()] { event->Set(); };
        return std::make_unique<policy::RemotePolicy>(contract_, policy::Latency(), model, info,
                                                      exchange_.MakeClient(wake));
      }));
  add(std::make_unique<sim::SimComponent>(&bus_, sim_));
  observer_ = std::make_unique<Observer>(&bus_);
}

Environment::~Environment() = default;

void Environment::Advance() {
  loop_.Advance([this](SteadyTime now) { observer_->Poll(now); });
}

Environment::Step Environment::Reset(int64_t seed, int episode) {
  exchange_.Abandon();
  while (is_active_ && !observer_->end()) Advance();
  is_active_ = false;
  tick_ = -1;
  observer_->Expect(++attempt_);
  sim::CheckSeeds(sim_.seed_stream, seed, episode + 1);
  command_t command{};
  command.kind = command_t::START_EPISODE;
  command.episode = episode;
  command.attempt = attempt_;
  command.seed =
      SeedSource{seed, sim_.seed_stream, FamilyOf(model_.task), model_.variation}.OfEpisode(episode);
  command.required_component = required_;
  command.num_required = static_cast<int32_t>(required_.size());
  command.required_instance.assign(required_.size(), 0);
  bus_.Publish(channels::kCommand, command);
  is_active_ = true;
  return WaitForTick(contract_.settle_steps);
}

Environment::Step Environment::Act(const policy::Array& action) {
  if (!is_active_) throw InputError("no episode is active: reset the environment first");
  const auto count = policy::ItemCount(action.shape);
  if (count != static_cast<size_t>(contract_.actions.num_values)) {
    throw InputError(fmt::format("the action has {} values, expected {}", count.value_or(0),
                                 contract_.actions.num_values));
  }
  policy::Array row = action;
  row.shape = {1, contract_.actions.num_values};
  exchange_.Answer(std::move(row));
  return WaitForTick(tick_ + 1);
}

bool Environment::IsFinal() const {
  if (!observer_->end() || !observer_->summary()) return false;
  // The last tick has no observation if the episode ended while the robot settled. It has none, either, if
  // the physics or the action stopped the sim, which then publishes no further STATE.
  const int64_t last = observer_->end()->header.tick;
  return exchange_.is_waiting() || last <= tick_ || last < contract_.settle_steps;
}

Environment::Step Environment::WaitForTick(int64_t tick) {
  while (!IsFinal()) {
    Advance();
    if (observer_->end() && observer_->end()->end_reason == end_reason::kAborted)
      throw EnvironmentError("the episode was aborted: " + observer_->end()->detail);
    if (!exchange_.is_waiting() || !observer_->has_scored(tick)) continue;
    // If the tick ends the episode, EPISODE_END is already among the waiting messages.
    while (!observer_->end() && bus_.Handle()) {
    }
    if (!observer_->end()) break;
  }
  Step step;
  if (auto observation = exchange_.TakeObservation()) observation_ = *std::move(observation);
  step.observation = observation_;
  tick_ = tick;
  if (!observer_->end()) {
    step.scores = ScoresOf(*observer_->partial());
    return step;
  }
  is_active_ = false;
  const episode_summary_t& summary = *observer_->summary();
  step.scores = ScoresOf(summary);
  step.episode = results::EpisodeJson(model_.task, model_.variation, summary, &observer_->begin());
  return step;
}

}  // namespace evalbus::runner
