// A policy behind a server: sends it the observations described by its contract, and executes its action
// chunks with a receding horizon (actions/chunk_schedule.h).
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

// Throws InputError, with the contract's file, if the policy's chunks cannot be joined as `execution`
// requires.
void CheckExecution(const Contract& contract, Execution execution);

class RemotePolicy : public Policy {
 public:
  // client: null: a client of the contract's wire. Throws InputError if the contract does not fit the robot
  // or the task's control rate, or its URL does not fit its wire.
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
  bool has_all_images() const;
  // Adds the requested tick to the observations once its images have arrived, and queries the server if
  // necessary.
  void PollAnswer();
  void StartCall();
  Chunk ChunkOf(const Reply& reply);
  void OnAnswer(const Conversation::Answer& answer);
  // Ticks that pass during an inference, as far as it is known when it begins.
  int64_t expected_delay() const;
  // Throws if the episode's first action, of a kind that sets an absolute position, is too far from the
  // robot's state.
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
  // The tick being observed, and its images received so far.
  std::optional<image_request_t> image_request_;
  state_t observed_{};
  std::vector<std::optional<image_t>> images_;
  // Exception of a Look() between two ticks; rethrown by Compute().
  std::exception_ptr failure_;
  // Whether the tick being observed is to be sent to the server.
  bool asks_ = false;
  // Header of the last observation that was sent.
  header_t asked_{};
  ChunkSchedule schedule_;
  // Rows of the chunks with even and with odd numbers. Two chunks are known at the same time while the newer
  // one has not arrived.
  std::array<std::vector<std::vector<double>>, 2> rows_;
  // Ticks that the last inference took.
  int64_t last_delay_ = 0;
  action_t last_{};
};

}  // namespace evalbus::policy
