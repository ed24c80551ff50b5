#include "sim/roboeval_start.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <variant>
#include <vector>

#include "base/errors.h"
#include "base/legacy_random.h"
#include "sim/spawn_grid.h"

namespace evalbus::sim {
namespace {

// One random draw in the reset of a RoboEval class.
struct Draw {
  enum class Kind {
    // Numbers that RoboEval draws without effect, for example rotations whose bounds are zero.
    kSkip,
    // Points for all objects that share the object's spawn plane (get_random_points_on_plane).
    kPoints,
    // Offset of the object from its point, drawn by the class itself or by Prop.set_pose.
    kJitter,
    // Position in the object's spawn box (SpawnBoundary.sample).
    kBox,
    kYaw,
  } kind;
  std::string_view object;
  int count = 0;
};
constexpr Draw Skip(int count) { return {Draw::Kind::kSkip, "", count}; }
constexpr Draw Points(std::string_view object) { return {Draw::Kind::kPoints, object}; }
constexpr Draw Jitter(std::string_view object) { return {Draw::Kind::kJitter, object}; }
constexpr Draw Box(std::string_view object) { return {Draw::Kind::kBox, object}; }
constexpr Draw Yaw(std::string_view object) { return {Draw::Kind::kYaw, object}; }

// Returns the draws by RoboEval class. Prop.set_pose always draws three offsets and three rotations. Draws
// without bounds have no effect (Skip). Bounded offsets are a Jitter, and a bounded rotation is a Yaw (about
// y in VerticalCubeHandover).
const std::map<std::string_view, std::vector<Draw>>& Draws() {
  static const std::vector<Draw> valves = {Points("first_valve"), Jitter("first_valve"),
                                           Jitter("second_valve")};
  // RoboEval places both valves twice, once for each valve. Only the second placement counts.
  const auto placed_twice = [](std::vector<Draw> once, const std::vector<Draw>& then = {}) {
    std::vector<Draw> all = once;
    all.insert(all.end(), once.begin(), once.end());
    all.insert(all.end(), then.begin(), then.end());
    return all;
  };
  static const std::vector<Draw> turned_valves = {Points("first_valve"), Jitter("first_valve"),
                                                  Jitter("second_valve"), Yaw("first_valve"),
                                                  Yaw("second_valve")};
  static const std::map<std::string_view, std::vector<Draw>> draws = {
      {"LiftPotPosition", {Skip(6), Box("pot")}},
      {"LiftPotOrientation", {Skip(6), Yaw("pot")}},
      {"LiftPotPositionAndOrientation", {Skip(6), Box("pot"), Skip(6), Yaw("pot")}},
      {"StackTwoBlocksPosition", {Points("red_cube"), Jitter("red_cube"), Jitter("blue_cube")}},
      {"StackTwoBlocksOrientation", {Skip(12), Yaw("red_cube"), Yaw("blue_cube")}},
      {"StackTwoBlocksPositionAndOrientation",
       {Points("red_cube"), Skip(6), Jitter("red_cube"), Skip(2), Yaw("red_cube"), Jitter("blue_cube"),
        Skip(2), Yaw("blue_cube")}},
      {"CubeHandoverPosition", {Points("rod"), Skip(3), Jitter("rod")}},
      {"CubeHandoverOrientation", {Skip(5), Yaw("rod")}},
      {"CubeHandoverPositionAndOrientation", {Points("rod"), Skip(3), Jitter("rod"), Skip(2), Yaw("rod")}},
      {"VerticalCubeHandover", {Points("rod"), Skip(3), Jitter("rod"), Skip(1), Yaw("rod")}},
      {"RotateValvePosition", placed_twice(valves)},
      {"RotateValvePositionAndOrientation", placed_twice(turned_valves)},
      {"RotateValveObstacle",
       placed_twice(turned_valves, {Points("obstacle"), Jitter("obstacle"), Yaw("obstacle")})},
      {"PackBoxPosition", {Points("box"), Jitter("box")}},
      {"PackBoxOrientation", {Yaw("box")}},
      {"PackBoxPositionAndOrientation", {Points("box"), Jitter("box"), Yaw("box")}},
      {"LiftTrayPosition", {Points("tray"), Jitter("tray")}},
      {"LiftTrayOrientation", {Yaw("tray")}},
      {"LiftTrayPositionAndOrientation", {Points("tray"), Jitter("tray"), Yaw("tray")}},
      {"PickSingleBookFromTablePosition", {Points("book"), Jitter("book")}},
      {"PickSingleBookFromTableOrientation", {Yaw("book")}},
      {"PickSingleBookFromTablePositionAndOrientation", {Points("book"), Jitter("book"), Yaw("book")}},
      {"StackSingleBookShelfPosition", {Points("book"), Jitter("book")}},
      {"StackSingleBookShelfPositionAndOrientation", {Points("book"), Jitter("book"), Yaw("book")}},
  };
  return draws;
}

[[noreturn]] void Fail(const Variation& variation, const std::string& what) {
  throw InputError(fmt::format("{}: variation '{}' cannot start as in RoboEval: {}",
                               variation.location.ToString(), variation.name, what));
}

bool Sets(const SpawnBox& box, const Draw& draw) {
  return draw.kind == Draw::Kind::kBox && draw.object == box.object;
}
bool Sets(const SpawnPlane& plane, const Draw& draw) {
  return draw.kind == Draw::Kind::kJitter &&
         std::ranges::find(plane.objects, draw.object) != plane.objects.end();
}
bool Sets(const SpawnYaw& yaw, const Draw& draw) {
  return draw.kind == Draw::Kind::kYaw && draw.object == yaw.object;
}
bool Sets(const SpawnJoint&, const Draw&) { return false; }

const std::vector<Draw>& DrawsOf(const Variation& variation) {
  static const std::vector<Draw> none;
  if (!variation.distractors.empty()) Fail(variation, "it has distractors");
  if (variation.randomizations.empty()) return none;
  const auto found = Draws().find(variation.alias);
  if (found == Draws().end()) {
    Fail(variation, variation.alias.empty()
                        ? "it has no alias, the name of RoboEval's class"
                        : fmt::format("how RoboEval's class '{}' draws a start is unknown", variation.alias));
  }
  return found->second;
}

// Returns the variation's first spawn of type T that makes this draw. Throws InputError if there is none.
template <class T>
const T& SpawnOf(const Variation& variation, const Draw& draw) {
  for (const Randomization& randomization : variation.randomizations) {
    const T* const spawn = std::get_if<T>(&randomization);
    const Draw sets{std::is_same_v<T, SpawnPlane> ? Draw::Kind::kJitter : draw.kind, draw.object};
    if (spawn && Sets(*spawn, sets)) return *spawn;
  }
  Fail(variation, fmt::format("{} also draws a pose of '{}'", variation.alias, draw.object));
}

}  // namespace

void CheckRoboEvalStart(const Variation& variation) {
  DrawRoboEvalStart(variation, 0);
  const std::vector<Draw>& draws = DrawsOf(variation);
  for (const Randomization& randomization : variation.randomizations) {
    const bool is_drawn = std::visit(
        [&](const auto& spawn) {
          return std::ranges::any_of(draws, [&](const Draw& draw) { return Sets(spawn, draw); });
        },
        randomization);
    if (!is_drawn)
      Fail(variation,
           fmt::format("{} does not draw everything that the variation randomizes", variation.alias));
  }
}

std::map<std::string, RoboEvalPose> DrawRoboEvalStart(const Variation& variation, int64_t seed) {
  LegacyRandom random(static_cast<uint32_t>(seed));
  std::map<std::string, RoboEvalPose> poses;
  for (const Draw& draw : DrawsOf(variation)) {
    const std::string object(draw.object);
    switch (draw.kind) {
      case Draw::Kind::kSkip:
        for (int i = 0; i < draw.count; ++i) random.Double();
        break;
      case Draw::Kind::kPoints: {
        const SpawnGrid grid(SpawnOf<SpawnPlane>(variation, draw));
        const std::vector<int> points = random.Permutation(grid.size());
        for (size_t i = 0; i < grid.plane().objects.size(); ++i)
          poses[grid.plane().objects[i]].position = grid.Point(points[i]);
        break;
      }
      case Draw::Kind::kJitter:
        for (size_t axis = 0; axis < 3; ++axis) {
          const double bound = SpawnOf<SpawnPlane>(variation, draw).jitter[axis];
          poses[object].position[axis] += random.Uniform(-bound, bound);
        }
        break;
      case Draw::Kind::kBox: {
        const auto& box = SpawnOf<SpawnBox>(variation, draw);
        for (size_t axis = 0; axis < 2; ++axis) {
          poses[object].position[axis] = random.Uniform(box.center[axis] - box.half_extents[axis],
                                                        box.center[axis] + box.half_extents[axis]);
        }
        break;
      }
      case Draw::Kind::kYaw: {
        const double bound = SpawnOf<SpawnYaw>(variation, draw).bound;
        poses[object].yaw = random.Uniform(-bound, bound);
        break;
      }
    }
  }
  return poses;
}

}  // namespace evalbus::sim
