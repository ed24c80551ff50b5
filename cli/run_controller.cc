#include "cli/run_controller.h"

#include <cmath>

#include "bus/channels.h"
#include "bus/errors.h"
#include "metrics/result_json.h"
#include "sim/episode_seed.h"

namespace evalbus {
namespace {

constexpr auto kRepeatCommand = std::chrono::milliseconds(500);
constexpr auto kRecorderTimeout = std::chrono::seconds(10);

}  // namespace

RunController::RunController(Bus* bus, const RunPlan& plan, const RunFolder& folder, RunListener* listener)
    : Component(bus, "run"), plan_(plan), folder_(folder), listener_(listener), summary_(Summarize({})) {
  bus->Subscribe<episode_begin_t>(channels::kEpisodeBegin, [this](const episode_begin_t& begin) {
    if (begin.header.episode != next_ || begin.attempt != attempt_) return;
    if (EnterEpisode(begin)) {
      begun_ = true;
      SayReady();
      listener_->OnEpisodeBegin(begin);
    }
  });
  bus->Subscribe<partial_metrics_t>(channels::kPartial, [this](const partial_metrics_t& partial) {
    if (begun_ && IsOurs(partial.header)) listener_->OnPartial(partial);
  });
  bus->Subscribe<episode_summary_t>(channels::kEpisodeSummary,
                                    [this](const episode_summary_t& summary) { OnSummary(summary); });
  bus->Subscribe<component_status_t>(channels::kStatus, [this](const component_status_t& status) {
    if (status.component == "recorder" && status.attempt == attempt_ &&
        status.last_finished_episode == next_) {
      recorded_ = true;
      FinishIfRecorded();
    }
  });
}

void RunController::Command() {
  command_t command{};
  command.kind = command_t::START_EPISODE;
  command.episode = next_;
  command.attempt = attempt_;
  command.seed = EpisodeSeed(plan_.seed, next_);
  command.required_component = plan_.required;
  command.num_required = static_cast<int32_t>(plan_.required.size());
  bus().Publish(channels::kCommand, command);
  commanded_ = std::chrono::steady_clock::now();
}

void RunController::Poll(SteadyTime now) {
  Component::Poll(now);
  if (done()) return;
  if (!begun_ && now - commanded_ >= kRepeatCommand) Command();
  if (episode_ && now - summarised_ > kRecorderTimeout) {
    throw EnvironmentError("the recorder did not finish the log of episode " + std::to_string(next_) +
                           " (its log: " + folder_.log_file("recorder").string() + ")");
  }
}

void RunController::OnSummary(const episode_summary_t& summary) {
  if (summary.header.episode != next_ || summary.attempt != attempt_ || episode_) return;
  if (summary.end_reason == "aborted") return BeginAgain(summary.end_detail);
  episode_ = summary;
  summarised_ = std::chrono::steady_clock::now();
  FinishIfRecorded();
}

void RunController::FinishIfRecorded() {
  if (!episode_ || !recorded_) return;
  const nlohmann::ordered_json line = EpisodeJson(plan_.task, plan_.variation, *episode_);
  folder_.AddEpisode(next_, line);
  nlohmann::ordered_json metrics = line["metrics"];
  metrics["extended"] = line["extended"];
  results_.push_back({episode_->complete != 0, episode_->metrics.success != 0, std::move(metrics)});
  summary_ = Summarize(results_);
  folder_.WriteJson("summary.json", SummaryJson(plan_.task, plan_.variation, summary_));
  listener_->OnEpisodeDone(*episode_, summary_);
  episode_.reset();
  begun_ = recorded_ = false;
  attempt_ = 0;
  ++next_;
  if (!done()) Command();
}

void RunController::Retry(const std::string& why) {
  BeginAgain(why);
  folder_.DiscardEpisode(next_);
}

// Leaves the folder to the recorder, which may be about to close the log of the attempt that was aborted.
void RunController::BeginAgain(const std::string& why) {
  if (attempt_ + 1 >= plan_.max_attempts) {
    throw EnvironmentError("episode " + std::to_string(next_) + " failed " +
                           std::to_string(plan_.max_attempts) + " times, the last time: " + why);
  }
  listener_->OnRetry(next_, why);
  episode_.reset();
  begun_ = recorded_ = false;
  ++attempt_;
}

nlohmann::ordered_json EpisodeJson(const std::string& task, const std::string& variation,
                                   const episode_summary_t& summary) {
  return {{"task", task},
          {"variation", variation},
          {"episode", summary.header.episode},
          {"seed", summary.seed},
          {"end_reason", summary.end_reason},
          {"failure_reason", summary.failure_reason},
          {"complete", summary.complete != 0},
          {"metrics", ResultJson(summary.metrics)},
          {"extended", ExtendedJson(summary.extended, summary.metrics)}};
}

nlohmann::ordered_json SummaryJson(const std::string& task, const std::string& variation,
                                   const run_summary_t& summary) {
  nlohmann::ordered_json json = {
      {"task", task},
      {"variation", variation},
      {"episodes", summary.num_episodes},
      {"complete", summary.num_complete},
      {"successes", summary.num_success},
      {"success_rate", summary.success_rate},
      {"success_rate_wilson_95", {summary.success_rate_lower, summary.success_rate_upper}}};
  nlohmann::ordered_json& metrics = json["metrics"] = nlohmann::ordered_json::object();
  for (size_t i = 0; i < summary.metric_name.size(); ++i) {
    // What one episode cannot say (NaN) becomes null.
    metrics[summary.metric_name[i]] = {{"mean", summary.mean_mixed[i]},
                                       {"std", summary.std_mixed[i]},
                                       {"median", summary.median_mixed[i]},
                                       {"min", summary.min_mixed[i]},
                                       {"max", summary.max_mixed[i]}};
  }
  return json;
}

}  // namespace evalbus
