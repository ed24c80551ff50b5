#include "viz/viewer/grasp_watch.h"

#include <cmath>
#include <map>
#include <string>

#include "lcmtypes/extended_value.h"

namespace evalbus::viz {
namespace {

// Returns the number of grasps, or NaN if the source does not provide the objects' poses.
double GraspCount(const partial_metrics_t& partial, const model_info_t& model, size_t gripper) {
  const std::string name = "grasp_count";
  return ExtendedValue(partial.extended,
                       model.num_grippers > 1 ? name + "." + model.gripper[gripper].name : name);
}

}  // namespace

GraspWatch::GraspWatch(const ModelNames& names)
    : model_(names.model()),
      object_(model_.geom_name.size(), -1),
      gripper_(model_.geom_name.size(), -1),
      finger_bit_(model_.geom_name.size(), 0),
      latest_(model_.object_name.size() * model_.gripper.size(), -1) {
  for (int object = 0; object < model_.num_objects; ++object) {
    const std::vector<uint8_t> geoms = names.ObjectGeoms(object);
    for (size_t geom = 0; geom < geoms.size(); ++geom) {
      if (geoms[geom]) object_[geom] = object;
    }
  }
  for (size_t gripper = 0; gripper < model_.gripper.size(); ++gripper) {
    // A finger is a body with pads.
    std::map<int, uint32_t> bit_of_body;
    uint32_t all = 0;
    for (const int pad : model_.gripper[gripper].pad_geom) {
      const auto geom = static_cast<size_t>(pad);
      const uint32_t bit =
          bit_of_body.emplace(model_.geom_body[geom], 1U << (bit_of_body.size() % 32)).first->second;
      gripper_[geom] = static_cast<int>(gripper);
      finger_bit_[geom] = bit;
      all |= bit;
    }
    all_fingers_.push_back(all);
  }
}

std::vector<uint16_t> GraspWatch::Pinched(const contacts_t& contacts) const {
  const size_t grippers = all_fingers_.size();
  std::map<size_t, uint32_t> touching;
  const auto watch = [&](size_t pad, size_t wall) {
    if (gripper_[pad] < 0 || object_[wall] < 0) return;
    const auto pair = static_cast<size_t>(object_[wall]) * grippers + static_cast<size_t>(gripper_[pad]);
    touching[pair] |= finger_bit_[pad];
  };
  for (const contact_t& contact : contacts.contact) {
    if (!(contact.distance_m <= contact_t::TOUCH_DISTANCE_M)) continue;
    const auto a = static_cast<size_t>(contact.geom_a), b = static_cast<size_t>(contact.geom_b);
    watch(a, b);
    watch(b, a);
  }
  std::vector<uint16_t> pinched;
  for (const auto& [pair, fingers] : touching) {
    if (fingers == all_fingers_[pair % grippers]) pinched.push_back(static_cast<uint16_t>(pair));
  }
  return pinched;
}

void GraspWatch::Add(const partial_metrics_t& before, const partial_metrics_t& now,
                     const std::vector<uint16_t>& pinched) {
  // Ticks that the metrics do not use, such as ticks after the verdict, do not count.
  if (now.metrics.num_samples <= before.metrics.num_samples) return;
  const int64_t tick = now.header.tick;
  const size_t grippers = all_fingers_.size();
  for (const uint16_t pair : pinched) {
    const size_t gripper = pair % grippers;
    const double count = GraspCount(now, model_, gripper);
    if (std::isnan(count)) continue;
    // After an interruption, the grasp count of the metrics shows whether this is a new grasp.
    const bool is_counted = count > GraspCount(before, model_, gripper);
    int& latest = latest_[pair];
    const bool is_interrupted = latest >= 0 && grasps_[static_cast<size_t>(latest)].last_tick < tick - 1;
    if (latest < 0 || (is_interrupted && is_counted)) {
      latest = static_cast<int>(grasps_.size());
      grasps_.push_back({static_cast<int>(pair / grippers), static_cast<int>(gripper), tick, tick});
    }
    grasps_[static_cast<size_t>(latest)].last_tick = tick;
  }
}

}  // namespace evalbus::viz
