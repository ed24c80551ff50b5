#include "runner/no_return_finder.h"

#include <fmt/format.h>

#include <numeric>
#include <optional>
#include <stdexcept>
#include <vector>

#include "base/errors.h"
#include "base/json_file.h"
#include "base/options_json.h"
#include "base/run_layout.h"
#include "bus/episode_reader.h"
#include "collision/checker.h"
#include "lcmtypes/clock.h"
#include "metrics/episode/episode_scorer.h"
#include "policy_bridge/experts/expert.h"
#include "sim/prepared_scene.h"
#include "sim/world.h"

namespace evalbus::runner {
namespace {

namespace fs = std::filesystem;
using results::NoReturn;

// Distance in ticks of the neighbors that are also tried, to detect whether success is monotone.
constexpr int64_t kNeighbor = 5;
// Maximum number of times that the search restarts from a later tick from which the expert succeeds again.
constexpr int kMaxRestarts = 3;
// Simulated time after which an expert that has given up counts as failed. Until then, objects may come to
// rest, and the episode may still succeed.
constexpr int64_t kSettleUs = 1'000'000;

sim::PreparedScene SceneOf(const results::RecordedRun& run) {
  const fs::path file = run.folder / kRunJson;
  if (!run.is_simulated() || run.clock() != std::string(clock_name::kLockstep))
    throw InputError(run.folder.string() + ": only episodes that were simulated in lockstep can be repeated");
  sim::SimOptions options;
  ReadOptions(ReadJsonFile(file), file.string(), &options);
  options.out = run.folder;
  return sim::PrepareScene(options);
}

}  // namespace

class NoReturnFinder::Impl {
 public:
  Impl(const results::RecordedRun& run, const std::string& expert)
      : run_(run.folder),
        seed_stream_(run.seed_stream),
        scene_(SceneOf(run)),
        world_(scene_.scene.physics.get(), scene_.info, scene_.robot, scene_.task, scene_.info.substeps),
        checker_(scene_.scene.physics.get(), scene_.info),
        scorer_(scene_.info, scene_.task),
        expert_(policy::MakeExpert(expert.empty() ? scene_.task.name : expert, *scene_.scene.physics,
                                   scene_.info, {run.folder.string(), "--expert TASK"})) {}

  NoReturn Find(int episode) {
    Read(episode);
    Repeat();
    needed_ticks_ = 0;
    const int64_t last = static_cast<int64_t>(log_.states.size()) - 1;
    if (Succeeds(last, 1)) return PointAt(last, NoReturn::Kind::kOpen, true);
    int64_t good = 0, bad = last;
    bool is_monotone = true;
    for (int restart = 0;; ++restart) {
      Bisect(&good, &bad);
      const int64_t later = bad + kNeighbor;
      if (restart == kMaxRestarts || later >= last || !Succeeds(later, 1)) break;
      is_monotone = false;
      good = later;
      bad = last;
    }
    if (good == 0 && !Succeeds(0, 1)) return PointAt(0, NoReturn::Kind::kNever, true);
    if (good > kNeighbor) is_monotone = is_monotone && Succeeds(good - kNeighbor, 1);
    return PointAt(good, Succeeds(bad, 2) ? NoReturn::Kind::kOutOfTime : NoReturn::Kind::kLost, is_monotone);
  }

 private:
  NoReturn PointAt(int64_t tick, NoReturn::Kind kind, bool is_monotone) const {
    return {kind, tick, static_cast<double>(tick * world_.tick_us()) / 1e6, is_monotone};
  }

  // Narrows `good` and `bad` down to neighboring ticks, of which the expert succeeds only from `good`. If
  // only the time limit matters, the number of ticks that the expert needed predicts the last good tick. This
  // tick is tried first, followed by later ticks in growing steps.
  void Bisect(int64_t* good, int64_t* bad) {
    int64_t step = 0;
    while (*bad - *good > 1) {
      int64_t tick = std::midpoint(*good, *bad);
      const int64_t expected = scene_.info.time_limit_us / world_.tick_us() - needed_ticks_;
      if (needed_ticks_ > 0 && expected > *good && expected < *bad) {
        tick = expected;
        step = 1;
      } else if (step > 0 && *good + step < *bad) {
        tick = *good + step;
        step *= 2;
      }
      if (Succeeds(tick, 1)) {
        *good = tick;
      } else {
        *bad = tick;
        step = 0;
      }
    }
  }

