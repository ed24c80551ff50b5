#include <algorithm>

#include "sim/world.h"

namespace evalbus::sim {

World::Snapshot World::Save() const {
  const mjData& d = *data_;
  const auto copy = [](const mjtNum* values, int count) {
    return std::vector<double>(values, values + count);
  };
  Snapshot snapshot{.qpos = stepped_qpos_,
                    .qvel = copy(d.qvel, model_->nv),
                    .act = copy(d.act, model_->na),
                    .ctrl = copy(d.ctrl, model_->nu),
                    .warm_start = copy(d.qacc_warmstart, model_->nv),
                    .mocap_pos = copy(d.mocap_pos, 3 * model_->nmocap),
                    .mocap_quat = copy(d.mocap_quat, 4 * model_->nmocap),
                    .work = {},
                    .forces = forces_,
                    .time = d.time,
                    .action_clips = action_clips_,
                    .unreachable_poses = unreachable_poses_,
                    .singular_poses = singular_poses_};
  for (const Arm& arm : arms_) snapshot.work.push_back(arm.work);
  return snapshot;
}

void World::Restore(const Snapshot& snapshot) {
  mj_resetData(model_, data_.get());
  std::ranges::copy(snapshot.qpos, data_->qpos);
  std::ranges::copy(snapshot.qvel, data_->qvel);
  std::ranges::copy(snapshot.act, data_->act);
  std::ranges::copy(snapshot.ctrl, data_->ctrl);
  std::ranges::copy(snapshot.warm_start, data_->qacc_warmstart);
  std::ranges::copy(snapshot.mocap_pos, data_->mocap_pos);
  std::ranges::copy(snapshot.mocap_quat, data_->mocap_quat);
  data_->time = snapshot.time;
  for (size_t i = 0; i < arms_.size(); ++i) arms_[i].work = snapshot.work[i];
  forces_ = snapshot.forces;
  action_clips_ = snapshot.action_clips;
  unreachable_poses_ = snapshot.unreachable_poses;
  singular_poses_ = snapshot.singular_poses;
  instability_.clear();
  Prepare();
}

}  // namespace evalbus::sim
