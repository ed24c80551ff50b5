// Grasps of a running episode. EPISODE_SUMMARY lists an episode's grasps with gripper, object and duration;
// until it arrives, this class derives the same list from CONTACTS and PARTIAL. Pure.
#pragma once

#include <cstdint>
#include <vector>

#include "evalbus/contacts_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "evalbus/partial_metrics_t.hpp"
#include "models/model_names.h"

namespace evalbus::viz {

class GraspWatch {
 public:
  // From the first to the last tick at which pads of all fingers of the gripper touched the object.
  struct Grasp {
    int object, gripper;  // indices in MODEL
    int64_t first_tick, last_tick;
  };

  // names.model() must outlive this object.
  explicit GraspWatch(const ModelNames& names);

  // The pairs (object * number of grippers + gripper) in which pads of all fingers touch the object.
  std::vector<uint16_t> Pinched(const contacts_t& contacts) const;
  // Processes the tick of `now`. before: the previous PARTIAL; pinched: the pairs at this tick.
  void Add(const partial_metrics_t& before, const partial_metrics_t& now,
           const std::vector<uint16_t>& pinched);

  // In order of their first tick. The last tick of a grasp advances while it lasts.
  const std::vector<Grasp>& grasps() const { return grasps_; }

 private:
  const model_info_t& model_;
  // By geom: index of the object; index of the gripper and bit of the finger whose pad it is. -1: none.
  std::vector<int> object_, gripper_;
  std::vector<uint32_t> finger_bit_;
  // By gripper: the bits of all its fingers.
  std::vector<uint32_t> all_fingers_;
  std::vector<Grasp> grasps_;
  // By pair: index of its latest grasp, -1: none.
  std::vector<int> latest_;
};

}  // namespace evalbus::viz
