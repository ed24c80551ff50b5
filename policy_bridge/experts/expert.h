// Base class of the scripted experts. It executes motions, and requests the next motions when these have
// ended.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "policy_bridge/interface/policy.h"
#include "policy_bridge/planning/plan.h"
#include "policy_bridge/planning/servo_lead.h"

namespace evalbus::policy {

// Indices of the arms of a two-armed robot: the left arm is on +y, the right arm on -y.
inline constexpr int kLeft = 0, kRight = 1;
// Time at which objects that a task drops at time 0 have come to rest.
inline constexpr int64_t kSettledUs = 500'000;
// Number of candidates of each arm that are combined with candidates of the other arm.
inline constexpr size_t kPairs = 4;

class Expert : public Policy {
 public:
  // max_attempts: maximum number of plans in an episode; the expert then gives up.
  Expert(const mjModel& model, const model_info_t& info, int max_attempts);

  void Begin(const episode_begin_t& begin) override;
  void Act(const state_t& state, action_t* action) override;

  // Continues an episode that another policy has begun. Must be called after Begin() and before the first
  // Act(). If an arm is away from home or a gripper is closed, the expert first opens the grippers, retreats
  // and goes home, because plans begin at home with free hands. state: the state that the first Act()
  // receives. closing: the grippers' last commands, 0 open to 1 closed.
  void TakeOver(const state_t& state, const std::vector<double>& closing);
  // Returns whether all attempts are used up and their motions have been executed.
  bool has_given_up() const { return gives_up() && player_.done(); }

 protected:
  // Returns the next motions, which start at configuration `now` in state `state`. If there are none, the
  // robot rests for a tick and Next() is called again. If this was the last attempt and no plan of the
  // episode was feasible, Act() throws an exception that names the obstacle.
  virtual std::vector<Motion> Next(const Configuration& now, const state_t& state) = 0;

  PlanningContext& context() { return context_; }
  // Returns whether all attempts are used up. If so, the expert rests.
  bool gives_up() const { return attempts_ >= max_attempts_; }
  // Number of plans in this episode; incremented by the derived class.
  int attempts_ = 0;
  // Indices of the robot's arms.
  std::vector<int> arms_;

  // Returns an empty plan that starts at `now`.
  Plan MakePlan(const Configuration& now, const state_t& state) { return Plan(&context_, now, state); }

 private:
  // Returns motions from any configuration to the home configuration.
  std::vector<Motion> GoHomeFrom(const Configuration& now, const state_t& state);
  // Returns a description of the obstacle that prevents a plan from `now`.
  std::string WhyNoPlan(const Configuration& now, const state_t& state);

  PlanningContext context_;
  int max_attempts_;
  // Names of the arms.
  std::vector<std::string> names_;
  // True while the expert is taking over an episode and has not reached home yet.
  bool takes_over_ = false;
  // True if any plan of this episode was feasible.
  bool has_planned_ = false;
  Player player_;
  ServoLead servo_lead_;
  Configuration target_;
};

// Throws InputError unless the robot has two arms.
void NeedTwoArms(const model_info_t& info);

// Writes a configuration as an action.
void SetAction(const Configuration& configuration, action_t* action);

// The policy or command that requires an expert, for error messages.
struct ExpertUser {
  std::string name = "policy \"expert\"";
  // What a user types to select the expert of another task, for example "expert:TASK".
  std::string usage = "expert:TASK";
};

bool HasExpert(const std::string& task);
// Throws InputError with the supported tasks if there is no expert for this one.
void CheckExpert(const std::string& task, const ExpertUser& user = {});

// Creates the scripted expert for a task, which is selected by the name of the task's family. `model` may be
// a copy of the task under a different name. Throws the errors of CheckExpert(), and InputError if the model
// does not fit the expert.
std::unique_ptr<Expert> MakeExpert(const std::string& task, const mjModel& model, const model_info_t& info,
                                   const ExpertUser& user = {});

}  // namespace evalbus::policy