  void Read(int episode) {
    const fs::path log = EpisodeLog(run_, episode);
    EpisodeReader reader(log, {channels::kState.name, channels::kContacts.name, channels::kAction.name});
    // Only the last attempt in the log counts.
    std::optional<EpisodeMessages> read;
    for (EpisodeMessages messages; reader.Next(&messages); messages = {}) read = std::move(messages);
    if (const std::string why = reader.WhyNotWhole(read ? &*read : nullptr); !why.empty())
      throw InputError(log.string() + ": " + why);
    log_ = *std::move(read);
    const auto is_complete = [](const auto& messages, size_t count) {
      for (size_t i = 0; i < count; ++i)
        if (i >= messages.size() || messages[i].header.tick != static_cast<int64_t>(i)) return false;
      return true;
    };
    const size_t ticks = log_.states.size();
    if (static_cast<int64_t>(ticks) != log_.end->header.tick + 1 || !is_complete(log_.states, ticks) ||
        !is_complete(log_.contacts, ticks) || !is_complete(log_.actions, ticks - 1))
      throw InputError(log.string() + ": ticks are missing");
  }

  // Simulates the logged actions and keeps the state of each tick.
  void Repeat() {
    world_.Reset(log_.begin->seed, scene_.task.variation(scene_.variation), seed_stream_);
    snapshots_.clear();
    for (size_t tick = 0; tick < log_.states.size(); ++tick) {
      if (tick > 0 && (!world_.Apply(log_.actions[tick - 1]).empty() || !world_.Step()))
        throw InputError(fmt::format("{}: episode {}: the action of tick {} cannot be simulated again",
                                     run_.string(), log_.number(), tick - 1));
      world_.Fill(&state_);
      if (state_.qpos_mixed != log_.states[tick].qpos_mixed) {
        throw InputError(
            fmt::format("{}: a repetition of episode {} differs from its log at tick {}: was it simulated by "
                        "a different version of MuJoCo?",
                        run_.string(), log_.number(), tick));
      }
      snapshots_.push_back(world_.Save());
    }
  }

  void FindContacts() {
    for (int body = 0; body < state_.num_bodies; ++body)
      checker_.SetBodyPose(body, state_.body[static_cast<size_t>(body)].position_m,
                           state_.body[static_cast<size_t>(body)].quat_wxyz);
    contacts_.header = state_.header;
    contacts_.contact = checker_.FindContacts();
    contacts_.num_contacts = static_cast<int32_t>(contacts_.contact.size());
  }

  // Returns whether the expert, taking over at this tick, succeeds within `limits` times the time limit.
  bool Succeeds(int64_t first, int limits) {
    scorer_.Start();
    for (int64_t tick = 0; tick < first; ++tick)
      scorer_.Tick(log_.states[static_cast<size_t>(tick)], log_.contacts[static_cast<size_t>(tick)]);
    if (scorer_.verdict() != partial_metrics_t::UNDECIDED) return false;
    world_.Restore(snapshots_[static_cast<size_t>(first)]);
    expert_->Begin(*log_.begin);
    state_.header = log_.states[static_cast<size_t>(first)].header;
    int64_t given_up_us = -1;
    for (bool is_first = true;; is_first = false) {
      world_.Fill(&state_);
      FindContacts();
      scorer_.Tick(state_, contacts_);
      if (scorer_.verdict() == partial_metrics_t::SUCCESS) needed_ticks_ = state_.header.tick - first;
      if (scorer_.verdict() != partial_metrics_t::UNDECIDED)
        return scorer_.verdict() == partial_metrics_t::SUCCESS;
      const int64_t now = state_.header.sim_time_us;
      if (now >= limits * scene_.info.time_limit_us) return false;
      if (!expert_->has_given_up()) given_up_us = now;
      if (now - given_up_us > kSettleUs) return false;
      if (is_first && first > 0)
        expert_->TakeOver(state_, log_.actions[static_cast<size_t>(first - 1)].gripper_closing);
      action_t action{};
      try {
        expert_->Act(state_, &action);
      } catch (const std::runtime_error&) {
        return false;  // no plan
      }
      if (!world_.Apply(action).empty() || !world_.Step()) return false;
      ++state_.header.tick;
      state_.header.sim_time_us += world_.tick_us();
    }
  }

  const fs::path run_;
  const std::string seed_stream_;
  const sim::PreparedScene scene_;
  sim::World world_;
  collision::CollisionChecker checker_;
  metrics::EpisodeScorer scorer_;
  std::unique_ptr<policy::Expert> expert_;
  EpisodeMessages log_;
  std::vector<sim::World::Snapshot> snapshots_;  // by tick
  // Number of ticks that the expert needed when it last succeeded; 0 before its first success.
  int64_t needed_ticks_ = 0;
  state_t state_{};
  contacts_t contacts_{};
};

NoReturnFinder::NoReturnFinder(const results::RecordedRun& run, const std::string& expert)
    : impl_(std::make_unique<Impl>(run, expert)) {}
NoReturnFinder::~NoReturnFinder() = default;
NoReturn NoReturnFinder::Find(int episode) { return impl_->Find(episode); }

}  // namespace evalbus::runner
