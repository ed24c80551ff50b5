// A policy behind a server. It sends the server the observations that the contract describes, and executes
// the returned action chunks with a receding horizon (actions/chunk_schedule.h).
#pragma once

#include <array>
#include <chrono>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "policy_bridge/actions/action_converter.h"
#include "policy_bridge/actions/chunk_schedule.h"
#include "policy_bridge/contract/contract.h"
#include "policy_bridge/interface/policy.h"
#include "policy_bridge/remote/chunk.h"
#include "policy_bridge/remote/conversation.h"
#include "policy_bridge/remote/latency.h"
#include "policy_bridge/remote/observation_builder.h"

namespace evalbus::policy {

// Throws InputError with the contract's file if `execution` requires that chunks be joined but this policy's
// chunks cannot be joined.
void CheckExecution(const Contract& contract, Execution execution);

class RemotePolicy : public Policy {
 public:
  // client: if null, a client for the contract's wire is created. Throws InputError if the contract does not
  // fit the robot or the run's control rate, or if its URL does not fit its wire.
  RemotePolicy(const Contract& contract, Latency latency, const mjModel& model, const model_info_t& info,
               std::unique_ptr<PolicyClient> client = nullptr);

  void Begin(const episode_begin_t& begin) override;
  void Act(const state_t& state, action_t* action) override;
  bool IsReady() override;
  bool Compute(const state_t& state) override;
  std::chrono::steady_clock::time_point compute_again_at() const override;
  const image_request_t* image_request() const override;
  void OnImage(const image_t& image) override;
  void SetCallbacks(const PolicyCallbacks& callbacks) override;

 private:
  using Clock = std::chrono::steady_clock;
  enum class Phase { kConnecting, kGreeting, kReady };

  void OnTick(const state_t& state);
  // Requests the images of the tick, unless an earlier tick is still being observed or inferred. Does nothing
  // if the tick has been observed already or need not be observed.
  void ObserveTick(const state_t& state);
  bool has_all_images() const;
  // Once the images of the requested tick have arrived, adds the tick to the observations and, if an
  // inference is due, starts a call to the server.
  void PollAnswer();
  void StartCall();
  Chunk ChunkOf(const Reply& reply);
  void OnAnswer(const Conversation::Answer& answer);
  // Returns the number of ticks that an inference is expected to take, as known when it begins.
  int64_t expected_delay() const;
  // Throws if an action of an absolute kind moves a joint by more than the contract's first_step_rad. Called
  // for the policy's first action.
  void CheckFirstStep(const state_t& state, const action_t& action);
  void Note(const std::string& text) const;

  const Contract contract_;
  const Latency latency_;
  const model_info_t info_;
  const double step_s_;
  const bool is_realtime_;
  // Contract::answer_window as wall-clock time.
  const Clock::duration answer_window_;
  ObservationBuilder observations_;
  ActionConverter converter_;
  Conversation conversation_;
  PolicyCallbacks callbacks_;

  // State of the connection.
  Phase phase_ = Phase::kConnecting;
  bool is_connected_ = false, has_compared_ = false, has_understood_ = false, is_answer_stale_ = false;
  std::optional<Clock::time_point> gone_since_, retry_at_;
  bool has_acted_ = false;

  // State of the episode.
  episode_begin_t begin_{};
  int64_t tick_ = -1;
  Clock::time_point tick_began_{};
  // Whether ObserveTick() has not handled this tick yet.
  bool is_tick_new_ = false;
  // The tick being observed, and the images of it that have been received so far.
  std::optional<image_request_t> image_request_;
  state_t observed_{};
  std::vector<std::optional<image_t>> images_;
  // Exception that PollAnswer() threw in OnImage(); rethrown by Compute().
  std::exception_ptr failure_;
  // True if the observation of that tick will be sent to the server.
  bool asks_ = false;
  // Header of the last observation that was sent.
  header_t asked_{};
  ChunkSchedule schedule_;
  // Rows of the last chunk with an even number and of the last chunk with an odd number. Both are needed
  // until the newer chunk is in use.
  std::array<std::vector<std::vector<double>>, 2> rows_;
  // Number of ticks that the last inference took.
  int64_t last_delay_ = 0;
  action_t last_{};
};

}  // namespace evalbus::policy
