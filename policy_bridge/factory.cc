#include "policy_bridge/factory.h"

#include <algorithm>
#include <cctype>
#include <vector>

#include "base/errors.h"
#include "base/number_from.h"
#include "base/suggestion.h"
#include "policy_bridge/contract/contract.h"
#include "policy_bridge/experts/expert.h"
#include "policy_bridge/policies/demo_policy.h"
#include "policy_bridge/policies/flawed_policy.h"
#include "policy_bridge/policies/replay_policy.h"
#include "policy_bridge/policies/simple_policies.h"

namespace evalbus::policy {
namespace {

struct Row {
  std::string name;
  // Begins with ":WHAT" if the policy needs an argument, with "[:WHAT]" if the argument is optional.
  // Otherwise empty.
  std::string argument;
  // Description in one line.
  std::string help;
  // Returns the policy's maker. `argument` is empty if the policy takes no argument or if none was given.
  // Throws InputError for an invalid argument.
  std::function<PolicyMaker(const std::string& argument)> open;

  std::string usage() const { return name + argument; }
  bool takes(const std::string& text) const {
    return argument.starts_with(':') || (argument.starts_with('[') && !text.empty());
  }
};

template <class P>
PolicyMaker Make(const std::string&) {
  return [](const mjModel&, const model_info_t& info) { return std::make_unique<P>(info); };
}

// Returns the text before and after the first colon. The second part is empty if there is no colon. Throws
// InputError if nothing follows the colon.
std::pair<std::string, std::string> AtColon(const std::string& text) {
  const size_t colon = text.find(':');
  if (colon == std::string::npos) return {text, ""};
  if (colon + 1 == text.size()) throw InputError("policy argument '" + text + "': expected a task after ':'");
  return {text.substr(0, colon), text.substr(colon + 1)};
}

// Makes the expert of `task`, or of the task that is evaluated if `task` is empty. policy: the user's text
// without the task. Throws the errors of CheckExpert() for `task`.
std::function<std::unique_ptr<Expert>(const mjModel&, const model_info_t&)> ExpertOf(
    const std::string& task, const std::string& policy) {
  const ExpertUser user{"policy \"" + policy + "\"", policy + ":TASK"};
  if (!task.empty()) CheckExpert(task, user);
  return [task, user](const mjModel& model, const model_info_t& info) {
    return MakeExpert(task.empty() ? info.task : task, model, info, user);
  };
}

PolicyMaker MakeScripted(const std::string& task) { return ExpertOf(task, "expert"); }

PolicyMaker MakeNoisy(const std::string& text) {
  double amplitude = NoisyPolicy::kAmplitude;
  auto [number, task] = AtColon(text);
  if (HasExpert(text)) std::swap(number, task);
  if (!number.empty()) {
    amplitude = NumberFrom<double>(number).value_or(-1);
    if (!(amplitude >= 0 && amplitude <= 1)) {
      throw InputError("noisy_expert:" + text +
                       ": expected the maximum deviation of a joint, 0 to 1 rad, or a task with an expert");
    }
  }
  return [amplitude, expert = ExpertOf(task, "noisy_expert" + (number.empty() ? "" : ":" + number))](
             const mjModel& model, const model_info_t& info) {
    return std::make_unique<NoisyPolicy>(expert(model, info), info, amplitude);
  };
}

template <bool anyway>
PolicyMaker MakeReplay(const std::string& path) {
  return [recording = OpenRecording(path)](const mjModel&, const model_info_t& info) {
    return std::make_unique<ReplayPolicy>(recording, info, anyway);
  };
}

PolicyMaker MakeDemo(const std::string& path) {
  return [files = DemonstrationFiles(path)](const mjModel&, const model_info_t& info) {
    return std::make_unique<DemoPolicy>(files, info);
  };
}

PolicyMaker MakeFlawed(const std::string& text) {
  const auto [name, task] = AtColon(text);
  return [flaw = FindFlaw(name), expert = ExpertOf(task, "flawed_expert:" + name)](const mjModel& model,
                                                                                   const model_info_t& info) {
    return std::make_unique<FlawedPolicy>(expert(model, info), flaw, model, info);
  };
}

// The only table of policies without a server. To add a built-in policy, write a class and add a row here.
// RegisterPolicy() adds the policies of plugins.
std::vector<Row>& Policies() {
  static std::vector<Row> rows = {
      {"expert", "[:TASK]",
       "scripted expert of the task; TASK: the expert of another task, for a copy of that task",
       MakeScripted},
      {"noisy_expert", "[:RAD][:TASK]",
       "the expert with noisy joints, which sometimes misses; RAD: maximum deviation, default 0.09",
       MakeNoisy},
      {"random", "", "moves randomly and smoothly around home", Make<RandomPolicy>},
      {"hold", "", "stays at home", Make<HoldPolicy>},
      {"replay", ":RUN_OR_LOG", "replays the actions of a recorded run", MakeReplay<false>},
      {"replay_anyway", ":RUN_OR_LOG",
       "the same, even if task, variation, robot, control rate or seed differ", MakeReplay<true>},
      {"demo", ":FILE_OR_FOLDER",
       "replays RoboEval's demonstrations (safetensors), one per episode, open loop", MakeDemo},
      {"flawed_expert", ":FLAW[:TASK]", "the expert fails on purpose: " + FlawNames(), MakeFlawed},
  };
  return rows;
}

}  // namespace

PolicyMaker FindPolicy(const std::string& name) {
  const size_t colon = name.find(':');
  const bool has_argument = colon != std::string::npos;
  std::string list;
  std::vector<std::string> names;
  for (const Row& row : Policies()) {
    names.push_back(row.name);
    const std::string argument = has_argument ? name.substr(colon + 1) : "";
    if (name.substr(0, colon) == row.name && (!has_argument || row.takes(argument)))
      return row.open(argument);
    list += (list.empty() ? "" : ", ") + row.usage();
  }
  throw InputError("there is no policy \"" + name + "\"" +
                   Suggestion(name.substr(0, colon), names,
                              "; expected one of " + list + ", or a contract of 'evalbus policy list'"));
}

void RegisterPolicy(const std::string& name, const std::string& help, const PolicyMaker& make) {
  const auto refuse = [&name](const char* why) { throw InputError("policy name '" + name + "': " + why); };
  const bool is_word = std::ranges::all_of(
      name, [](unsigned char c) { return (c < 128 && std::isalnum(c)) || c == '_' || c == '-'; });
  if (name.empty() || !is_word) refuse("expected letters, digits, _ and -");
  if (name == kExternalPolicy) refuse("is the name of a policy in an external process");
  if (IsContract(name)) refuse("is the name of a contract");
  for (const Row& row : Policies()) {
    if (row.name == name) refuse("is taken");
  }
  const auto checked = [name, make](const mjModel& model, const model_info_t& info) {
    std::unique_ptr<Policy> policy = make(model, info);
    if (!policy) throw InputError("policy '" + name + "': its plugin returned none");
    return policy;
  };
  Policies().push_back({name, "", help, [checked](const std::string&) { return checked; }});
}

std::unique_ptr<Policy> MakePolicy(const std::string& name, const mjModel& model, const model_info_t& info) {
  return FindPolicy(name)(model, info);
}

std::string PolicyHelp() {
  std::string help;
  for (const Row& row : Policies()) help += (help.empty() ? "" : "\n") + row.usage() + ": " + row.help;
  return help;
}

}  // namespace evalbus::policy
