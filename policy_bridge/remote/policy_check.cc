#include "policy_bridge/remote/policy_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "base/text.h"
#include "policy_bridge/actions/action_converter.h"
#include "policy_bridge/remote/chunk.h"
#include "policy_bridge/remote/server_claims.h"

namespace evalbus::policy {
namespace {

using Level = CheckLine::Level;
using Verdict = CheckReport::Verdict;

constexpr int kRepeats = 5;
// A target that is farther than this beyond a joint limit is not a rounding error.
constexpr double kBeyondLimit = 0.05;  // rad
// If a gripper value is outside the range between `open` and `closed` by more than this fraction of the
// range, the server probably uses a different range.
constexpr double kBeyondGripper = 0.5;
// Limit of the first step (rad) if the contract defines none.
constexpr double kLargeStep = 0.5;

Verdict VerdictOf(ServerError::Kind kind) {
  switch (kind) {
    case ServerError::Kind::kUnreachable:
    case ServerError::Kind::kTimeout:
      return Verdict::kUnreachable;
    case ServerError::Kind::kReply:
      return Verdict::kContract;
    default:
      return Verdict::kProtocol;
  }
}

class Check {
 public:
  Check(const Contract& contract, PolicyClient* client, const mjModel& model, const model_info_t& info,
        const state_t& state)
      : contract_(contract), client_(client), model_(model), info_(info), state_(state) {}

  CheckReport Run(const Value& observation) {
    try {
      Connect();
      Call(observation);
      if (report_.verdict == Verdict::kGood) {
        Repeat(observation);
        CallTogether(observation);
      }
    } catch (const ServerError& error) {
      Bad(VerdictOf(error.kind()), error.what());
      if (!error.details().empty()) Add(Level::kNote, error.details());
    }
    return std::move(report_);
  }

 private:
  void Add(Level level, std::string text) { report_.lines.push_back({level, std::move(text)}); }
  void Good(std::string text) { Add(Level::kGood, std::move(text)); }
  void Bad(Verdict verdict, std::string text) {
    if (report_.verdict == Verdict::kGood || report_.verdict == Verdict::kSuspicious)
      report_.verdict = verdict;
    Add(verdict == Verdict::kSuspicious ? Level::kSuspicious : Level::kBad, std::move(text));
  }
  void Doubt(std::string text) {
    if (report_.verdict == Verdict::kGood) report_.verdict = Verdict::kSuspicious;
    Add(Level::kSuspicious, std::move(text));
  }

  void Connect() {
    const Value metadata = client_->Connect();
    Good(fmt::format("reachable: {}, {}", contract_.url, client_->Name()));
    const Map* map = metadata.As<Map>();
    if (map && !map->empty()) {
      Add(Level::kNote, "its metadata: " + Describe(metadata));
    } else {
      Add(Level::kNote, "it has no metadata, so only its answers can be checked");
    }
    for (const std::string& line : FindContradictions(contract_, metadata)) Bad(Verdict::kContract, line);
    if (!contract_.prompts.empty() && !contract_.prompts.contains(info_.task))
      Doubt("the contract has 'prompts', but none for the task " + info_.task);
    client_->BeginEpisode(contract_.PromptFor(info_.task, info_.instruction), 0);
  }

  // Requests an action chunk. *took_s: duration of the call, s.
  Chunk Call(const Value& observation, double* took_s) {
    const auto begin = std::chrono::steady_clock::now();
    const Reply reply = client_->Infer(observation);
    *took_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    return ReadChunk(contract_, reply.value);
  }

