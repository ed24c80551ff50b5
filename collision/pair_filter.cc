#include "collision/pair_filter.h"

#include <algorithm>
#include <set>

namespace evalbus::collision {
namespace {

// Returns whether MuJoCo checks the pair. Applies MuJoCo's filters (mj_collision of version 2.2), except
// <pair>.
bool MujocoChecks(const mjModel& m, int geom_a, int geom_b) {
  if (!(m.geom_contype[geom_a] & m.geom_conaffinity[geom_b]) &&
      !(m.geom_contype[geom_b] & m.geom_conaffinity[geom_a])) {
    return false;
  }
  const int body_a = m.geom_bodyid[geom_a];
  const int body_b = m.geom_bodyid[geom_b];
  const int weld_a = m.body_weldid[body_a];
  const int weld_b = m.body_weldid[body_b];
  if (weld_a == weld_b) return false;
  const bool filter_parent = !(m.opt.disableflags & mjDSBL_FILTERPARENT);
  if (filter_parent && weld_a != 0 && weld_b != 0 &&
      (weld_a == m.body_weldid[m.body_parentid[weld_b]] ||
       weld_b == m.body_weldid[m.body_parentid[weld_a]])) {
    return false;
  }
  const int signature = ((std::min(body_a, body_b) + 1) << 16) + std::max(body_a, body_b) + 1;
  return std::find(m.exclude_signature, m.exclude_signature + m.nexclude, signature) ==
         m.exclude_signature + m.nexclude;
}

// Returns true for neighboring links of one robot. evalbus does not check these pairs, but MuJoCo checks a
// link against its parent if the parent is fixed to the world.
bool AreNeighboringLinks(const mjModel& m, const model_info_t& info, int body_a, int body_b) {
  const int entity = info.body_entity[body_a];
  if (entity != info.body_entity[body_b] || info.entity_kind[entity] != model_info_t::ROBOT) return false;
  const int weld_a = m.body_weldid[body_a];
  const int weld_b = m.body_weldid[body_b];
  return weld_a == m.body_weldid[m.body_parentid[weld_b]] || weld_b == m.body_weldid[m.body_parentid[weld_a]];
}

// Returns, for each body, the gripper to whose fingers it belongs; -1: none. A finger consists of the bodies
// that are welded to a body with a pad.
std::vector<int> GripperOfBody(const mjModel& m, const model_info_t& info) {
  std::vector<int> gripper(m.nbody, -1);
  for (int i = 0; i < info.num_grippers; ++i) {
    for (const int pad : info.gripper[i].pad_geom) {
      const int weld = m.body_weldid[m.geom_bodyid[pad]];
      for (int body = 1; body < m.nbody; ++body) {
        if (m.body_weldid[body] == weld) gripper[body] = i;
      }
    }
  }
  return gripper;
}

}  // namespace

std::vector<std::pair<int, int>> CheckedPairs(const mjModel& m, const model_info_t& info) {
  const std::vector<int> gripper = GripperOfBody(m, info);
  std::set<std::pair<int, int>> pairs;
  const auto add = [&](int geom_a, int geom_b) {
    const int body_a = m.geom_bodyid[geom_a];
    const int body_b = m.geom_bodyid[geom_b];
    if (AreNeighboringLinks(m, info, body_a, body_b)) return;
    if (gripper[body_a] >= 0 && gripper[body_a] == gripper[body_b]) return;
    pairs.insert(std::minmax(geom_a, geom_b));
  };
  if (m.opt.collision != mjCOL_PAIR) {
    for (int a = 0; a < m.ngeom; ++a) {
      for (int b = a + 1; b < m.ngeom; ++b) {
        if (MujocoChecks(m, a, b)) add(a, b);
      }
    }
  }
  if (m.opt.collision != mjCOL_DYNAMIC) {
    for (int i = 0; i < m.npair; ++i) add(m.pair_geom1[i], m.pair_geom2[i]);
  }
  // MuJoCo computes no contacts between planes and height fields.
  std::erase_if(pairs, [&](const auto& pair) {
    return m.geom_type[pair.first] <= mjGEOM_HFIELD && m.geom_type[pair.second] <= mjGEOM_HFIELD;
  });
  return {pairs.begin(), pairs.end()};
}

}  // namespace evalbus::collision
