#include "models/randomized_model.h"

#include <algorithm>
#include <array>
#include <set>

#include "base/errors.h"
#include "base/random.h"
#include "models/mujoco_ptr.h"
#include "models/texture_files.h"

namespace evalbus {
namespace {

using Parameters = std::vector<Parameter>;

struct AppearanceRandom {
  explicit AppearanceRandom(int64_t seed)
      : main(seed, kAppearanceStream), light(seed, kLightStream), texture(seed, kTextureStream) {}
  Random main;
  // Poses of lights.
  Random light;
  Random texture;
};

int Find(const mjModel& model, mjtObj type, const NameInFile& name, const char* kind) {
  const int id = mj_name2id(&model, type, name.text.c_str());
  if (id < 0)
    throw InputError(name.location.ToString() + ": the scene has no " + kind + " '" + name.text + "'");
  return id;
}

// Returns a mask by body id: true for the named bodies and everything attached to them.
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

[[noreturn]] void Refuse(const char* kind, const NameInFile& name, const char* why) {
  throw InputError(name.location.ToString() + ": " + kind + " '" + name.text + "' " + why);
}

double Draw(const Span& range, Random* random) { return random->Uniform(range.min, range.max); }

void Change(const RandomMass& mass, Random* random, mjModel* model, Parameters* parameters) {
  const double factor = Draw(mass.factor, random);
  const std::vector<bool> bodies = Bodies(*model, mass.of);
  bool moves = false;
  for (int body = 0; body < model->nbody; ++body) {
    if (!bodies[static_cast<size_t>(body)]) continue;
    moves |= model->body_weldid[body] != 0;
    model->body_mass[body] *= factor;
    for (int i = 0; i < 3; ++i) model->body_inertia[3 * body + i] *= factor;
  }
  if (!moves) Refuse("part", mass.of[0], "is fixed, so its mass has no effect");
  parameters->push_back({mass.of[0].text + "_mass_factor", factor});
}

void Change(const RandomFriction& friction, Random* random, mjModel* model, Parameters* parameters) {
  const double factor = Draw(friction.factor, random);
  const std::vector<bool> bodies = Bodies(*model, friction.of);
  bool collides = false;
  for (int geom = 0; geom < model->ngeom; ++geom) {
    if (!bodies[static_cast<size_t>(model->geom_bodyid[geom])]) continue;
    collides = true;
    for (int i = 0; i < 3; ++i) model->geom_friction[3 * geom + i] *= factor;
  }
  if (!collides)
    Refuse("part or body", friction.of[0], "has no geom that collides, so its friction has no effect");
  parameters->push_back({friction.of[0].text + "_friction_factor", factor});
}

void Change(const RandomColor& color, AppearanceRandom* random, mjModel* model, Parameters* parameters) {
  float rgb[3];
  static constexpr const char* kName[] = {"_red_fraction", "_green_fraction", "_blue_fraction"};
  for (size_t i = 0; i < 3; ++i) {
    const double drawn = random->main.Uniform(color.min[i], color.max[i]);
    rgb[i] = static_cast<float>(drawn);
    parameters->push_back({color.of[0].text + kName[i], drawn});
  }
  const std::vector<bool> bodies = Bodies(*model, color.of);
  bool is_seen = false;
  for (int geom = 0; geom < model->ngeom; ++geom) {
    if (!bodies[static_cast<size_t>(model->geom_bodyid[geom])]) continue;
    is_seen = true;
    // The material itself is changed. No other part has it, because materials have the prefix of their part.
    const int material = model->geom_matid[geom];
    std::copy_n(rgb, 3, material >= 0 ? model->mat_rgba + 4 * material : model->geom_rgba + 4 * geom);
  }
  if (!is_seen) Refuse("part or body", color.of[0], "has no geom, so its color has no effect");
}

// Shifts a position by up to `most` along each axis.
void Shift(const std::array<double, 3>& most, const std::string& name, Random* random, double* position,
           Parameters* parameters) {
  static constexpr const char* kShift[] = {"_shift_x_m", "_shift_y_m", "_shift_z_m"};
  for (size_t i = 0; i < 3; ++i) {
    const double shift = random->Uniform(-most[i], most[i]);
    position[i] += shift;
    parameters->push_back({name + kShift[i], shift});
  }
}

// Draws a rotation by up to `most` about each axis, as a rotation vector.
std::array<double, 3> DrawTurn(double most, const std::string& name, Random* random, Parameters* parameters) {
  static constexpr const char* kTurn[] = {"_turn_x_rad", "_turn_y_rad", "_turn_z_rad"};
  std::array<double, 3> turn{};
  for (size_t i = 0; i < 3; ++i) {
    turn[i] = random->Uniform(-most, most);
    parameters->push_back({name + kTurn[i], turn[i]});
  }
  return turn;
}

void Rotate(double* vector, const double* quaternion) {
  double rotated[3];
  mju_rotVecQuat(rotated, vector, quaternion);
  std::copy_n(rotated, 3, vector);
}

// Returns true for a light whose rays are parallel. The field's name depends on MuJoCo's version.
template <class Model>
bool IsDirectional(const Model& model, int light) {
  if constexpr (requires { model.light_type; }) {
    return model.light_type[light] == 1;  // mjLIGHT_DIRECTIONAL
  } else {
    return model.light_directional[light] != 0;
  }
}

void TurnLight(const std::array<double, 3>& turn, int light, mjModel* model) {
  double rotation[4] = {1, 0, 0, 0};
  mju_quatIntegrate(rotation, turn.data(), 1);
  Rotate(model->light_dir + 3 * light, rotation);
  if (!IsDirectional(*model, light) || model->light_bodyid[light] != 0) return;
  double* position = model->light_pos + 3 * light;
  mju_subFrom3(position, model->stat.center);
  Rotate(position, rotation);
  mju_addTo3(position, model->stat.center);
}

void Change(const RandomLight& light, AppearanceRandom* random, mjModel* model, Parameters* parameters) {
  const int id = Find(*model, mjOBJ_LIGHT, light.name, "light");
  const std::string name = "light_" + light.name.text;
  if ((light.shift || light.turn) && model->light_mode[id] != mjCAMLIGHT_FIXED)
    Refuse("light", light.name, "tracks a body: only its brightness can be randomized");
  if (light.shift && IsDirectional(*model, id))
    Refuse("light", light.name, "is directional, so its position does not matter: use turn_deg");
  if (light.factor) {
    const double factor = Draw(*light.factor, &random->main);
    for (float* color : {model->light_diffuse, model->light_specular}) {
      for (int i = 0; i < 3; ++i) color[3 * id + i] *= static_cast<float>(factor);
    }
    parameters->push_back({name + "_brightness_factor", factor});
  }
  if (light.shift) Shift(*light.shift, name, &random->light, model->light_pos + 3 * id, parameters);
  if (light.turn) TurnLight(DrawTurn(*light.turn, name, &random->light, parameters), id, model);
}

// Returns the id of a choice's texture; -1 for kPlain.
int TextureId(const NameInFile& choice, const mjModel& model) {
  if (choice.text == kPlain) return -1;
  const int id = Find(model, mjOBJ_TEXTURE, choice, "texture");
  if (model.tex_type[id] == mjTEXTURE_2D) return id;
  throw InputError(choice.location.ToString() + ": texture '" + choice.text +
                   "' is a cube or a sky: only textures of type 2d can be exchanged");
}

int& TextureOf(mjModel* model, int material) {
#if mjVERSION_HEADER >= 320
  return model->mat_texid[mjNTEXROLE * material + mjTEXROLE_RGB];
#else
  return model->mat_texid[material];
#endif
}

std::string NameOf(const RandomTexture& texture) { return texture.of[0].text + "_texture_choice"; }

void Change(const RandomTexture& texture, AppearanceRandom* random, mjModel* model, Parameters* parameters) {
  std::vector<int> ids;
  for (const NameInFile& choice : texture.choices) ids.push_back(TextureId(choice, *model));
  const std::vector<bool> bodies = Bodies(*model, texture.of);
  std::set<int> all, textured;
  for (int geom = 0; geom < model->ngeom; ++geom) {
    const int material = model->geom_matid[geom];
    if (material < 0 || !bodies[static_cast<size_t>(model->geom_bodyid[geom])]) continue;
    all.insert(material);
    if (TextureOf(model, material) >= 0) textured.insert(material);
  }
  if (all.empty()) {
    throw InputError(texture.of[0].location.ToString() + ": '" + texture.of[0].text +
                     "' has no material, which a texture requires");
  }
  const auto chosen = static_cast<size_t>(random->texture.Index(static_cast<int>(ids.size())));
  for (const int material : textured.empty() ? all : textured) TextureOf(model, material) = ids[chosen];
  parameters->push_back({NameOf(texture), static_cast<double>(chosen)});
}

void Change(const RandomCamera& camera, AppearanceRandom* random, mjModel* model, Parameters* parameters) {
  const int id = Find(*model, mjOBJ_CAMERA, camera.name, "camera");
  const std::string name = "camera_" + camera.name.text;
  // MuJoCo computes the position and rotation of tracking cameras from the initial state, and the rotation of
  // targeting cameras from their target. Changes of these values in the model would have no effect.
  const int mode = model->cam_mode[id];
  if (mode == mjCAMLIGHT_TRACK || mode == mjCAMLIGHT_TRACKCOM)
    Refuse("camera", camera.name, "tracks a body, so it can neither be shifted nor turned");
  if (mode != mjCAMLIGHT_FIXED && camera.turn > 0)
    Refuse("camera", camera.name, "looks at a body, so it cannot be turned");
  Shift(camera.shift, name, &random->main, model->cam_pos + 3 * id, parameters);
  const std::array<double, 3> turn = DrawTurn(camera.turn, name, &random->main, parameters);
  // Rotates about the camera's own axes.
  mju_quatIntegrate(model->cam_quat + 4 * id, turn.data(), 1);
}

template <class Draws, class Source>
Parameters ChangeAll(const Draws& draws, Source random, mjModel* model) {
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
  return ChangeAll(variation.appearance, AppearanceRandom(seed), model);
}

void CheckDistinct(const std::vector<Parameter>& parameters, const Variation& variation) {
  std::set<std::string> names;
  for (const Parameter& parameter : parameters) {
    if (names.insert(parameter.name).second) continue;
    throw InputError(variation.location.ToString() + ": variation '" + variation.name +
                     "': two entries of 'randomize' draw '" + parameter.name + "'");
  }
}

std::map<std::string, std::vector<std::string>> ParameterChoices(const Variation& variation) {
  std::map<std::string, std::vector<std::string>> choices;
  for (const AppearanceChange& change : variation.appearance) {
    const auto* texture = std::get_if<RandomTexture>(&change);
    if (!texture) continue;
    std::vector<std::string>& names = choices[NameOf(*texture)];
    names.clear();
    for (const NameInFile& choice : texture->choices) names.push_back(choice.text);
  }
  return choices;
}

std::vector<int> TexturesOf(const Variation& variation, const mjModel& model) {
  std::set<int> ids;
  for (const AppearanceChange& change : variation.appearance) {
    const auto* texture = std::get_if<RandomTexture>(&change);
    if (!texture) continue;
    for (const NameInFile& choice : texture->choices) ids.insert(TextureId(choice, model));
  }
  ids.erase(-1);
  return {ids.begin(), ids.end()};
}

}  // namespace evalbus