  void Call(const Value& observation) {
    first_ = Call(observation, &report_.first_call_s);
    report_.num_steps = static_cast<int>(first_.rows.size());
    Good(fmt::format("answers: {} of {}; {} {} executed, at {:g} Hz", Plural(report_.num_steps, "step"),
                     Plural(contract_.actions.num_values, "value"), contract_.execute_steps,
                     contract_.execute_steps == 1 ? "is" : "are", contract_.rate_hz));
    const auto num_values = static_cast<size_t>(contract_.actions.num_values);
    report_.least.assign(num_values, std::numeric_limits<double>::infinity());
    report_.most.assign(num_values, -std::numeric_limits<double>::infinity());
    for (const std::vector<double>& row : first_.rows) {
      for (size_t i = 0; i < num_values; ++i) {
        if (!std::isfinite(row[i])) {
          Doubt(fmt::format("value {} of the answer is {}: an episode that uses it ends with policy_error", i,
                            row[i]));
          return;
        }
        report_.least[i] = std::min(report_.least[i], row[i]);
        report_.most[i] = std::max(report_.most[i], row[i]);
      }
    }
    LookAtIndices();
    LookAtGrippers();
    LookAtClips();
    Move();
  }

  void LookAtIndices() {
    std::set<int> unused, shared;
    for (int i = 0; i < contract_.actions.num_values; ++i) unused.insert(i);
    const auto use = [&](int index) {
      if (unused.erase(index) == 0) shared.insert(index);
    };
    for (const ArmForm& arm : contract_.actions.arms) {
      for (const int index : arm.indices) use(index);
      if (arm.gripper.index) use(*arm.gripper.index);
    }
    if (!unused.empty())
      Add(Level::kNote, fmt::format("the contract uses no value at index {}", fmt::join(unused, ", ")));
    if (shared.empty()) return;
    const std::string text =
        fmt::format("the contract uses the value at index {} more than once", fmt::join(shared, ", "));
    // Both grippers may use the same value, but then every value should be used.
    if (unused.empty()) {
      Add(Level::kNote, text);
    } else {
      Doubt(text + ": is an index wrong?");
    }
  }

  // Returns value `i` of a row after the contract's scale and offset.
  double Scaled(size_t i, double value) const {
    const ActionSpace& space = contract_.actions;
    return value * (space.scale.empty() ? 1 : space.scale[i]) + (space.offset.empty() ? 0 : space.offset[i]);
  }

  void LookAtGrippers() {
    for (const ArmForm& arm : contract_.actions.arms) {
      const GripperForm& form = arm.gripper;
      if (!form.index) continue;
      const auto i = static_cast<size_t>(*form.index);
      const double span = std::abs(form.closed - form.open);
      const double lower = std::min(form.open, form.closed), upper = std::max(form.open, form.closed);
      // A negative scale swaps the least and the largest value.
      const auto [least, most] = std::minmax({Scaled(i, report_.least[i]), Scaled(i, report_.most[i])});
      if (least < lower - kBeyondGripper * span || most > upper + kBeyondGripper * span) {
        Doubt(fmt::format(
            "gripper {}: values {:.3g} to {:.3g}, the contract expects {:g} (open) to {:g} (closed)", arm.arm,
            least, most, form.open, form.closed));
      } else {
        Good(fmt::format("gripper {}: values {:.3g} to {:.3g}; {:g} is open, {:g} closed", arm.arm, least,
                         most, form.open, form.closed));
      }
    }
  }

  void LookAtClips() {
    const ActionSpace& space = contract_.actions;
    size_t clipped = 0, all = 0;
    for (const std::vector<double>& row : first_.rows) {
      for (size_t i = 0; i < row.size(); ++i) {
        const double value = Scaled(i, row[i]);
        const bool is_out = (!space.lower.empty() && value < space.lower[i]) ||
                            (!space.upper.empty() && value > space.upper[i]);
        clipped += is_out;
        ++all;
      }
    }
    if (clipped * 5 > all) {
      Doubt(fmt::format(
          "{} of {} values are below 'lower' or above 'upper' and would be clipped: are they normalized?",
          clipped, all));
    }
  }

