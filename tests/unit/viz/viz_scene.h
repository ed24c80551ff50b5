// The LiftPot scene and a log of it, for tests of viz/.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/sha256.h"
#include "bus/channels.h"
#include "bus/event_log.h"
#include "bus/message.h"
#include "evalbus/episode_begin_t.hpp"
#include "evalbus/episode_end_t.hpp"
#include "evalbus/partial_metrics_t.hpp"
#include "evalbus/state_t.hpp"
#include "models/scene.h"

namespace evalbus::viz {

inline Scene LiftPotScene() {
  const TaskSelection selection = FindTask("lift_pot");
  return BuildScene(selection.task, LoadRobot(selection.task.robot_file, {}));
}

inline ModelPtr Copy(const mjModel& model) { return ModelPtr(mj_copyModel(nullptr, &model)); }

inline int QposIndex(const mjModel& model, const std::string& joint) {
  return model.jnt_qposadr[mj_name2id(&model, mjOBJ_JOINT, joint.c_str())];
}

// Returns positions with the arms in front of their bases and the hands above the counter.
inline std::vector<double> HomeQpos(const mjModel& model) {
  std::vector<double> qpos(model.qpos0, model.qpos0 + model.nq);
  const double home[7] = {0, 0, 0, -1.57, 0, 1.57, -0.785};
  for (const std::string arm : {"left", "right"}) {
    for (int j = 0; j < 7; ++j) {
      qpos[static_cast<size_t>(QposIndex(model, arm + "/joint" + std::to_string(j + 1)))] = home[j];
    }
  }
  return qpos;
}

// Returns everything that a renderer needs for a scene without mocap bodies.
inline state_t StateOf(const std::vector<double>& qpos) {
  state_t state{};
  state.num_qpos = static_cast<int32_t>(qpos.size());
  state.qpos_mixed = qpos;
  return state;
}

// Returns MODEL of a scene and writes its visual model to RUN/model/visual.mjb.
inline model_info_t VisualInfo(const std::filesystem::path& run, const mjModel& visual) {
  std::filesystem::create_directories(run / "model");
  model_info_t info{};
  info.message_version = model_info_t::VERSION;
  info.task = "lift_pot";
  info.variation = "base";
  info.robot = "bimanual_panda";
  info.task_yaml = FindTask("lift_pot").task.text;
  info.timestep_us = 2000;
  info.substeps = 10;
  info.visual_file = run / "model/visual.mjb";
  mj_saveModel(&visual, info.visual_file.c_str(), nullptr, 0);
  info.visual_sha256 = Sha256File(info.visual_file);
  return info;
}

// Writes RUN/model/visual.mjb and RUN/episodes/0000/events.lcmlog with an episode that has these states and
// two stages, one of which is reached at the first tick. Returns the log.
inline std::filesystem::path WriteRun(const std::filesystem::path& run, const mjModel& visual,
                                      int64_t tick_us, const std::vector<std::vector<double>>& qpos,
                                      const std::string& end_reason = "success") {
  std::filesystem::create_directories(run / "episodes/0000");
  const model_info_t info = VisualInfo(run, visual);
  const std::filesystem::path file = run / "episodes/0000/events.lcmlog";
  EventLogWriter log(file);
  const auto write = [&log](std::string_view channel, const auto& message, int64_t time_us) {
    log.Write(channel, Encode(message), time_us);
  };
  write(channels::kModel, info, 0);
  episode_begin_t begin{};
  begin.seed = 7;
  write(channels::kEpisodeBegin, begin, 0);
  partial_metrics_t partial{};
  partial.metrics.num_stages = 2;
  partial.metrics.stage_index = {1, 2};
  partial.metrics.stage_name = {"pot_lifted", "pot_held_level"};
  partial.metrics.stage_reached = {1, 0};
  partial.metrics.tracks_slippage = partial.metrics.tracks_collisions = true;
  state_t state{};
  for (size_t i = 0; i < qpos.size(); ++i) {
    state = StateOf(qpos[i]);
    state.header.tick = partial.header.tick = static_cast<int64_t>(i);
    state.header.sim_time_us = partial.header.sim_time_us = static_cast<int64_t>(i) * tick_us;
    write(channels::kState, state, state.header.sim_time_us);
    write(channels::kPartial, partial, state.header.sim_time_us);
  }
  if (!end_reason.empty()) {
    episode_end_t end{};
    end.header = state.header;
    end.end_reason = end_reason;
    write(channels::kEpisodeEnd, end, end.header.sim_time_us);
  }
  log.Close();
  return file;
}

}  // namespace evalbus::viz
