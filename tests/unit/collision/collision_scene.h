// Small MuJoCo scenes for the collision tests.
#pragma once

#include <mujoco/mujoco.h>

#include <array>
#include <evalbus/model_info_t.hpp>
#include <random>
#include <stdexcept>
#include <string>

#include "collision/checker.h"
#include "models/mujoco_ptr.h"

namespace evalbus::collision {

struct CollisionScene {
  ModelPtr model;
  DataPtr data;
  model_info_t info{};

  int Geom(const char* name) const {
    const int id = mj_name2id(model.get(), mjOBJ_GEOM, name);
    if (id < 0) throw std::runtime_error(std::string("no geom ") + name);
    return id;
  }

  // Every body below the world is an entity: a robot if its name begins with "robot", a fixture if it begins
  // with "fixture", and otherwise an object. Geoms named "pad<i>..." are pads of gripper i.
  explicit CollisionScene(const std::string& xml) {
    info.message_version = model_info_t::VERSION;
    mjVFS vfs;
    mj_defaultVFS(&vfs);
    mj_makeEmptyFileVFS(&vfs, "scene.xml", static_cast<int>(xml.size()));
    xml.copy(static_cast<char*>(vfs.filedata[0]), xml.size());
    std::array<char, 1000> error{};
    model.reset(mj_loadXML("scene.xml", &vfs, error.data(), error.size()));
    mj_deleteVFS(&vfs);
    if (!model) throw std::runtime_error(error.data());
    data.reset(mj_makeData(model.get()));
    mj_kinematics(model.get(), data.get());

    const mjModel& m = *model;
    info.num_bodies = m.nbody;
    info.num_geoms = m.ngeom;
    info.entity_name = {"world"};
    info.entity_kind = {model_info_t::WORLD};
    info.body_entity.assign(m.nbody, 0);
    for (int body = 1; body < m.nbody; ++body) {
      if (m.body_parentid[body] != 0) {
        info.body_entity[body] = info.body_entity[m.body_parentid[body]];
        continue;
      }
      const std::string name = mj_id2name(&m, mjOBJ_BODY, body);
      info.body_entity[body] = static_cast<int>(info.entity_name.size());
      info.entity_name.push_back(name);
      info.entity_kind.push_back(name.starts_with("robot")     ? model_info_t::ROBOT
                                 : name.starts_with("fixture") ? model_info_t::FIXTURE
                                                               : model_info_t::OBJECT);
    }
    info.num_entities = static_cast<int>(info.entity_name.size());
    for (int geom = 0; geom < m.ngeom; ++geom) {
      const char* name = mj_id2name(&m, mjOBJ_GEOM, geom);
      if (!name || !std::string(name).starts_with("pad")) continue;
      info.gripper.resize(std::max<size_t>(info.gripper.size(), name[3] - '0' + 1));
      info.gripper[name[3] - '0'].pad_geom.push_back(geom);
    }
    info.num_grippers = static_cast<int>(info.gripper.size());
  }

  void SetPoses(CollisionChecker* checker) const {
    for (int body = 0; body < model->nbody; ++body) {
      checker->SetBodyPose(body, data->xpos + 3 * body, data->xquat + 4 * body);
    }
  }

  // Places free bodies at random within +-reach with uniform rotations. Sets hinges within their limits or
  // +-pi.
  void Randomize(std::mt19937_64* random, double reach) {
    const auto uniform = [&](double low, double high) {
      return low + (high - low) * static_cast<double>((*random)() >> 11) * 0x1p-53;
    };
    for (int joint = 0; joint < model->njnt; ++joint) {
      double* q = data->qpos + model->jnt_qposadr[joint];
      const double* range = model->jnt_range + 2 * joint;
      if (model->jnt_type[joint] == mjJNT_FREE) {
        for (int i = 0; i < 3; ++i) q[i] = uniform(-reach, reach);
        do {
          for (int i = 3; i < 7; ++i) q[i] = uniform(-1, 1);
        } while (mju_norm(q + 3, 4) > 1 || mju_norm(q + 3, 4) < 0.1);
        mju_normalize4(q + 3);
      } else if (model->jnt_limited[joint]) {
        q[0] = uniform(range[0], range[1]);
      } else {
        q[0] = uniform(-mjPI, mjPI);
      }
    }
    mj_kinematics(model.get(), data.get());
  }
};

}  // namespace evalbus::collision
