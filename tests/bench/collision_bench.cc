// Compares collision checking of the LiftPot scene with MuJoCo's own, and the broad phases that FCL offers.
//
// Every benchmark uses the same recorded poses, checks its result once against MuJoCo's touching pairs, and
// reports p50 and p99 per check. In "moving", both arms sweep above the counter, on which the pot stands. In
// "gripping", the pot hangs in the left hand, with its handle 0.1 mm inside each pad.
#include <benchmark/benchmark.h>
#include <fcl/broadphase/broadphase_SSaP.h>
#include <fcl/broadphase/broadphase_SaP.h>
#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/geometry/shape/box.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "collision/checker.h"
#include "collision/clearance_watch.h"
#include "models/scene.h"

namespace evalbus {
namespace {

using PairSet = std::set<std::pair<int, int>>;

struct Pose {
  std::vector<double> qpos;
  std::vector<double> position;
  std::vector<double> quat;
};

class LiftPot {
 public:
  static LiftPot& Get() {
    static LiftPot instance;
    return instance;
  }

  Scene scene;
  mjData* data;
  std::vector<Pose> moving;
  std::vector<Pose> gripping;

  void Set(const Pose& pose) {
    mju_copy(data->qpos, pose.qpos.data(), scene.physics->nq);
    mj_kinematics(scene.physics.get(), data);
  }

 private:
  LiftPot() {
    const TaskSelection selection = FindTask("lift_pot");
    scene = BuildScene(selection.task, LoadRobot(selection.task.robot_file));
    mjModel* m = scene.physics.get();
    data = mj_makeData(m);
    const auto set_arms = [&](double swing, int step) {
      for (const arm_info_t& arm : scene.info.arm) {
        for (int i = 0; i < arm.num_joints; ++i) {
          const double phase = 0.01 * step * (1 + 0.2 * i) + i + arm.entity;
          data->qpos[arm.joint_qpos_index[i]] = arm.joint_home_rad[i] + swing * std::sin(phase);
        }
      }
    };
    // Lets the pot settle on the counter.
    for (int i = 0; i < 500; ++i) {
      set_arms(0, 0);
      mju_zero(data->qvel, m->nv - 6);
      mj_step(m, data);
    }
    const int pot = mj_name2id(m, mjOBJ_BODY, "pot/pot");
    const int pot_joint = m->jnt_qposadr[m->body_jntadr[pot]];
    for (int step = 0; step < 500; ++step) {
      set_arms(0.4, step);
      mj_kinematics(m, data);
      moving.push_back(Recorded());
    }
    const gripper_info_t& gripper = scene.info.gripper[0];
    for (int step = 0; step < 500; ++step) {
      set_arms(0.4, step);
      // The pads penetrate a handle with a half width of 10 mm by 0.1 mm.
      for (const int pad : gripper.pad_geom) {
        const int body = m->geom_bodyid[pad];
        if (m->body_jntnum[body] == 1) data->qpos[m->jnt_qposadr[m->body_jntadr[body]]] = 0.0094;
      }
      mj_kinematics(m, data);
      // In the frame of the pot, y is along the hand's y, and z is opposite to the hand's z.
      const double* hand = data->xmat + 9 * m->body_parentid[m->geom_bodyid[gripper.pad_geom[0]]];
      const double rotation[9] = {-hand[0], hand[1],  -hand[2], -hand[3], hand[4],
                                  -hand[5], -hand[6], hand[7],  -hand[8]};
      double middle[3];
      mju_add3(middle, data->geom_xpos + 3 * gripper.pad_geom[0], data->geom_xpos + 3 * gripper.pad_geom[1]);
      mju_scl3(middle, middle, 0.5);
      const double handle[3] = {0, 0.225, 0.035};
      double offset[3];
      mju_rotVecMat(offset, handle, rotation);
      mju_sub3(data->qpos + pot_joint, middle, offset);
      mju_mat2Quat(data->qpos + pot_joint + 3, rotation);
      mj_kinematics(m, data);
      gripping.push_back(Recorded());
    }
  }

