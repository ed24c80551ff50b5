#include "models/randomized_model.h"

#include <algorithm>

#include "base/errors.h"
#include "base/random.h"
#include "models/mujoco_ptr.h"

namespace evalbus {
namespace {

using Parameters = std::vector<Parameter>;

int Find(const mjModel& model, mjtObj type, const NameInFile& name, const char* kind) {
  const int id = mj_name2id(&model, type, name.text.c_str());
  if (id < 0)
    throw InputError(name.location.ToString() + ": the scene has no " + kind + " '" + name.text + "'");
  return id;
}

// Mask by body id: the named bodies and everything attached to them.
std::vector<bool> Bodies(const mjModel& model, const std::vector<NameInFile>& names) {
  std::vector<bool> chosen(static_cast<size_t>(model.nbody));
  for (const NameInFile& name : names) {
    chosen[static_cast<size_t>(Find(model, mjOBJ_BODY, name, "part or body"))] = true;
  }
  // Parents precede their children.
  for (int body = 1; body < model.nbody; ++body) {
    if (chosen[static_cast<size_t>(model.body_parentid[body])] && model.body_parentid[body] != 0)
      chosen[static_cast<size_t>(body)] = true;
  }
  return chosen;
}

double Draw(const Span& range, Random* random) { return random->Uniform(range.min, range.max); }

void Change(const RandomMass& mass, Random* random, mjModel* model, Parameters* parameters) {
  const double factor = Draw(mass.factor, random);
  const std::vector<bool> bodies = Bodies(*model, mass.of);
  for (int body = 0; body < model->nbody; ++body) {
    if (!bodies[static_cast<size_t>(body)]) continue;
    model->body_mass[body] *= factor;
    for (int i = 0; i < 3; ++i) model->body_inertia[3 * body + i] *= factor;
  }
  parameters->push_back({mass.of[0].text + "_mass_factor", factor});
}

void Change(const RandomFriction& friction, Random* random, mjModel* model, Parameters* parameters) {
  const double factor = Draw(friction.factor, random);
  const std::vector<bool> bodies = Bodies(*model, friction.of);
  for (int geom = 0; geom < model->ngeom; ++geom) {
    if (!bodies[static_cast<size_t>(model->geom_bodyid[geom])]) continue;
    for (int i = 0; i < 3; ++i) model->geom_friction[3 * geom + i] *= factor;
  }
  parameters->push_back({friction.of[0].text + "_friction_factor", factor});
}

void Change(const RandomColor& color, Random* random, mjModel* model, Parameters* parameters) {
  float rgb[3];
  static constexpr const char* kName[] = {"_red_fraction", "_green_fraction", "_blue_fraction"};
  for (size_t i = 0; i < 3; ++i) {
    const double drawn = random->Uniform(color.min[i], color.max[i]);
    rgb[i] = static_cast<float>(drawn);
    parameters->push_back({color.of[0].text + kName[i], drawn});
  }
  const std::vector<bool> bodies = Bodies(*model, color.of);
  for (int geom = 0; geom < model->ngeom; ++geom) {
    if (!bodies[static_cast<size_t>(model->geom_bodyid[geom])]) continue;
    // Materials are not shared between parts, because their names have the part's prefix.
    const int material = model->geom_matid[geom];
    std::copy_n(rgb, 3, material >= 0 ? model->mat_rgba + 4 * material : model->geom_rgba + 4 * geom);
  }
}

void Change(const RandomLight& light, Random* random, mjModel* model, Parameters* parameters) {
  const int id = Find(*model, mjOBJ_LIGHT, light.name, "light");
  const double factor = Draw(light.factor, random);
  for (float* color : {model->light_diffuse, model->light_specular}) {
    for (int i = 0; i < 3; ++i) color[3 * id + i] *= static_cast<float>(factor);
  }
  parameters->push_back({"light_" + light.name.text + "_brightness_factor", factor});
}

void Change(const RandomCamera& camera, Random* random, mjModel* model, Parameters* parameters) {
  const int id = Find(*model, mjOBJ_CAMERA, camera.name, "camera");
  static constexpr const char* kShift[] = {"_shift_x_m", "_shift_y_m", "_shift_z_m"};
  for (size_t i = 0; i < 3; ++i) {
    const double shift = random->Uniform(-camera.shift[i], camera.shift[i]);
    model->cam_pos[3 * id + static_cast<int>(i)] += shift;
    parameters->push_back({"camera_" + camera.name.text + kShift[i], shift});
  }
  double turn[3];
  static constexpr const char* kTurn[] = {"_turn_x_rad", "_turn_y_rad", "_turn_z_rad"};
  for (size_t i = 0; i < 3; ++i) {
    turn[i] = random->Uniform(-camera.turn, camera.turn);
    parameters->push_back({"camera_" + camera.name.text + kTurn[i], turn[i]});
  }
  // Rotates about the camera's own axes.
  mju_quatIntegrate(model->cam_quat + 4 * id, turn, 1);
}

template <class Draws>
Parameters ChangeAll(const Draws& draws, Random random, mjModel* model) {
  Parameters parameters;
  for (const auto& draw : draws)
    std::visit([&](const auto& kind) { Change(kind, &random, model, &parameters); }, draw);
  return parameters;
}

}  // namespace

std::vector<Parameter> RandomizePhysics(const Variation& variation, int64_t seed, mjModel* model) {
  if (variation.physics.empty()) return {};
  const Parameters parameters = ChangeAll(variation.physics, Random(seed, kPhysicsStream), model);
  const DataPtr data(mj_makeData(model));
  mj_setConst(model, data.get());
  return parameters;
}

std::vector<Parameter> RandomizeAppearance(const Variation& variation, int64_t seed, mjModel* model) {
  return ChangeAll(variation.appearance, Random(seed, kAppearanceStream), model);
}

}  // namespace evalbus
