// Input of the metric accumulators: one control tick as plain numbers. World frame, SI units. The spans point
// into the caller's memory and are read only during the call.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace evalbus::metrics {

enum class GeomOwner : uint8_t {
  kScene,   // everything that is neither robot nor manipulated object
  kRobot,   // arms, grippers, base
  kObject,  // manipulated objects of the task; touching them is not a collision
};

// Owner of each geom id. Ids outside the table have no owner.
class GeomOwners {
 public:
  GeomOwners() = default;
  explicit GeomOwners(std::vector<GeomOwner> owner) : owner_(std::move(owner)) {}
  bool IsRobot(int geom) const { return Is(geom, GeomOwner::kRobot); }
  bool IsScene(int geom) const { return Is(geom, GeomOwner::kScene); }

 private:
  bool Is(int geom, GeomOwner owner) const {
    return geom >= 0 && static_cast<size_t>(geom) < owner_.size() && owner_[geom] == owner;
  }
  std::vector<GeomOwner> owner_;
};

// A pair of geoms and its signed distance (m, negative in penetration). The geoms come in either order, and a
// pair may occur more than once.
struct GeomContact {
  int geom_a;
  int geom_b;
  double distance;
};

// State at tick 0, which does not count as a sample. `holding` is indexed as in Sample.
struct ResetState {
  std::span<const double> gripper_opening;
  std::span<const uint8_t> holding;
};

struct ArmSample {
  std::span<const double> joint_position;      // rad
  std::span<const double> joint_velocity;      // rad/s, measured
  std::array<double, 3> wrist_position = {};   // m
  std::array<double, 4> wrist_quat = {};       // (w, x, y, z), any positive norm
  std::optional<double> mechanical_work = {};  // J since tick 0; empty if unknown
  // Both empty if unknown: largest absolute torque of each joint during the tick (N m), and the commanded
  // position that was in force during it (rad).
  std::span<const double> joint_torque_peak = {};
  std::span<const double> joint_command = {};
};

// Grip force of a gripper during a tick (state_t.gripper).
struct GripSample {
  double peak;     // N
  double impulse;  // integral of the force over time, N s
  double time;     // time for which the force was above 0, s
};

// Contact forces of the robot during a tick. Only sources with a physics engine provide them.
struct ForceSample {
  // Each has one value per physics step in which the robot pressed on the scene, on a manipulated object, or
  // on itself: the largest force of a pair of bodies, N.
  std::span<const double> scene, object, self;
  // Integral over time of the forces of the robot's contacts with the scene and with itself (N s), and the
  // largest kinetic energy with which such a contact began in this tick (J).
  double unwanted_impulse = 0;
  double unwanted_touch_energy = 0;
  std::span<const GripSample> grip = {};  // in the order of MetricsConfig::grippers
};

struct Sample {
  int64_t tick;                             // 1, 2, ...; 0 is the reset state, not a sample
  double time;                              // simulated time since the episode began, s
  std::span<const ArmSample> arm;           // in the order of MetricsConfig::arms
  std::span<const double> gripper_opening;  // 0 closed, 1 open
  std::span<const uint8_t> holding;         // [object * number of grippers + gripper]
  std::span<const uint8_t> pinched = {};    // same index: pads of both fingers touch it; empty if unknown
  std::span<const GeomContact> contacts;
  std::optional<double> clearance = {};    // m, from robot to scene; empty if not evaluated
  std::optional<ForceSample> forces = {};  // empty if unknown
};

}  // namespace evalbus::metrics
