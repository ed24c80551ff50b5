// Reads the contact points of a MuJoCo simulation, with their forces.
#pragma once

#include <mujoco/mujoco.h>

#include <span>
#include <vector>

#include "evalbus/model_info_t.hpp"
#include "sim/force_sums.h"

namespace evalbus::sim {

class ContactPoints {
 public:
  // `info` must describe `model`.
  ContactPoints(const mjModel& model, const model_info_t& info);

  // Returns the number of fingers (bodies with pads) of each gripper.
  const std::vector<int>& fingers() const { return fingers_; }

  // Reads the contacts of a physics step. Must be called between mj_step1 and mj_step2 of this step, and be
  // followed by AfterStep() for the same step. touched: force sums up to the previous step.
  void BeforeStep(const mjModel& model, mjData* data, const ForceSums& touched);
  // Reads the forces of these contacts. Must be called after mj_step2 of the same step. The result is valid
  // until the next BeforeStep().
  std::span<const ContactPoint> AfterStep(const mjModel& model, const mjData& data);

 private:
  // Returns the kind (contact_force_t) of a contact of two geoms; -1 if such contacts are ignored.
  int8_t Kind(int geom_a, int geom_b) const;
  // Returns the kinetic energy of the approach, 1/2 m v^2. v is the speed at which the two surfaces approach
  // along the normal. m is the effective mass, the inverse of J M^-1 J^T. 0 if the surfaces move apart.
  double TouchEnergy(const mjModel& model, mjData* data, const mjContact& contact);

  struct Geom {
    bool is_robot = false, is_object = false;
    // True for a geom of a manipulated object that must not be touched.
    bool is_forbidden = false;
    // Indices of the geom's manipulated object, of its finger (counted over all grippers), and of its
    // gripper; -1: none.
    int object = -1, finger = -1, gripper = -1;
  };
  std::vector<Geom> geoms_;
  std::vector<int> fingers_;
  std::vector<ContactPoint> points_;
  // Index in mjData of each point's contact.
  std::vector<int> contacts_;
  // Jacobians of the two bodies at the contact, their difference projected onto the normal, and M^-1 times
  // this difference.
  std::vector<mjtNum> jacobian_a_, jacobian_b_, normal_, solved_;
};

}  // namespace evalbus::sim