  Pose Recorded() const {
    const mjModel& m = *scene.physics;
    return {{data->qpos, data->qpos + m.nq},
            {data->xpos, data->xpos + 3 * m.nbody},
            {data->xquat, data->xquat + 4 * m.nbody}};
  }
};

PairSet MujocoPairs(const mjData& data) {
  PairSet pairs;
  for (int i = 0; i < data.ncon; ++i) pairs.insert(std::minmax(data.contact[i].geom1, data.contact[i].geom2));
  return pairs;
}

void SetPoses(collision::CollisionChecker* checker, const Pose& pose) {
  const int num_bodies = static_cast<int>(pose.position.size() / 3);
  for (int body = 0; body < num_bodies; ++body) {
    checker->SetBodyPose(body, pose.position.data() + 3 * body, pose.quat.data() + 4 * body);
  }
}

// Measures the time of `check` for each pose, repeatedly.
template <class Prepare, class Check>
void Measure(benchmark::State& state, const std::vector<Pose>& poses, const Prepare& prepare,
             const Check& check) {
  std::vector<double> times;
  size_t next = 0;
  for (auto _ : state) {
    const Pose& pose = poses[next++ % poses.size()];
    prepare(pose);
    const auto begin = std::chrono::steady_clock::now();
    check(pose);
    const double time = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    state.SetIterationTime(time);
    times.push_back(time * 1e6);
  }
  std::sort(times.begin(), times.end());
  state.counters["p50_us"] = times[times.size() / 2];
  state.counters["p99_us"] = times[times.size() * 99 / 100];
}

const std::vector<Pose>& PosesOf(const benchmark::State& state) {
  return state.range(0) == 0 ? LiftPot::Get().moving : LiftPot::Get().gripping;
}

void FindContacts(benchmark::State& state) {
  LiftPot& lift_pot = LiftPot::Get();
  const std::vector<Pose>& poses = PosesOf(state);
  collision::CollisionChecker checker(lift_pot.scene.physics.get(), lift_pot.scene.info);
  double touching = 0;
  for (const Pose& pose : poses) {
    lift_pot.Set(pose);
    mj_collision(lift_pot.scene.physics.get(), lift_pot.data);
    PairSet expected = MujocoPairs(*lift_pot.data);
    std::erase_if(expected, [&](const auto& pair) { return !checker.IsChecked(pair.first, pair.second); });
    SetPoses(&checker, pose);
    PairSet found;
    for (const contact_t& contact : checker.FindContacts()) found.insert({contact.geom_a, contact.geom_b});
    if (found != expected) return state.SkipWithError("touching pairs differ from MuJoCo's");
    touching += static_cast<double>(found.size());
  }
  if (touching == 0) return state.SkipWithError("nothing touches");
  Measure(
      state, poses, [](const Pose&) {},
      [&](const Pose& pose) {
        SetPoses(&checker, pose);
        benchmark::DoNotOptimize(checker.FindContacts().data());
      });
  state.counters["touching"] = touching / static_cast<double>(poses.size());
}

void MujocoCollision(benchmark::State& state) {
  LiftPot& lift_pot = LiftPot::Get();
  Measure(
      state, PosesOf(state), [&](const Pose& pose) { lift_pot.Set(pose); },
      [&](const Pose&) { mj_collision(lift_pot.scene.physics.get(), lift_pot.data); });
  if (lift_pot.data->ncon == 0) state.SkipWithError("nothing touches");
}

void FindClearance(benchmark::State& state) {
  LiftPot& lift_pot = LiftPot::Get();
  collision::CollisionChecker checker(lift_pot.scene.physics.get(), lift_pot.scene.info);
  SetPoses(&checker, PosesOf(state)[0]);
  const std::optional<collision::Clearance> clearance = checker.FindClearance();
  if (!clearance || std::abs(clearance->distance) > 1) return state.SkipWithError("implausible clearance");
  Measure(
      state, PosesOf(state), [&](const Pose& pose) { SetPoses(&checker, pose); },
      [&](const Pose&) { benchmark::DoNotOptimize(checker.FindClearance()); });
}

// Ticks whose clearance is computed when the cost of a tick (with poses and contacts) is measured: none, all,
// or all that may have the smallest clearance so far.
enum class Search { kNone, kEveryTick, kSmallest };

void Tick(benchmark::State& state, Search search) {
  LiftPot& lift_pot = LiftPot::Get();
  const std::vector<Pose>& poses = lift_pot.moving;
  collision::CollisionChecker checker(lift_pot.scene.physics.get(), lift_pot.scene.info);
  collision::ClearanceWatch watch(&checker, 20'000);
  int64_t tick = 0;
  int found = 0;
  double smallest = std::numeric_limits<double>::infinity();
  Measure(
      state, poses, [](const Pose&) {},
      [&](const Pose& pose) {
        // Each pass through the poses is an episode.
        if (++tick > static_cast<int64_t>(poses.size())) {
          watch.Start();
          tick = 1;
        }
        SetPoses(&checker, pose);
        const std::vector<contact_t>& contacts = checker.FindContacts();
        if (search == Search::kNone) return;
        const std::optional<collision::Clearance> clearance =
            search == Search::kEveryTick ? checker.FindClearance() : watch.At(tick, contacts);
        if (!clearance) return;
        ++found;
        smallest = std::min(smallest, clearance->distance);
      });
  state.counters["found"] = found / static_cast<double>(state.iterations());
  if (search == Search::kNone || state.iterations() < static_cast<int64_t>(poses.size())) return;
  double expected = std::numeric_limits<double>::infinity();
  for (const Pose& pose : poses) {
    SetPoses(&checker, pose);
    expected = std::min(expected, checker.FindClearance()->distance);
  }
  if (smallest != expected) state.SkipWithError("not the smallest clearance");
}

// Measures the broad phase alone, on bounding boxes of all geoms except planes. FCL's managers are compared
// with iterating over the list of checked pairs.
class Boxes {
 public:
  explicit Boxes(const collision::CollisionChecker& checker) {
    const mjModel& m = *LiftPot::Get().scene.physics;
    for (int geom = 0; geom < m.ngeom; ++geom) {
      if (m.geom_type[geom] == mjGEOM_PLANE) continue;
      const double* s = m.geom_size + 3 * geom;
      fcl::Vector3d half(s[0], s[1], s[2]);
      if (m.geom_type[geom] == mjGEOM_CAPSULE) half = {s[0], s[0], s[0] + s[1]};
      if (m.geom_type[geom] == mjGEOM_CYLINDER) half = {s[0], s[0], s[1]};
      objects.push_back(std::make_unique<fcl::CollisionObjectd>(std::make_shared<fcl::Boxd>(2 * half)));
      objects.back()->setUserData(reinterpret_cast<void*>(static_cast<intptr_t>(geom)));
      pointers.push_back(objects.back().get());
    }
    checked.assign(m.ngeom, std::vector<char>(m.ngeom));
    for (size_t i = 0; i < objects.size(); ++i) {
      for (size_t k = i + 1; k < objects.size(); ++k) {
        const int a = GeomOf(pointers[i]);
        const int b = GeomOf(pointers[k]);
        checked[a][b] = checked[b][a] = checker.IsChecked(a, b);
        if (checked[a][b]) list.emplace_back(pointers[i], pointers[k]);
      }
    }
  }
  static int GeomOf(const fcl::CollisionObjectd* object) {
    return static_cast<int>(reinterpret_cast<intptr_t>(object->getUserData()));
  }
  void Place() {
    const mjData& data = *LiftPot::Get().data;
    for (fcl::CollisionObjectd* object : pointers) {
      const int geom = GeomOf(object);
      object->setTransform(
          Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(data.geom_xmat + 9 * geom),
          Eigen::Map<const fcl::Vector3d>(data.geom_xpos + 3 * geom));
      object->computeAABB();
    }
  }
  int CountByList() const {
    int overlaps = 0;
    for (const auto& [a, b] : list) overlaps += a->getAABB().overlap(b->getAABB());
    return overlaps;
  }
  std::vector<std::unique_ptr<fcl::CollisionObjectd>> objects;
  std::vector<fcl::CollisionObjectd*> pointers;
  std::vector<std::vector<char>> checked;
  std::vector<std::pair<fcl::CollisionObjectd*, fcl::CollisionObjectd*>> list;
  int count = 0;
};

bool CountPair(fcl::CollisionObjectd* a, fcl::CollisionObjectd* b, void* data) {
  auto* boxes = static_cast<Boxes*>(data);
  boxes->count += boxes->checked[Boxes::GeomOf(a)][Boxes::GeomOf(b)] && a->getAABB().overlap(b->getAABB());
  return false;
}

void BroadPhaseList(benchmark::State& state) {
  LiftPot& lift_pot = LiftPot::Get();
  Boxes boxes(collision::CollisionChecker(lift_pot.scene.physics.get(), lift_pot.scene.info));
  Measure(
      state, PosesOf(state),
      [&](const Pose& pose) {
        lift_pot.Set(pose);
        boxes.Place();
      },
      [&](const Pose&) { boxes.count = boxes.CountByList(); });
  state.counters["pairs"] = static_cast<double>(boxes.list.size());
  state.counters["geoms"] = static_cast<double>(boxes.objects.size());
  if (boxes.count == 0) state.SkipWithError("no overlap");
}

template <class Manager>
void BroadPhaseManager(benchmark::State& state) {
  LiftPot& lift_pot = LiftPot::Get();
  Boxes boxes(collision::CollisionChecker(lift_pot.scene.physics.get(), lift_pot.scene.info));
  Manager manager;
  lift_pot.Set(PosesOf(state)[0]);
  boxes.Place();
  manager.registerObjects(boxes.pointers);
  manager.setup();
  Measure(
      state, PosesOf(state),
      [&](const Pose& pose) {
        lift_pot.Set(pose);
        boxes.Place();
        boxes.count = 0;
      },
      [&](const Pose&) {
        manager.update();
        manager.collide(&boxes, CountPair);
      });
  if (boxes.count != boxes.CountByList()) state.SkipWithError("overlaps differ from the list's");
}

BENCHMARK(FindContacts)->ArgName("gripping")->Arg(0)->Arg(1)->UseManualTime();
BENCHMARK(MujocoCollision)->ArgName("gripping")->Arg(0)->Arg(1)->UseManualTime();
BENCHMARK(FindClearance)->ArgName("gripping")->Arg(0)->Arg(1)->UseManualTime();
BENCHMARK_CAPTURE(Tick, WithoutClearance, Search::kNone)->UseManualTime();
BENCHMARK_CAPTURE(Tick, ClearanceOfEveryTick, Search::kEveryTick)->UseManualTime();
BENCHMARK_CAPTURE(Tick, SmallestClearance, Search::kSmallest)->UseManualTime();
BENCHMARK(BroadPhaseList)->ArgName("gripping")->Arg(0)->UseManualTime();
BENCHMARK(BroadPhaseManager<fcl::DynamicAABBTreeCollisionManagerd>)
    ->ArgName("gripping")
    ->Arg(0)
    ->UseManualTime();
BENCHMARK(BroadPhaseManager<fcl::SaPCollisionManagerd>)->ArgName("gripping")->Arg(0)->UseManualTime();
BENCHMARK(BroadPhaseManager<fcl::SSaPCollisionManagerd>)->ArgName("gripping")->Arg(0)->UseManualTime();

}  // namespace
}  // namespace evalbus

BENCHMARK_MAIN();