  // Checks how the first steps would move the robot.
  void Move() {
    ActionConverter converter(contract_.actions, model_, info_);
    converter.Begin();
    const double step_s = 1 / contract_.rate_hz;
    action_t action{};
    double largest = 0, largest_later = 0;
    std::string largest_joint, later, beyond;
    std::vector<double> last;
    int unreachable = 0;
    try {
      for (int k = 0; k < contract_.execute_steps; ++k) {
        converter.Convert(first_.rows[static_cast<size_t>(k)], state_, step_s, &action);
        unreachable += action.unreachable_poses;
        size_t next = 0;
        for (size_t i = 0; i < info_.arm.size(); ++i) {
          const arm_info_t& arm = info_.arm[i];
          for (size_t j = 0; j < arm.joint_name.size(); ++j, ++next) {
            const double target = action.joint_position_rad[next];
            const double step = std::abs(target - state_.arm[i].joint_position_rad[j]);
            if (k == 0 && step > largest) {
              largest = step;
              largest_joint = arm.joint_name[j];
            }
            const double from_last = k == 0 ? 0 : std::abs(target - last[next]);
            if (from_last > largest_later) {
              largest_later = from_last;
              later = fmt::format("step {} changes the target of joint {} by {:.3g} rad", k,
                                  arm.joint_name[j], from_last);
            }
            if (beyond.empty() && (target < arm.joint_lower_rad[j] - kBeyondLimit ||
                                   target > arm.joint_upper_rad[j] + kBeyondLimit)) {
              beyond =
                  fmt::format("step {} commands joint {} to {:.4g} rad, its limits are {:.2f} and {:.2f}", k,
                              arm.joint_name[j], target, arm.joint_lower_rad[j], arm.joint_upper_rad[j]);
            }
          }
        }
        last = action.joint_position_rad;
      }
    } catch (const std::runtime_error& error) {
      return Doubt(error.what());
    }
    const double limit = contract_.first_step_rad.value_or(kLargeStep);
    const std::string step =
        largest_joint.empty()
            ? std::string("first step: no joint moves")
            : fmt::format("first step: at most {:.3g} rad, by joint {}", largest, largest_joint);
    if (largest > limit) {
      // The value is rounded up, so that the user can copy it into the contract.
      const double enough = std::ceil(largest * 10) / 10;
      Doubt(fmt::format(
          "{}; expected at most {:g} rad ({}): are absolute positions used as deltas, or is the order of the "
          "joints or the unit wrong? If the step is correct, set 'first_step_rad: {:g}' in the contract's "
          "action, or pass --first-step {:g}",
          step, limit, contract_.first_step_rad ? "first_step_rad" : "the default without first_step_rad",
          enough, enough));
    } else {
      Good(step);
    }
    if (largest_later > limit)
      Doubt(fmt::format("{}; expected at most {:g} rad: are the rows steps of one chunk?", later, limit));
    if (!beyond.empty()) Doubt(beyond + ": is the order of the joints or the unit wrong?");
    if (unreachable > 0) {
      Doubt(fmt::format("{} of the {} steps' wrist poses are out of reach: is the frame or unit wrong?",
                        unreachable, contract_.execute_steps));
    }
  }

  void Repeat(const Value& observation) {
    std::vector<double> took;
    report_.repeat_difference = 0;
    size_t least_steps = first_.rows.size(), most_steps = first_.rows.size();
    bool is_finite = true;
    for (int call = 0; call < kRepeats; ++call) {
      double seconds = 0;
      const Chunk again = Call(observation, &seconds);
      took.push_back(seconds);
      report_.repeat_difference = std::max(report_.repeat_difference, Difference(again));
      least_steps = std::min(least_steps, again.rows.size());
      most_steps = std::max(most_steps, again.rows.size());
      for (const std::vector<double>& row : again.rows)
        is_finite = is_finite && std::ranges::all_of(row, [](double value) { return std::isfinite(value); });
    }
    std::ranges::sort(took);
    report_.steady_call_s = took[took.size() / 2];
    Good(fmt::format("time: first call {:.3g} s, then {:.3g} s; the executed steps last {:.3g} s",
                     report_.first_call_s, report_.steady_call_s,
                     contract_.execute_steps / contract_.rate_hz));
    if (report_.steady_call_s > contract_.execute_steps / contract_.rate_hz) {
      Add(Level::kNote,
          "the answer takes longer than its steps last: a real robot would wait or drift, but a run waits in "
          "simulated time; --latency measured or --realtime includes the delay");
    }
    if (!is_finite) {
      Doubt(
          "a repeated answer has a value that is not a finite number: an episode that uses it ends with "
          "policy_error");
    }
    if (least_steps < most_steps) {
      Add(Level::kNote, fmt::format("the same observation {} times: answers have {} to {} steps",
                                    kRepeats + 1, least_steps, most_steps));
    }
    if (report_.repeat_difference == 0) {
      if (!is_finite || least_steps < most_steps) return;
      Good(fmt::format("the same observation {} times: the same answer", kRepeats + 1));
    } else {
      Add(Level::kNote,
          fmt::format(
              "the same observation {} times: answers differ by up to {:.3g}: either the policy keeps "
              "state within an episode, or a run cannot be repeated exactly with this server (but --policy "
              "replay:RUN repeats its actions)",
              kRepeats + 1, report_.repeat_difference));
    }
  }

