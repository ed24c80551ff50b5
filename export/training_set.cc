#include "export/training_set.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "base/errors.h"
#include "base/json_file.h"
#include "base/safetensors.h"
#include "base/write_whole.h"
#include "bus/episode_reader.h"
#include "bus/host.h"
#include "export/hdf5_file.h"
#include "lcmtypes/clock.h"
#include "lcmtypes/source.h"
#include "metrics/episode/result_json.h"
#include "models/task_description.h"

namespace evalbus::exports {
namespace {

namespace fs = std::filesystem;

struct Limits {
  std::vector<double> lower, upper;
};

// Returns the limits of an action: first the joints of all arms, then the grippers.
Limits ActionLimits(const model_info_t& model) {
  Limits limits;
  for (const arm_info_t& arm : model.arm) {
    limits.lower.insert(limits.lower.end(), arm.joint_lower_rad.begin(), arm.joint_lower_rad.end());
    limits.upper.insert(limits.upper.end(), arm.joint_upper_rad.begin(), arm.joint_upper_rad.end());
  }
  limits.lower.resize(limits.lower.size() + model.gripper.size(), 0);
  limits.upper.resize(limits.upper.size() + model.gripper.size(), 1);
  return limits;
}

std::vector<double> Numbers(const action_t& action) {
  std::vector<double> numbers = action.joint_position_rad;
  numbers.insert(numbers.end(), action.gripper_closing.begin(), action.gripper_closing.end());
  return numbers;
}

void Append(const double* numbers, size_t count, std::vector<double>* to) {
  to->insert(to->end(), numbers, numbers + count);
}

// Returns the observation of a state as named arrays, in a fixed order.
std::vector<std::pair<std::string, std::vector<double>>> Observe(const model_info_t& model,
                                                                 const state_t& state) {
  std::vector<std::pair<std::string, std::vector<double>>> result;
  std::vector<double> positions, velocities, openings;
  for (const arm_state_t& arm : state.arm) {
    positions.insert(positions.end(), arm.joint_position_rad.begin(), arm.joint_position_rad.end());
    velocities.insert(velocities.end(), arm.joint_velocity_radps.begin(), arm.joint_velocity_radps.end());
  }
  for (const gripper_state_t& gripper : state.gripper) openings.push_back(gripper.opening);
  result.emplace_back("joint_position", std::move(positions));
  if (model.has_velocity) result.emplace_back("joint_velocity", std::move(velocities));
  result.emplace_back("gripper_opening", std::move(openings));
  for (size_t k = 0; k < state.arm.size(); ++k) {
    std::vector<double> pose;
    Append(state.arm[k].wrist_position_m, 3, &pose);
    Append(state.arm[k].wrist_quat_wxyz, 4, &pose);
    result.emplace_back(model.arm[k].name + "_wrist_pose", std::move(pose));
  }
  for (size_t k = 0; k < model.object_name.size(); ++k) {
    if (!model.object_is_tracked[k]) continue;
    const auto body = std::ranges::find(model.body_name, model.object_name[k]) - model.body_name.begin();
    if (body == static_cast<ptrdiff_t>(state.body.size())) continue;
    std::vector<double> pose;
    Append(state.body[static_cast<size_t>(body)].position_m, 3, &pose);
    Append(state.body[static_cast<size_t>(body)].quat_wxyz, 4, &pose);
    result.emplace_back(model.object_name[k] + "_pose", std::move(pose));
  }
  return result;
}

// Returns true if a state has as many bodies, arms, joints and grippers as the model, and as many coordinates
// as the first state.
bool Fits(const state_t& state, const model_info_t& model, const state_t& first) {
  const auto has_joints = [&](const arm_state_t& arm, const arm_info_t& info) {
    const auto n = static_cast<size_t>(info.num_joints);
    return arm.joint_position_rad.size() == n &&
           (!model.has_velocity || arm.joint_velocity_radps.size() == n);
  };
  return state.body.size() == model.body_name.size() && state.gripper.size() == model.gripper.size() &&
         std::ranges::equal(state.arm, model.arm, has_joints) &&
         state.qpos_mixed.size() == first.qpos_mixed.size() &&
         state.qvel_mixed.size() == first.qvel_mixed.size();
}

// Returns the action that the robot executed from a tick to the next one, in real time. A tick without an
// ACTION in time held the action that had arrived last, which the next STATE shows.
std::optional<action_t> HeldAction(const state_t& state, const state_t& next) {
  if (next.deadline_misses == state.deadline_misses) return std::nullopt;
  action_t action{};
  action.header = state.header;
  for (const arm_state_t& arm : next.arm) {
    action.joint_position_rad.insert(action.joint_position_rad.end(), arm.joint_command_rad.begin(),
                                     arm.joint_command_rad.end());
  }
  for (const gripper_state_t& gripper : next.gripper)
    action.gripper_closing.push_back(gripper.closing_command);
  return action;
}

// Returns the task and the robot, for example "lift_pot/position with bimanual_panda".
std::string NameOf(const model_info_t& model) {
  return model.task + "/" + model.variation + " with " + model.robot;
}

// Returns RoboEval's class name of the task; empty if RoboEval does not have the task.
std::string RoboEvalName(const model_info_t& model) {
  const TaskDescription task = ParseTask(model.task_yaml, model.task_file, false);
  return task.variation(model.variation).alias;
}

// Indices of the robot's joints, including fingers, in qpos and qvel, in the order of MODEL.
struct RobotIndices {
  std::vector<size_t> qpos, qvel;
};
RobotIndices IndicesOfRobot(const model_info_t& model) {
  RobotIndices indices;
  size_t dof = 0;
  for (size_t j = 0; j < model.joint_name.size(); ++j) {
    const auto first = static_cast<size_t>(model.joint_qpos_index[j]);
    const bool is_robots = std::ranges::any_of(
        model.arm, [&](const arm_info_t& arm) { return model.joint_name[j].starts_with(arm.name + "/"); });
    if (is_robots) {
      indices.qpos.push_back(first);
      indices.qvel.push_back(dof);
    }
    const auto last =
        j + 1 < model.joint_name.size() ? static_cast<size_t>(model.joint_qpos_index[j + 1]) : first + 1;
    // A free joint has 7 coordinates and 6 velocities; a ball joint has 4 and 3.
    dof += last - first == 1 ? 1 : last - first - 1;
  }
  return indices;
}

// Returns the episode's line of kStarts.
std::string StartLine(const EpisodeSteps& episode) {
  const model_info_t& model = episode.model;
  nlohmann::ordered_json line = {{"task", model.task + "/" + model.variation}, {"parameters", nullptr}};
  if (model.source == source_name::kSim) line["parameters"] = metrics::ParametersJson(episode.begin);
  return ToText(line);
}

// Throws EnvironmentError if the user has asked the program to stop. out: the file or folder to write.
void CheckStop(const fs::path& out) {
  if (stop_requested()) throw EnvironmentError("stopped; " + out.string() + " was not written");
}

void WriteDemo(const EpisodeSteps& episode, const std::string& path, Hdf5File* file) {
  const auto steps = static_cast<int64_t>(episode.actions.size());
  const Limits limits = ActionLimits(episode.model);
  const auto width = static_cast<int64_t>(limits.lower.size());
  std::vector<double> raw, scaled, rewards(episode.actions.size()), dones(episode.actions.size());
  for (const action_t& action : episode.actions) {
    const std::vector<double> numbers = Numbers(action);
    for (size_t k = 0; k < numbers.size(); ++k) {
      raw.push_back(numbers[k]);
      const double share = (numbers[k] - limits.lower[k]) / (limits.upper[k] - limits.lower[k]);
      scaled.push_back(std::clamp(2 * share - 1, -1.0, 1.0));
    }
  }
  dones.back() = 1;
  if (episode.success()) rewards.back() = 1;
  file->Write(path + "/actions", scaled, {steps, width});
  file->Write(path + "/actions_raw", raw, {steps, width});
  file->Write(path + "/rewards", rewards, {steps});
  file->Write(path + "/dones", dones, {steps});
  file->SetAttribute(path, "num_samples", steps);
  file->SetAttribute(path, "seed", episode.begin.seed);
  file->SetAttribute(path, "episode", int64_t{episode.begin.header.episode});
  file->SetAttribute(path, "action_min", limits.lower);
  file->SetAttribute(path, "action_max", limits.upper);

  // Episodes of a real robot or an external simulator have no MuJoCo coordinates.
  if (episode.model.has_physics) {
    std::vector<double> states;
    for (int64_t i = 0; i < steps; ++i) {
      const state_t& state = episode.states[static_cast<size_t>(i)];
      states.insert(states.end(), state.qpos_mixed.begin(), state.qpos_mixed.end());
      states.insert(states.end(), state.qvel_mixed.begin(), state.qvel_mixed.end());
    }
    file->Write(path + "/states", states, {steps, static_cast<int64_t>(states.size()) / steps});
  }
  for (const auto& [group, first] : {std::pair("/obs/", size_t{0}), std::pair("/next_obs/", size_t{1})}) {
    std::vector<std::pair<std::string, std::vector<double>>> all;
    for (size_t i = 0; i < episode.actions.size(); ++i) {
      auto observation = Observe(episode.model, episode.states[i + first]);
      if (all.empty()) {
        all = std::move(observation);
        continue;
      }
      for (size_t k = 0; k < all.size(); ++k)
        Append(observation[k].second.data(), observation[k].second.size(), &all[k].second);
    }
    for (const auto& [name, numbers] : all) {
      file->Write(path + group + name, numbers, {steps, static_cast<int64_t>(numbers.size()) / steps});
    }
  }
}

}  // namespace

EpisodeSteps ReadSteps(const fs::path& log) {
  const auto fail = [&](const std::string& what) { throw InputError(log.string() + ": " + what); };
  EpisodeReader reader(log, {channels::kState, channels::kAction});
  std::optional<EpisodeMessages> last;
  for (EpisodeMessages read; reader.Next(&read); last = std::move(read)) {
    if (last && last->number() != read.number())
      fail("holds several episodes; expected a log of one episode");
  }
  if (const std::string why = reader.WhyNotWhole(last ? &*last : nullptr); !why.empty()) fail(why);
  const std::vector<action_t>& actions = last->actions;
  EpisodeSteps episode;
  episode.log = log;
  episode.model = *std::move(last->model);
  episode.begin = *std::move(last->begin);
  episode.states = std::move(last->states);
  episode.summary = std::move(last->summary);
  const std::vector<state_t>& states = episode.states;
  const auto num_ticks = static_cast<size_t>(last->end->header.tick + 1);
  size_t at = 0;
  for (size_t i = 0; i < num_ticks; ++i) {
    if (i == states.size() || states[i].header.tick != static_cast<int64_t>(i))
      fail(fmt::format("tick {} is missing", i));
    if (!Fits(states[i], episode.model, states[0]))
      fail(fmt::format("STATE of tick {} does not fit MODEL", i));
    if (i == 0) continue;
    const auto tick = static_cast<int64_t>(i - 1);
    if (const auto held = HeldAction(states[i - 1], states[i])) {
      episode.actions.push_back(*held);
      continue;
    }
    while (at < actions.size() && actions[at].header.tick < tick) ++at;
    if (at == actions.size() || actions[at].header.tick != tick)
      fail(fmt::format("no action for tick {}: a training set requires an action for every tick", tick));
    episode.actions.push_back(actions[at]);
  }
  const size_t width = ActionLimits(episode.model).lower.size();
  for (const action_t& action : episode.actions) {
    if (Numbers(action).size() != width) fail("an action does not fit this robot");
  }
  if (episode.actions.empty()) fail("no tick was simulated");
  if (episode.model.object_is_tracked.size() != episode.model.object_name.size()) fail("MODEL is damaged");
  return episode;
}

void WriteRobomimic(const std::vector<fs::path>& logs, const fs::path& file, const ImageOptions& images,
                    const std::function<void(double)>& progress) {
  // All logs are checked before the first image is rendered or the file is written.
  std::string task;
  for (const fs::path& log : logs) {
    CheckStop(file);
    const std::string name = NameOf(ReadSteps(log).model);
    if (task.empty()) task = name;
    if (name != task)
      throw InputError(log.string() + ": recorded on " + name + ", expected " + task +
                       ", as in the first log");
  }
  std::optional<DrawnImages> drawn;
  if (!images.cameras.empty()) {
    drawn.emplace(logs, images, file.string() + ".images");
    drawn->Draw(progress);
  }
  Hdf5File out(file);
  std::vector<std::string> all, successes, starts;
  int64_t total = 0;
  for (size_t i = 0; i < logs.size(); ++i) {
    CheckStop(file);
    const EpisodeSteps episode = ReadSteps(logs[i]);
    const model_info_t& model = episode.model;
    const std::string demo = "demo_" + std::to_string(i), path = "data/" + demo;
    WriteDemo(episode, path, &out);
    if (drawn) {
      const std::vector<std::string> deflated = drawn->Of(i);
      for (size_t k = 0; k < images.cameras.size(); ++k) {
        std::vector<std::string_view> rows;
        for (size_t at = k; at < deflated.size(); at += images.cameras.size()) rows.push_back(deflated[at]);
        // A "/" is replaced, because it would create a group in the HDF5 file.
        std::string name = images.cameras[k] + "_image";
        std::ranges::replace(name, '/', '_');
        const std::string now = path + "/obs/" + name, last = path + "/last_obs/" + name;
        out.WriteDeflated(now, {images.height, images.width, 3}, {rows.begin(), rows.end() - 1});
        out.WriteDeflated(last, {images.height, images.width, 3}, {rows.back()});
        const auto steps = static_cast<int64_t>(rows.size() - 1);
        out.WriteShifted(path + "/next_obs/" + name, {steps, images.height, images.width, 3}, now, last);
      }
    }
    if (i == 0) {
      nlohmann::ordered_json joints, grippers = nlohmann::ordered_json::array();
      for (const arm_info_t& arm : model.arm) joints[arm.name] = arm.num_joints;
      for (const gripper_info_t& gripper : model.gripper) grippers.push_back(gripper.name);
      const nlohmann::ordered_json arguments = {{"env_name", model.task},
                                                {"env_type", 2},
                                                {"env_kwargs",
                                                 {{"variation", model.variation},
                                                  {"robot", model.robot},
                                                  {"num_joints", joints},
                                                  {"grippers", grippers},
                                                  {"control_hz", 1 / ControlPeriod(model)},
                                                  {"instruction", model.instruction}}}};
      out.SetAttribute("data", "env_args", ToText(arguments));
    }
    total += static_cast<int64_t>(episode.actions.size());
    all.push_back(demo);
    starts.push_back(StartLine(episode));
    if (episode.success()) successes.push_back(demo);
    if (!drawn) progress(static_cast<double>(i + 1) / static_cast<double>(logs.size()));
  }
  out.SetAttribute("data", "total", total);
  out.Write("mask/all", all);
  out.Write("mask/success", successes);
  out.Write(kStarts, starts);
  out.Finish();
  if (drawn) drawn->RemoveAll();
}

void WriteSafetensors(const std::vector<fs::path>& logs, const fs::path& folder,
                      const std::function<void(double)>& progress) {
  // All logs are read before the first file is written, so that an unusable log leaves no files behind.
  std::set<int64_t> known;
  for (const fs::path& log : logs) {
    CheckStop(folder);
    const EpisodeSteps episode = ReadSteps(log);
    const model_info_t& model = episode.model;
    const bool fits = model.num_arms == 2 && model.num_grippers == 2 && model.arm[0].num_joints == 7 &&
                      model.arm[1].num_joints == 7;
    if (!fits)
      throw InputError(log.string() +
                       ": RoboEval's layout requires two arms with 7 joints and a gripper each");
    if (!known.insert(episode.begin.header.episode).second)
      throw InputError(log.string() + ": its episode number also occurs in another log");
  }
  fs::create_directories(folder);
  std::string starts;
  std::vector<fs::path> files;
  for (size_t i = 0; i < logs.size(); ++i) {
    if (stop_requested()) {
      std::error_code ignored;
      for (const fs::path& file : files) fs::remove(file, ignored);
      // Keeps the folder if it contains other files, because removing it then fails.
      fs::remove(folder, ignored);
    }
    CheckStop(folder);
    const EpisodeSteps episode = ReadSteps(logs[i]);
    const model_info_t& model = episode.model;
    const auto steps = static_cast<int64_t>(episode.actions.size());
    const RobotIndices indices = IndicesOfRobot(model);
    std::vector<double> actions, proprioception, grippers, rewards(episode.actions.size());
    std::vector<uint8_t> terminated(episode.actions.size()), truncated(episode.actions.size());
    for (size_t k = 0; k < episode.actions.size(); ++k) {
      const std::vector<double> numbers = Numbers(episode.actions[k]);
      actions.insert(actions.end(), numbers.begin(), numbers.end());
      const state_t& state = episode.states[k];
      for (const size_t index : indices.qpos) proprioception.push_back(state.qpos_mixed.at(index));
      for (const size_t index : indices.qvel) proprioception.push_back(state.qvel_mixed.at(index));
      for (const gripper_state_t& gripper : state.gripper) {
        grippers.push_back(std::round(10 * gripper.opening) / 10);
      }
    }
    rewards.back() = episode.success() ? 1 : 0;
    (episode.success() ? terminated : truncated).back() = 1;
    Safetensors content;
    content.tensors = {{"info_demo_action", DoubleTensor(actions, {steps, 16})}};
    if (model.has_physics) {
      const auto width = static_cast<int64_t>(2 * indices.qpos.size());
      content.tensors.emplace_back("obs_proprioception", DoubleTensor(proprioception, {steps, width}));
    }
    content.tensors.emplace_back("obs_proprioception_grippers", DoubleTensor(grippers, {steps, 2}));
    content.tensors.emplace_back("reward", DoubleTensor(rewards, {steps}));
    content.tensors.emplace_back("termination", ByteTensor(terminated, {steps}, "BOOL"));
    content.tensors.emplace_back("truncation", ByteTensor(truncated, {steps}, "BOOL"));
    const std::string name = RoboEvalName(model);
    const nlohmann::ordered_json environment = {
        {"env_name", name.empty() ? model.task : name},
        {"action_mode_name", "JointPositionActionMode"},
        {"floating_base", false},
        {"observation_config",
         {{"cameras", nlohmann::ordered_json::array()},
          {"proprioception", true},
          {"privileged_information", false}}},
        {"end_effector_mode", false},
        {"action_mode_absolute", true},
        {"floating_dofs", nlohmann::ordered_json::array()},
        {"reset_positions", nlohmann::ordered_json::array()},
        {"robot_name", model.robot == "bimanual_panda" ? "BimanualPanda" : model.robot}};
    content.metadata = {{"seed", std::to_string(episode.begin.seed)},
                        {"observation_mode", "\"state\""},
                        {"environment_data", ToText(environment)},
                        {"package_versions", "{}"},
                        {"control_frequency", fmt::format("{:g}", 1 / ControlPeriod(model))},
                        {"success", episode.success() ? "true" : "false"}};
    const fs::path file = folder / fmt::format("{:04}.safetensors", episode.begin.header.episode);
    WriteWhole(file, EncodeSafetensors(content));
    files.push_back(file);
    starts += StartLine(episode) + "\n";
    progress(static_cast<double>(i + 1) / static_cast<double>(logs.size()));
  }
  WriteWhole(folder / (std::string(kStarts) + ".jsonl"), starts);
}

}  // namespace evalbus::exports
