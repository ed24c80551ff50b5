// Combines the contact forces of the physics steps of a control tick: sums and peaks for each pair of bodies
// and each gripper, and the largest force of each step for what the robot touches (scene, object or itself).
// Pure; reuses its storage.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "evalbus/state_t.hpp"

namespace evalbus::sim {

// One contact point in one physics step.
struct ContactPoint {
  int8_t kind;  // as in contact_force_t
  int body_a;   // < body_b
  int body_b;
  std::array<double, 3> force;  // on body_b, world frame, N
  double normal_force;          // N
  // If a finger touches a manipulated object at this point: index of the finger, counted over all grippers,
  // and index of the object. Otherwise -1.
  int finger = -1;
  int object = -1;
  double touch_energy = 0;  // J; 0 unless the pair begins to touch in this step
};

class ForceSums {
 public:
  // fingers: number of fingers of each gripper.
  ForceSums(std::vector<int> fingers, int objects, double timestep);

  // Begins an episode.
  void Start();
  // Begins a control tick.
  void StartTick();
  void AddStep(std::span<const ContactPoint> points);

  // Returns whether the pair of bodies touched in the last step.
  bool Touched(int8_t kind, int body_a, int body_b) const;

  // Fills the force members of *state and of state->gripper, which must already have its final size. Reuses
  // the storage of *state.
  void Fill(state_t* state) const;

 private:
  struct Pair {
    int8_t kind;
    int body_a, body_b;
    bool touches = false;  // in the current step
    std::array<double, 3> force{};
    double peak = 0, sum = 0;
    std::array<double, 3> impulse{};
    double touch_energy = 0;

    bool Is(int8_t its_kind, int a, int b) const { return kind == its_kind && body_a == a && body_b == b; }
  };
  struct Grip {
    double peak = 0, sum = 0;
    int64_t steps = 0;
  };

  // Returns the pair of the point's bodies, and adds it if it is not in pairs_ yet.
  Pair& Find(const ContactPoint& point);
  // Adds the grip forces of the current step.
  void AddGrips();

  std::vector<int> fingers_;
  size_t objects_;
  double timestep_;
  // Pairs that have touched in this tick or in the last step of the previous tick.
  std::vector<Pair> pairs_;
  int64_t steps_ = 0;
  // By contact kind (SCENE, OBJECT, SELF): the largest force in each physics step with such a force
  // (state_t.scene_force_N).
  std::array<std::vector<double>, 3> largest_;
  // Normal force of each finger on each object in the current step, indexed [finger * objects + object].
  std::vector<double> finger_force_;
  std::vector<Grip> grips_;
};

}  // namespace evalbus::sim