  void CallTogether(const Value& observation) {
    if (contract_.batch_size == 1) return;
    const std::vector<Value> two(2, observation);
    double difference = 0;
    try {
      for (const Reply& reply : client_->InferBatch(two)) {
        difference = std::max(difference, Difference(ReadChunk(contract_, reply.value)));
      }
    } catch (const ServerError& error) {
      return Bad(Verdict::kContract,
                 fmt::format("batch_size: two observations in one request: {}", error.what()));
    }
    if (difference == 0) {
      Good("two observations in one request: the answers are the same as in separate requests");
    } else {
      Add(Level::kNote, fmt::format("two observations in one request: answers differ by up to {:.3g} from "
                                    "that to one observation alone, so "
                                    "results depend on --workers",
                                    difference));
    }
  }

  // Returns the largest difference between the values of this chunk and of the first one.
  double Difference(const Chunk& chunk) const {
    double difference = 0;
    for (size_t k = 0; k < std::min(chunk.rows.size(), first_.rows.size()); ++k) {
      for (size_t i = 0; i < chunk.rows[k].size(); ++i) {
        difference = std::max(difference, std::abs(chunk.rows[k][i] - first_.rows[k][i]));
      }
    }
    return difference;
  }

  const Contract& contract_;
  PolicyClient* client_;
  const mjModel& model_;
  const model_info_t& info_;
  const state_t& state_;
  CheckReport report_;
  Chunk first_;
};

}  // namespace

const char* NameOf(Verdict verdict) {
  return verdict == Verdict::kGood          ? "good"
         : verdict == Verdict::kUnreachable ? "unreachable"
         : verdict == Verdict::kProtocol    ? "protocol"
         : verdict == Verdict::kContract    ? "contract"
                                            : "suspicious";
}

CheckReport CheckPolicyServer(const Contract& contract, PolicyClient* client, const mjModel& model,
                              const model_info_t& info, const state_t& state,
                              const std::vector<image_t>& images, ObservationBuilder* observations) {
  Fitted(contract, [&] { return ActionConverter(contract.actions, model, info); });
  observations->Begin();
  observations->Add(state, images);
  observation_t record{};
  const Value observation = observations->Build({}, &record);
  return Check(contract, client, model, info, state).Run(observation);
}

nlohmann::ordered_json CheckJson(const Contract& contract, const CheckReport& report) {
  constexpr const char* kLevels[] = {"good", "note", "suspicious", "bad"};
  nlohmann::ordered_json json = {{"contract", contract.file.string()},
                                 {"url", contract.url},
                                 {"verdict", NameOf(report.verdict)},
                                 {"first_call_s", report.first_call_s},
                                 {"steady_call_s", report.steady_call_s},
                                 {"repeat_difference", report.repeat_difference},
                                 {"num_steps", report.num_steps},
                                 {"least", report.least},
                                 {"most", report.most},
                                 {"lines", nlohmann::ordered_json::array()}};
  for (const CheckLine& line : report.lines) {
    json["lines"].push_back({{"level", kLevels[static_cast<int>(line.level)]}, {"text", line.text}});
  }
  return json;
}

}  // namespace evalbus::policy
