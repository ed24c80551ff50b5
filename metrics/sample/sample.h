// What the accumulators see: one control tick as plain numbers. World frame, SI units. The spans point into
// memory of the caller and are read only during the call.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace evalbus::metrics {

enum class GeomOwner : uint8_t {
  kScene,   // everything that is neither of the two below
  kRobot,   // arms, grippers, base
  kObject,  // manipulated objects of the task: touching them is no collision
};

// The owner of each geom id. Ids outside the table belong to nobody.
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

// A geom pair and its signed distance (m, negative in penetration), in either order, possibly more than once.
struct GeomContact {
  int geom_a;
  int geom_b;
  double distance;
};

// Tick 0, which is no sample. `holding` as in Sample.
struct ResetState {
  std::span<const double> gripper_opening;
  std::span<const uint8_t> holding;
};

struct ArmSample {
  std::span<const double> joint_position;  // rad
  std::span<const double> joint_velocity;  // rad/s, measured
  std::array<double, 3> wrist_position;    // m
  std::array<double, 4> wrist_quat;        // (w, x, y, z), any positive norm
  std::optional<double> mechanical_work;   // J, since tick 0; where known
};

struct Sample {
  int64_t tick;                             // 1, 2, ...; 0 is the reset state, which is no sample
  double time;                              // simulated seconds since the episode began
  std::span<const ArmSample> arm;           // as in MetricsConfig::arms
  std::span<const double> gripper_opening;  // 0 closed, 1 open
  std::span<const uint8_t> holding;         // [object * number of grippers + gripper]
  std::span<const uint8_t> pinched;         // likewise, held by pads of both fingers; empty where not known
  std::span<const GeomContact> contacts;
  std::optional<double> clearance;  // m, robot to scene, where it was evaluated
};

}  // namespace evalbus::metrics
