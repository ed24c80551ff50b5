// Finds the grasps of a running episode. EPISODE_SUMMARY lists an episode's grasps with gripper, object and
// duration. Until it arrives, this class derives the same list from CONTACTS and PARTIAL. Pure.
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
  // A grasp lasts from the first to the last tick at which pads on all fingers of the gripper touched the
  // object.
  struct Grasp {
    int object, gripper;  // indices in MODEL
    int64_t first_tick, last_tick;
  };

  // names.model() must outlive this object.
  explicit GraspWatch(const ModelNames& names);

  // Returns the pairs (object * number of grippers + gripper) in which pads on all fingers touch the object.
  std::vector<uint16_t> Pinched(const contacts_t& contacts) const;
  // Processes the tick of `now`. before: the previous PARTIAL. pinched: result of Pinched() for this tick.
  void Add(const partial_metrics_t& before, const partial_metrics_t& now,
           const std::vector<uint16_t>& pinched);

  // All grasps in the order of their first tick. While a grasp lasts, its last tick increases.
  const std::vector<Grasp>& grasps() const { return grasps_; }

 private:
  const model_info_t& model_;
  // Index of the object of each geom; and, if the geom is a pad, index of its gripper and bit of its finger.
  // An index is -1 if there is none.
  std::vector<int> object_, gripper_;
  std::vector<uint32_t> finger_bit_;
  // Bits of all fingers of each gripper.
  std::vector<uint32_t> all_fingers_;
  std::vector<Grasp> grasps_;
  // Index of the latest grasp of each pair; -1 if there is none.
  std::vector<int> latest_;
};

}  // namespace evalbus::viz
