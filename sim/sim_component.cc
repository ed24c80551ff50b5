#include "sim/sim_component.h"

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iostream>
#include <utility>

#include "base/errors.h"
#include "base/random.h"
#include "base/run_layout.h"
#include "base/sha256.h"
#include "base/write_whole.h"
#include "bus/channels.h"
#include "evalbus/episode_summary_t.hpp"
#include "models/mujoco_errors.h"

namespace evalbus::sim {
namespace {

using std::chrono::steady_clock;

// Whoever invents names cannot fill the memory.
constexpr size_t kMaxConsumers = 100;

constexpr auto kAnnouncePeriod = std::chrono::milliseconds(200);
// MODEL is repeated while an episode runs, for those who begin to listen in its middle: by the wall clock
// where policies are slow, by simulated time so that the log of a run that was faster than time has it, too.
constexpr auto kRepeatModel = std::chrono::seconds(1);
constexpr int64_t kRepeatModelSimUs = 2'000'000;
// What was lost is asked for by saying again what it answers.
constexpr auto kRepeatUnheard = std::chrono::seconds(2);

SteadyTime::duration Seconds(double s) {
  return std::chrono::duration_cast<SteadyTime::duration>(std::chrono::duration<double>(s));
}

// MuJoCo does not say whether a disk took what it wrote: it writes to memory, and we to the disk.
std::string CompiledModel(const mjModel* model) {
  const int memory = memfd_create("model", MFD_CLOEXEC);
  if (memory < 0) throw EnvironmentError(std::string("memfd_create: ") + std::strerror(errno));
  const std::string name = "/proc/self/fd/" + std::to_string(memory);
  mj_saveModel(model, name.c_str(), nullptr, 0);
  std::ifstream stream(name, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(stream), {}};
  close(memory);
  return bytes;
}

std::string SaveModel(const mjModel* model, const std::filesystem::path& file) {
  WriteWhole(file, CompiledModel(model));
  return std::filesystem::absolute(file).lexically_normal().string();
}

}  // namespace

SimComponent::SimComponent(Bus* bus, const SimOptions& options) : Component(bus, "sim"), options_(options) {
  InstallMujocoHandlers();
  TaskSelection selection = FindTask(options.task);
  task_ = std::move(selection.task);
  variation_ = selection.variation;
  robot_ = LoadRobot(options.robot.empty() ? task_.robot_file : FindRobot(options.robot), options.model_path);
  scene_ = BuildScene(task_, robot_);
  for (const std::string& warning : scene_.warnings) std::cerr << "warning: " << warning << std::endl;

  const double timestep = scene_.physics->opt.timestep;
  if (!(options.control_hz >= 20 && options.control_hz <= 500)) {
    throw InputError("--control-hz: expected 20 to 500");
  }
  if (!(options.rtf > 0)) throw InputError("--rtf: expected a number above 0");
  const int substeps = static_cast<int>(std::lround(1 / (options.control_hz * timestep)));
  world_.emplace(scene_.physics.get(), scene_.info, robot_, task_, substeps);

  model_info_ = scene_.info;
  model_info_.message_version = model_info_t::VERSION;
  model_info_.run_id = options.run_id;
  model_info_.variation = variation_;
  model_info_.clock = options.realtime ? "realtime" : "lockstep";
  model_info_.substeps = substeps;
  model_info_.clearance_every_ticks =
      options.clearance_hz > 0
          ? std::max(1, static_cast<int>(std::lround(
                            1e6 / (options.clearance_hz * static_cast<double>(world_->tick_us())))))
          : 0;
  const auto folder = options.out / kModelFolder;
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw InputError("cannot create " + folder.string() + ": " + error.message());
  WriteWhole(folder / kSceneXml, scene_.xml);
  model_info_.physics_file = SaveModel(scene_.physics.get(), folder / kPhysicsModel);
  model_info_.visual_file = SaveModel(scene_.visual.get(), folder / kVisualModel);
  model_info_.physics_sha256 = Sha256File(model_info_.physics_file);
  model_info_.visual_sha256 = Sha256File(model_info_.visual_file);

  for (int i = 0; i < options.episodes; ++i) {
    command_t command{};
    command.kind = command_t::START_EPISODE;
    command.episode = i;
    command.seed = EpisodeSeed(options.seed, i);
    command.required_component = options.required;
    command.num_required = static_cast<int32_t>(options.required.size());
    queue_.push_back(command);
  }

  bus->Subscribe<command_t>(channels::kCommand, [this](const command_t& m) { OnCommand(m); });
  bus->Subscribe<component_status_t>(channels::kStatus, [this](const component_status_t& m) { OnStatus(m); });
  bus->Subscribe<action_t>(channels::kAction, [this](const action_t& m) { OnAction(m); });
  bus->Subscribe<partial_metrics_t>(channels::kPartial, [this](const partial_metrics_t& m) { OnPartial(m); });
  bus->Subscribe<episode_summary_t>(channels::kEpisodeSummary,
                                    [this](const episode_summary_t& m) { OnSummary(m.header); });
  model_bytes_.resize(static_cast<size_t>(model_info_.getEncodedSize()));
  model_info_.encode(model_bytes_.data(), 0, static_cast<int>(model_bytes_.size()));
  bus->Subscribe<model_info_t>(channels::kModel, [this](const model_info_t&) { OnOwnModel(); });
  bus->Subscribe<episode_begin_t>(channels::kEpisodeBegin,
                                  [this](const episode_begin_t& m) { OnOwnBegin(m); });
  bus->Subscribe<episode_end_t>(channels::kEpisodeEnd, [this](const episode_end_t& m) { OnOwnEnd(m); });
  if (!queue_.empty()) BeginNext();
}

void SimComponent::OnCommand(const command_t& command) {
  if (command.kind == command_t::STOP) {
    if (phase_ == Phase::kRunning) End("aborted", "stopped on command");
    done_ = true;
    return;
  }
  const bool is_same_episode = command.episode == status_.episode;
  // Repeated commands are the sender's way to be heard; one start is enough.
  if (is_same_episode && command.attempt == status_.attempt && command.seed == begin_.seed) return;
  // Attempts only go up: an earlier one is what an old log says.
  if (command.kind != command_t::START_EPISODE || options_.episodes > 0 ||
      (is_same_episode && command.attempt < status_.attempt)) {
    ++status_.foreign_messages;
    return;
  }
  // The launcher waits for one episode and repeats its command until that begins; what somebody else
  // commanded, and nobody gets ready for, does not keep it from that.
  queue_ = {command};
  if (phase_ != Phase::kRunning) BeginNext();
}

void SimComponent::OnSummary(const header_t& header) {
  // Episodes of our own (--episodes) follow one another; those on command come when the launcher says so.
  if (options_.episodes == 0 || phase_ != Phase::kIdle || header.episode != status_.episode) return;
  if (queue_.empty()) {
    done_ = true;
  } else {
    BeginNext();
  }
}

void SimComponent::OnOwnModel() {
  if (phase_ == Phase::kIdle || std::ranges::equal(bus().handled(), model_bytes_)) return;
  OnConflict("a MODEL that is not this sim's: is a second sim on this bus, or a log being played?");
}

void SimComponent::OnOwnBegin(const episode_begin_t& begin) {
  if (phase_ == Phase::kIdle || (begin.header.episode == status_.episode &&
                                 begin.attempt == status_.attempt && begin.seed == begin_.seed)) {
    return;
  }
  OnConflict("an EPISODE_BEGIN that is not this sim's: is a second sim on this bus, or a log being played?");
}

void SimComponent::OnOwnEnd(const episode_end_t& end) {
  if (phase_ == Phase::kIdle || !IsOurs(end.header)) return;
  // Of the attempt before.
  std::vector<uint8_t> own(static_cast<size_t>(end_.getEncodedSize()));
  end_.encode(own.data(), 0, static_cast<int>(own.size()));
  if (std::ranges::equal(bus().handled(), own)) return;
  OnConflict("an EPISODE_END that is not this sim's: is a second sim on this bus, or a log being played?");
}

void SimComponent::OnConflict(const std::string& what) {
  ++status_.foreign_messages;
  if (conflict_.empty()) conflict_ = what;
  // Said at once: until then others may take what they hear for ours.
  if (phase_ == Phase::kWaiting) state_.header = begin_.header;
  End("aborted", conflict_);
}

void SimComponent::BeginNext() {
  command_ = queue_.front();
  queue_.pop_front();
  begin_ = {};
  begin_.header.episode = command_.episode;
  begin_.seed = command_.seed;
  begin_.attempt = command_.attempt;
  EnterEpisode(begin_);
  conflicts_.Start();
  conflict_.clear();
  instances_.clear();
  for (const Parameter& parameter : world_->Reset(command_.seed, task_.variation(variation_))) {
    begin_.parameter_name.push_back(parameter.name);
    begin_.parameter_value_mixed.push_back(parameter.value);
  }
  begin_.num_parameters = static_cast<int32_t>(begin_.parameter_name.size());
  phase_ = Phase::kWaiting;
  AnnounceEpisode();
}

void SimComponent::AnnounceEpisode() {
  PublishModel();
  bus().Publish(channels::kEpisodeBegin, begin_);
  announced_ = steady_clock::now();
}

void SimComponent::PublishModel() {
  bus().Publish(channels::kModel, model_info_);
  model_published_ = steady_clock::now();
  model_published_sim_us_ = phase_ == Phase::kRunning ? state_.header.sim_time_us : 0;
}

void SimComponent::OnStatus(const component_status_t& status) {
  const bool is_required =
      std::ranges::find(command_.required_component, status.component) != command_.required_component.end();
  if (phase_ != Phase::kIdle && status.episode == status_.episode && status.attempt == status_.attempt &&
      status.state == component_status_t::READY && (is_required || status.component == "sim")) {
    const int64_t known = status.component == "sim"
                              ? status_.instance
                              : instances_.emplace(status.component, status.instance).first->second;
    if (status.instance != known) {
      return OnConflict("two processes on this bus say that they are the " + status.component);
    }
  }
  if (status.component == "sim") return;
  if (!is_required && consumers_.size() >= kMaxConsumers && !consumers_.contains(status.component)) {
    ++status_.foreign_messages;
    return;
  }
  Consumer& consumer = consumers_[status.component];
  consumer.episode = status.episode;
  consumer.attempt = status.attempt;
  consumer.ready = status.state == component_status_t::READY;
  consumer.last_tick = std::max<int64_t>(status.last_tick, -1);
  consumer.lag_window_ticks = status.lag_window_ticks;
  if (phase_ == Phase::kRunning && status.component == "policy" &&
      status.state == component_status_t::FAILED && status.episode == status_.episode &&
      status.attempt == status_.attempt) {
    pending_end_ = {"policy_error", status.error.empty() ? "the policy said that it failed" : status.error};
  }
  if (phase_ == Phase::kWaiting) {
    StartIfReady();
  } else if (phase_ == Phase::kRunning && !options_.realtime) {
    Advance();
  }
}

std::string SimComponent::MissingComponents() const {
  std::string missing;
  for (const std::string& name : command_.required_component) {
    const auto found = consumers_.find(name);
    if (found != consumers_.end() && found->second.ready && found->second.episode == status_.episode &&
        found->second.attempt == status_.attempt) {
      continue;
    }
    missing += (missing.empty() ? "" : ", ") + name;
  }
  return missing;
}

void SimComponent::StartIfReady() {
  if (!MissingComponents().empty()) return;
  phase_ = Phase::kRunning;
  SayReady();
  state_.header = begin_.header;
  state_.deadline_misses = deadline_misses_ = late_ticks_ = 0;
  pacing_error_s_.clear();
  deadline_ = steady_clock::now() + Seconds(static_cast<double>(world_->tick_us()) * 1e-6 / options_.rtf);
  PublishState();
}

void SimComponent::PublishState() {
  world_->Fill(&state_);
  state_.deadline_misses = deadline_misses_;
  has_action_ = has_partial_ = false;
  verdict_ = partial_metrics_t::UNDECIDED;
  pending_end_.reset();
  state_published_ = state_said_ = steady_clock::now();
  Progress(state_.header.tick);
  bus().Publish(channels::kState, state_);
}

void SimComponent::OnAction(const action_t& action) {
  if (phase_ != Phase::kRunning || !IsOurs(action.header)) return;
  const int64_t tick = state_.header.tick;
  if (action.header.tick < 0 || action.header.tick > tick) {
    ++status_.foreign_messages;
    return;
  }
  const auto answer = conflicts_.Hear(channels::kAction, action.header.tick, bus().handled());
  if (answer == ConflictDetector::Answer::kConflicting) {
    return OnConflict("two different actions for tick " + std::to_string(action.header.tick) +
                      ": is a second policy on this bus?");
  }
  // Only the answer to this tick counts; in realtime an older one still is the latest word of a slow policy.
  if (answer == ConflictDetector::Answer::kRepeated || (action.header.tick < tick && !options_.realtime)) {
    ++status_.foreign_messages;
    return;
  }
  const std::string fault = action.error.empty() ? world_->Apply(action) : action.error;
  if (action.header.tick == tick) has_action_ = true;
  if (!fault.empty()) pending_end_ = {"policy_error", fault};
  if (options_.realtime) return;
  if (!pending_end_ && !TimeIsUp() && !world_->Step()) pending_end_ = {"unstable", world_->instability()};
  Advance();
}

void SimComponent::OnPartial(const partial_metrics_t& partial) {
  if (phase_ != Phase::kRunning || !IsOurs(partial.header)) return;
  const int64_t tick = partial.header.tick;
  if (tick < 0 || tick > state_.header.tick) {
    ++status_.foreign_messages;
    return;
  }
  const auto answer = conflicts_.Hear(channels::kPartial, tick, bus().handled());
  if (answer == ConflictDetector::Answer::kConflicting) return OnConflict(conflicts_.conflict());
  if (options_.realtime) {
    // The verdict may be about an earlier tick; it holds all the same.
    if (partial.verdict != partial_metrics_t::UNDECIDED) {
      End(partial.verdict == partial_metrics_t::SUCCESS ? "success" : "failure");
    }
    return;
  }
  if (answer == ConflictDetector::Answer::kRepeated || tick != state_.header.tick) {
    ++status_.foreign_messages;
    return;
  }
  has_partial_ = true;
  verdict_ = partial.verdict;
  Advance();
}

bool SimComponent::ConsumersKeepUp() const {
  return std::all_of(consumers_.begin(), consumers_.end(), [this](const auto& entry) {
    const Consumer& consumer = entry.second;
    return consumer.lag_window_ticks == 0 || consumer.episode != status_.episode ||
           state_.header.tick - consumer.last_tick < consumer.lag_window_ticks;
  });
}

void SimComponent::Advance() {
  if (!has_partial_) return;
  if (verdict_ != partial_metrics_t::UNDECIDED) {
    End(verdict_ == partial_metrics_t::SUCCESS ? "success" : "failure");
  } else if (TimeIsUp()) {
    End("time_limit");
  } else if (pending_end_) {
    End(pending_end_->first, pending_end_->second);
  } else if (has_action_ && ConsumersKeepUp()) {
    ++state_.header.tick;
    state_.header.sim_time_us += world_->tick_us();
    PublishState();
  }
}

void SimComponent::AdvanceRealtime(SteadyTime now) {
  if (now < deadline_) return;
  if (pending_end_) return End(pending_end_->first, pending_end_->second);
  if (TimeIsUp()) return End("time_limit");
  if (!has_action_) ++deadline_misses_;
  if (!world_->Step()) return End("unstable", world_->instability());
  ++state_.header.tick;
  state_.header.sim_time_us += world_->tick_us();
  PublishState();
  const auto period = Seconds(static_cast<double>(world_->tick_us()) * 1e-6 / options_.rtf);
  const auto late = state_published_ - deadline_;
  pacing_error_s_.push_back(std::chrono::duration<double>(late).count());
  deadline_ += period;
  // The schedule moves, rather than a burst of ticks nobody can answer in time.
  if (late >= period) {
    ++late_ticks_;
    deadline_ = state_published_ + period;
  }
}

void SimComponent::FillPacing(episode_end_t* end) {
  if (pacing_error_s_.empty()) return;
  std::sort(pacing_error_s_.begin(), pacing_error_s_.end());
  // The smallest value that so large a share of all does not exceed.
  const auto percentile = [this](double share) {
    const auto rank = std::ceil(share * static_cast<double>(pacing_error_s_.size()));
    return pacing_error_s_[static_cast<size_t>(rank) - 1];
  };
  end->pacing_error_p50_s = percentile(0.50);
  end->pacing_error_p99_s = percentile(0.99);
  end->pacing_error_max_s = pacing_error_s_.back();
  end->late_ticks = late_ticks_;
}

void SimComponent::End(const std::string& reason, const std::string& detail) {
  phase_ = Phase::kIdle;
  end_ = {};
  end_.header = state_.header;
  end_.end_reason = reason;
  end_.detail = detail;
  FillPacing(&end_);
  end_said_ = steady_clock::now();
  bus().Publish(channels::kEpisodeEnd, end_);
  status_.state = component_status_t::IDLE;
  status_.last_finished_episode = status_.episode;
  PublishStatus();
  if (options_.episodes == 0 && !queue_.empty()) BeginNext();
}

void SimComponent::Poll(SteadyTime now) {
  Component::Poll(now);
  if (phase_ == Phase::kWaiting && now - announced_ >= kAnnouncePeriod) AnnounceEpisode();
  // To the recorder or the launcher it may have been lost, or the score with which metrics answers.
  if (phase_ == Phase::kIdle && end_said_ != SteadyTime{} && now - end_said_ >= kRepeatUnheard) {
    end_said_ = now;
    bus().Publish(channels::kEpisodeEnd, end_);
  }
  if (phase_ != Phase::kRunning) return;
  if (now - model_published_ >= kRepeatModel ||
      state_.header.sim_time_us - model_published_sim_us_ >= kRepeatModelSimUs) {
    PublishModel();
  }
  if (options_.realtime) return AdvanceRealtime(now);
  if (!(has_action_ && has_partial_) && now - state_said_ >= kRepeatUnheard) {
    state_said_ = now;
    bus().Publish(channels::kState, state_);
  }
  const auto waited = now - state_published_;
  if (!has_partial_ && waited > Seconds(options_.metrics_timeout_s)) {
    End("aborted", "no score for tick " + std::to_string(state_.header.tick) + " within " +
                       std::to_string(std::lround(options_.metrics_timeout_s)) + " s");
  } else if (has_partial_ && !has_action_ && waited > Seconds(options_.policy_timeout_s)) {
    End("policy_timeout", "no action for tick " + std::to_string(state_.header.tick) + " within " +
                              std::to_string(std::lround(options_.policy_timeout_s)) + " s");
  } else if (has_partial_ && has_action_ && waited > Seconds(options_.metrics_timeout_s)) {
    End("aborted", "a consumer (recorder?) stopped at " + std::to_string(state_.header.tick) + " ticks");
  }
}

SteadyTime SimComponent::next_poll() const {
  return phase_ == Phase::kRunning && options_.realtime ? deadline_ : SteadyTime::max();
}

}  // namespace evalbus::sim
