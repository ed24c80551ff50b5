#include "models/scene_composer.h"

#include <mujoco/mujoco.h>

#include <cmath>
#include <numbers>

#include "models/compile_model.h"
#include "tests/unit/models/models_test_util.h"

namespace evalbus::scene_composer_test {

using std::numbers::pi;

constexpr const char* kEmptyBase = "<mujoco/>";

ModelPtr Compile(const SceneComposer& composer) {
  std::vector<std::string> warnings;
  ModelPtr model = CompileModel(composer, false, &warnings);
  EXPECT_TRUE(warnings.empty()) << warnings[0];
  return model;
}

int Id(const ModelPtr& model, mjtObj type, const std::string& name) {
  const int id = mj_name2id(model.get(), type, name.c_str());
  EXPECT_GE(id, 0) << "no '" << name << "'";
  return std::max(id, 0);
}

// Composes one part, "p/", from its text.
struct OnePart {
  explicit OnePart(const std::string& part, const std::string& base = kEmptyBase, bool free = false)
      : composer(folder.Write("base.xml", base)), file(folder.Write("part.xml", part)) {
    composer.Attach(file, "p/", Pose{}, {.mount = free ? Mount::kFree : Mount::kFixed});
  }
  TempFolder folder;
  SceneComposer composer;
  std::filesystem::path file;
};

// Returns the error of composing one part, without the folder's name.
std::string ErrorOfPart(const std::string& part, const std::string& base = kEmptyBase, bool free = false) {
  TempFolder folder;
  const std::string message = ErrorOf([&] {
    SceneComposer composer(folder.Write("base.xml", base));
    composer.Attach(folder.Write("part.xml", part), "p/", Pose{},
                    {.mount = free ? Mount::kFree : Mount::kFixed});
    Compile(composer);
  });
  std::string short_message = message;
  const std::string prefix = folder.path().string() + "/";
  for (size_t at; (at = short_message.find(prefix)) != std::string::npos;)
    short_message.erase(at, prefix.size());
  return short_message;
}

TEST(SceneComposer, PartsWithEqualNamesAndConflictingDefaults) {
  TempFolder folder;
  const auto part = [](const std::string& color, const std::string& damping) {
    return "<mujoco><default><geom rgba='" + color + "' size='0.1'/><default class='c'><joint damping='" +
           damping + "'/></default></default><asset><material name='m' rgba='" + color +
           "'/></asset><worldbody><geom name='g'/><body name='b'><joint name='j' class='c'/>"
           "<geom name='h' class='main' material='m'/></body></worldbody>"
           "<actuator><motor name='a' joint='j'/></actuator></mujoco>";
  };
  SceneComposer composer(folder.Write("base.xml",
                                      "<mujoco><default><geom rgba='1 0 0 1' condim='6'/></default>"
                                      "<worldbody><geom name='floor' type='plane' size='1 1 1'/>"
                                      "<body name='post'><geom name='post' size='1'/></body>"
                                      "</worldbody></mujoco>"));
  composer.Attach(folder.Write("one.xml", part("0 1 0 1", "2")), "one/", Pose{});
  composer.Attach(folder.Write("two.xml", part("0 0 1 1", "3")), "two/", Pose{});
  const ModelPtr model = Compile(composer);

  const auto color = [&](const std::string& geom) {
    return model->geom_rgba + 4 * Id(model, mjOBJ_GEOM, geom);
  };
  EXPECT_EQ(color("floor")[0], 1);
  EXPECT_EQ(color("post")[0], 1);
  EXPECT_EQ(model->geom_condim[Id(model, mjOBJ_GEOM, "post")], 6);
  EXPECT_EQ(color("one/g")[1], 1);
  EXPECT_EQ(color("two/g")[2], 1);
  EXPECT_EQ(color("two/h")[0], 0);
  EXPECT_EQ(model->geom_condim[Id(model, mjOBJ_GEOM, "two/g")], 3);
  EXPECT_EQ(model->geom_matid[Id(model, mjOBJ_GEOM, "two/h")], Id(model, mjOBJ_MATERIAL, "two/m"));
  const auto damping = [&](const std::string& joint) {
    return model->dof_damping[model->jnt_dofadr[Id(model, mjOBJ_JOINT, joint)]];
  };
  EXPECT_EQ(damping("one/j"), 2);
  EXPECT_EQ(damping("two/j"), 3);
  EXPECT_EQ(model->actuator_trnid[2 * Id(model, mjOBJ_ACTUATOR, "two/a")], Id(model, mjOBJ_JOINT, "two/j"));
  // The file's world has become a body.
  EXPECT_EQ(model->geom_bodyid[Id(model, mjOBJ_GEOM, "one/g")], Id(model, mjOBJ_BODY, "one"));
}

TEST(SceneComposer, DefaultsOfAnArmDoNotReachItsHand) {
  TempFolder folder;
  SceneComposer composer(folder.Write("base.xml", kEmptyBase));
  composer.Attach(folder.Write("arm.xml",
                               "<mujoco><default><default class='c'><geom size='0.3'/></default></default>"
                               "<worldbody><body name='tip' childclass='c'><geom/></body></worldbody>"
                               "</mujoco>"),
                  "arm/", Pose{});
  composer.Attach(folder.Write("hand.xml",
                               "<mujoco><worldbody><body name='h'><geom name='g' size='0.1'/></body>"
                               "<geom name='w' type='ellipsoid' size='0.1 0.2 0.1'/></worldbody></mujoco>"),
                  "arm/hand/", Pose{}, {.parent_body = "arm/tip"});
  const ModelPtr model = Compile(composer);
  EXPECT_EQ(model->geom_size[3 * Id(model, mjOBJ_GEOM, "arm/hand/g")], 0.1);
  EXPECT_EQ(model->body_parentid[Id(model, mjOBJ_BODY, "arm/hand")], Id(model, mjOBJ_BODY, "arm/tip"));
}

TEST(SceneComposer, PosesMultiply) {
  // The part is at (1, 2, 3) and rotated by 90 degrees about z. Its body is at (1, 0, 0), and the site in it
  // at (0, 0.5, 0).
  TempFolder folder;
  SceneComposer composer(folder.Write("base.xml", kEmptyBase));
  const auto file = folder.Write("part.xml",
                                 "<mujoco><worldbody><body name='b' pos='1 0 0'><geom size='0.1'/>"
                                 "<site name='s' pos='0 0.5 0'/></body></worldbody></mujoco>");
  const Pose pose{{1, 2, 3}, {std::sqrt(0.5), 0, 0, std::sqrt(0.5)}};
  composer.Attach(file, "p/", pose);
  // Part q is attached to body p/b with the same pose, so it is rotated by 180 degrees in total.
  composer.Attach(file, "q/", pose, {.parent_body = "p/b"});
  const ModelPtr model = Compile(composer);
  const DataPtr data(mj_makeData(model.get()));
  mj_kinematics(model.get(), data.get());
  const auto expect_at = [&](const std::string& site, double x, double y, double z) {
    const double* p = data->site_xpos + 3 * Id(model, mjOBJ_SITE, site);
    EXPECT_NEAR(p[0], x, 1e-12) << site;
    EXPECT_NEAR(p[1], y, 1e-12) << site;
    EXPECT_NEAR(p[2], z, 1e-12) << site;
  };
  // Body b: (1, 2, 3) + turn (1, 0, 0) = (1, 3, 3). Site s: b + turn (0, 0.5, 0) = (0.5, 3, 3).
  expect_at("p/s", 0.5, 3, 3);
  // Part q: b + turn (1, 2, 3) = (1 - 2, 3 + 1, 6) = (-1, 4, 6). Its body is at q - (1, 0, 0), and its site
  // 0.5 lower in y.
  expect_at("q/s", -2, 3.5, 6);
}

TEST(SceneComposer, FreePart) {
  const char* part = "<mujoco><worldbody><body name='b'><geom size='0.1'/></body></worldbody></mujoco>";
  const OnePart free(part, kEmptyBase, true);
  const ModelPtr model = Compile(free.composer);
  EXPECT_EQ(model->nq, 7);
  EXPECT_EQ(model->jnt_bodyid[Id(model, mjOBJ_JOINT, "p")], Id(model, mjOBJ_BODY, "p"));
  EXPECT_EQ(Compile(OnePart(part).composer)->nq, 0);

  // A file that was made to be used alone includes the joint.
  const char* own =
      "<mujoco><worldbody><body name='b'><freejoint/><geom size='0.1'/></body></worldbody></mujoco>";
  EXPECT_EQ(Compile(OnePart(own, kEmptyBase, true).composer)->nq, 7);
  EXPECT_EQ(ErrorOfPart(own),
            "part.xml:1: a free joint in an attached file requires 'free: true' where the file is attached");
}

// If MuJoCo compiles a file alone, the physics must equal the physics of the same file attached at the
// origin.
TEST(SceneComposer, AttachedFileIsWhatMuJoCoMakesOfIt) {
  const std::filesystem::path file = kModelsData / "everything.xml";
  char message[1000] = "";
  const ModelPtr direct(mj_loadXML(file.c_str(), nullptr, message, sizeof(message)));
  ASSERT_TRUE(direct) << message;
  TempFolder folder;
  SceneComposer composer(
      folder.Write("base.xml", "<mujoco><option timestep='0.002' integrator='Euler'/></mujoco>"));
  composer.Attach(file, "p/", Pose{});
  EXPECT_TRUE(composer.warnings().empty()) << composer.warnings()[0];
  const ModelPtr composed = Compile(composer);

  ASSERT_EQ(composed->nbody, direct->nbody + 1);
  ASSERT_EQ(composed->ngeom, direct->ngeom);
  ASSERT_EQ(composed->nq, direct->nq);
  ASSERT_EQ(composed->nu, direct->nu);
  ASSERT_EQ(composed->nsensordata, direct->nsensordata);
  ASSERT_EQ(composed->neq, direct->neq);
  ASSERT_EQ(composed->ntendon, direct->ntendon);
  ASSERT_EQ(composed->npair, direct->npair);
  ASSERT_EQ(composed->nexclude, direct->nexclude);
  const auto expect_equal = [](const double* a, const double* b, int n, const char* what) {
    for (int i = 0; i < n; ++i) EXPECT_NEAR(a[i], b[i], 1e-12) << what << " " << i;
  };
  expect_equal(composed->jnt_range, direct->jnt_range, 2 * direct->njnt, "range");
  expect_equal(composed->qpos0, direct->qpos0, direct->nq, "ref");
  expect_equal(composed->qpos_spring, direct->qpos_spring, direct->nq, "springref");
  expect_equal(composed->dof_damping, direct->dof_damping, direct->nv, "damping");
  expect_equal(composed->dof_armature, direct->dof_armature, direct->nv, "armature");
  expect_equal(composed->geom_size, direct->geom_size, 3 * direct->ngeom, "size");
  expect_equal(composed->geom_quat, direct->geom_quat, 4 * direct->ngeom, "quat");
  expect_equal(composed->body_mass + 2, direct->body_mass + 1, direct->nbody - 1, "mass");
  expect_equal(composed->site_quat, direct->site_quat, 4 * direct->nsite, "site quat");
  expect_equal(composed->actuator_gainprm, direct->actuator_gainprm, mjNGAIN * direct->nu, "gain");
  expect_equal(composed->actuator_ctrlrange, direct->actuator_ctrlrange, 2 * direct->nu, "ctrlrange");

  // The composed model also moves identically. This covers limits, springs, tendons, equalities, contacts and
  // sensors.
  const DataPtr a(mj_makeData(composed.get()));
  const DataPtr b(mj_makeData(direct.get()));
  for (mjData* data : {a.get(), b.get()}) {
    for (int i = 0; i < direct->nu; ++i) data->ctrl[i] = 0.3;
  }
  for (int step = 0; step < 100; ++step) {
    mj_step(composed.get(), a.get());
    mj_step(direct.get(), b.get());
  }
  for (int i = 0; i < direct->nq; ++i) EXPECT_NEAR(a->qpos[i], b->qpos[i], 1e-9) << "qpos " << i;
  for (int i = 0; i < direct->nsensordata; ++i)
    EXPECT_NEAR(a->sensordata[i], b->sensordata[i], 1e-7) << "sensor " << i;
  EXPECT_GT(std::abs(b->qpos[0] - direct->qpos0[0]), 1e-3);
}

TEST(SceneComposer, DegreesAndEulerSequences) {
  const OnePart part(
      "<mujoco><compiler eulerseq='zyx'/><worldbody><body name='b'>"
      "<joint name='hinge' range='-90 45'/><geom name='g' size='0.1 0.2 0.3' type='box' euler='90 0 0'/>"
      "<site name='s' axisangle='1 0 0 90'/></body></worldbody></mujoco>",
      // The angle unit of the base file itself does not matter.
      "<mujoco><compiler angle='radian'/></mujoco>");
  const ModelPtr model = Compile(part.composer);
  EXPECT_NEAR(model->jnt_range[0], -pi / 2, 1e-15);
  EXPECT_NEAR(model->jnt_range[1], pi / 4, 1e-15);
  EXPECT_NEAR(model->geom_quat[3], std::sqrt(0.5), 1e-9);
  EXPECT_NEAR(model->site_quat[1], std::sqrt(0.5), 1e-9);
}

TEST(SceneComposer, NewerModelsLoadWithWarnings) {
  SceneComposer composer(kModelsData / "world.xml");
  composer.Attach(kModelsData / "newer_arm.xml", "arm/", Pose{}, {.stiffness = {{"motor1", 450}}});
  composer.Attach(kModelsData / "newer_hand.xml", "arm/hand/", Pose{}, {.parent_body = "arm/flange"});
  const std::string arm = (kModelsData / "newer_arm.xml").string();
  const std::string hand = (kModelsData / "newer_hand.xml").string();
  const std::string version = mj_versionString();
  EXPECT_EQ(
      composer.warnings(),
      (std::vector<std::string>{
          arm + ":5: <option> integrator=\"implicitfast\" is ignored; the scene's is \"Euler\"",
          arm + ":5: <option> impratio=\"10\" is ignored; the scene's is MuJoCo's default",
          arm + ":29: <body>: attribute 'gravcomp' is not known to MuJoCo " + version + "; dropped (2 times)",
          arm + ":25: <light> dropped: only the scene's lights are used",
          hand + ":4: <option> integrator=\"implicitfast\" is ignored; the scene's is \"Euler\""}));

  composer.SetJointAttribute("arm/joint1", "damping", 6);
  const ModelPtr model = Compile(composer);
  const int motor = Id(model, mjOBJ_ACTUATOR, "arm/motor1"), other = Id(model, mjOBJ_ACTUATOR, "arm/motor2");
  EXPECT_EQ(model->actuator_gainprm[mjNGAIN * motor], 450);
  EXPECT_EQ(model->actuator_biasprm[mjNBIAS * motor + 1], -450);
  EXPECT_EQ(model->actuator_biasprm[mjNBIAS * motor + 2], 0);
  EXPECT_EQ(model->actuator_forcerange[2 * motor + 1], 80);
  EXPECT_EQ(model->actuator_biasprm[mjNBIAS * other + 2], -30);
  EXPECT_EQ(model->dof_damping[0], 6);
  EXPECT_EQ(model->dof_damping[1], 1);
  // A mesh without a name is named after its file.
  EXPECT_EQ(model->geom_dataid[1], Id(model, mjOBJ_MESH, "arm/cube"));
  EXPECT_EQ(model->mat_rgba[4 * Id(model, mjOBJ_MATERIAL, "arm/hand/white")], 0.5f);
}

// Meshes and textures are merged if their files and all attributes, including those of default classes, are
// equal.
TEST(SceneComposer, EqualAssetsAreMerged) {
  TempFolder folder;
  const auto part = [&](const std::string& file, const std::string& scale) {
    return folder.Write(
        file, "<mujoco><compiler meshdir='" + (kModelsData / "meshes").string() + "' texturedir='" +
                  (kModelsData / "../../../models/textures").lexically_normal().string() +
                  "'/><default><mesh scale='" + scale +
                  "'/></default><asset><mesh name='m' file='cube.obj'/><mesh name='n' file='cube.obj' "
                  "scale='3 3 3'/><texture name='t' type='2d' file='dots.png'/><material name='x' "
                  "texture='t'/></asset><worldbody><geom name='g' type='mesh' mesh='m' material='x'/><geom "
                  "name='h' type='mesh' mesh='n'/></worldbody></mujoco>");
  };
  SceneComposer composer(folder.Write("base.xml", kEmptyBase));
  const auto same = part("same.xml", "1 1 1");
  composer.Attach(same, "a/", Pose{});
  composer.Attach(same, "b/", Pose{});
  composer.Attach(part("other.xml", "2 2 2"), "c/", Pose{});
  const auto mesh = [](const ModelPtr& model, const std::string& geom) {
    return std::string(mj_id2name(model.get(), mjOBJ_MESH, model->geom_dataid[Id(model, mjOBJ_GEOM, geom)]));
  };
  ModelPtr model = Compile(composer);
  EXPECT_EQ(model->nmesh, 3);
  EXPECT_EQ(mesh(model, "b/g"), "a/m");
  EXPECT_EQ(mesh(model, "b/h"), "a/n");
  EXPECT_EQ(mesh(model, "c/g"), "c/m");
  EXPECT_EQ(mesh(model, "c/h"), "a/n");
  EXPECT_EQ(model->ntex, 1);
  EXPECT_EQ(model->nmat, 3);
  for (const char* material : {"a/x", "b/x", "c/x"})
    EXPECT_EQ(model->mat_texid[Id(model, mjOBJ_MATERIAL, material)], 0);

  EXPECT_TRUE(composer.KeepTexture("a/t"));
  EXPECT_FALSE(composer.KeepTexture("d/t"));
  EXPECT_EQ(Compile(composer)->ntex, 1);
  EXPECT_TRUE(composer.KeepTexture("b/t"));
  model = Compile(composer);
  EXPECT_EQ(model->ntex, 2);
  Id(model, mjOBJ_TEXTURE, "b/t");
}

TEST(SceneComposer, LightsAreKeptIfTheSceneWantsThem) {
  SceneComposer composer(kModelsData / "world.xml");
  const int of_world = Compile(composer)->nlight;
  composer.Attach(kModelsData / "newer_arm.xml", "arm/", Pose{{1, 0, 0}, {1, 0, 0, 0}},
                  {.stiffness = {{"motor1", 450}}, .keep_lights = true});
  for (const std::string& warning : composer.warnings()) {
    EXPECT_EQ(warning.find("<light>"), std::string::npos) << warning;
  }
  const ModelPtr model = Compile(composer);
  ASSERT_EQ(model->nlight, of_world + 1);
  EXPECT_EQ(model->light_bodyid[of_world], Id(model, mjOBJ_BODY, "arm"));
}

TEST(SceneComposer, EqualCallsGiveEqualBytes) {
  const auto compose = [] {
    SceneComposer composer(kModelsData / "world.xml");
    composer.Attach(kModelsData / "newer_arm.xml", "arm/", Pose{{0.1, 1.0 / 3, 2}, {0.6, 0, 0.8, 0}});
    composer.Attach(kModelsData / "everything.xml", "e/", Pose{});
    return composer.ToXml();
  };
  EXPECT_EQ(compose(), compose());
}

TEST(SceneComposer, BindingsToTheWorldFollowThePart) {
  const OnePart part(
      "<mujoco><worldbody><body name='b' pos='0 0 1'><joint/><geom size='0.1'/></body></worldbody>"
      "<contact><exclude body1='world' body2='b'/></contact><equality><weld body1='b'/></equality></mujoco>");
  const ModelPtr model = Compile(part.composer);
  EXPECT_EQ(model->eq_obj2id[0], Id(model, mjOBJ_BODY, "p"));
}

TEST(SceneComposer, WhatMuJoCoDoesNotKnowIsRefusedByName) {
  const std::string version = mj_versionString();
  EXPECT_EQ(ErrorOfPart("<mujoco>\n<worldbody>\n<frame/>\n</worldbody></mujoco>"),
            "part.xml:3: <frame> in <worldbody> is not known to MuJoCo " + version);
  EXPECT_EQ(ErrorOfPart("<mujoco><worldbody><body>\n<joint dampingg='1'/></body></worldbody></mujoco>"),
            "part.xml:2: <joint>: attribute 'dampingg' is not known to MuJoCo " + version);
  EXPECT_EQ(ErrorOfPart("<mujoco><actuator>\n<position joint='j' dampratio='1'/></actuator></mujoco>"),
            "part.xml:2: <position>: attribute 'dampratio' is not known to MuJoCo " + version +
                "; give the robot's description a position gain");
  EXPECT_EQ(ErrorOfPart("<mujoco>\n<extension/></mujoco>"),
            "part.xml:2: <extension> in <mujoco> is not known to MuJoCo " + version);
  EXPECT_EQ(ErrorOfPart("<mujoco><worldbody><body>\n<composite type='rope' count='3 1 1' "
                        "spacing='1'/></body></worldbody></mujoco>"),
            "part.xml:2: <composite> is not supported");
}

TEST(SceneComposer, CompilerSettings) {
  EXPECT_EQ(ErrorOfPart("<mujoco>\n<compiler boundmass='0.1'/></mujoco>"),
            "part.xml:2: <compiler>: boundmass=\"0.1\" cannot be kept: the scene has \"0\"");
  EXPECT_EQ(ErrorOfPart("<mujoco><compiler boundmass='0.1'/></mujoco>",
                        "<mujoco><compiler boundmass='0.1'/></mujoco>"),
            "(no error)");
  EXPECT_EQ(ErrorOfPart("<mujoco>\n<compiler angle='grad'/></mujoco>"),
            "part.xml:2: <compiler>: attribute 'angle': 'grad' is not allowed");
  EXPECT_EQ(ErrorOfPart("<mujoco>\n<compiler eulerseq='xy'/></mujoco>"),
            "part.xml:2: <compiler>: attribute 'eulerseq': expected three of xyzXYZ, got 'xy'");
  EXPECT_EQ(ErrorOfPart("<mujoco>\n<compiler alignfree='true'/></mujoco>"),
            "part.xml:2: <compiler>: attribute 'alignfree' is not supported");
}

TEST(SceneComposer, FilesThatAreNotThere) {
  EXPECT_EQ(ErrorOfPart("<mujoco><compiler meshdir='m'/><asset>\n<mesh file='no.obj'/></asset></mujoco>"),
            "part.xml:2: <mesh>: file m/no.obj does not exist");
  EXPECT_EQ(ErrorOfPart("<mujoco>\n<include file='no.xml'/></mujoco>"),
            "part.xml:2: model file no.xml does not exist");
  EXPECT_EQ(ErrorOfPart("<mujoco>\n<include file='part.xml'/></mujoco>"),
            "part.xml:2: part.xml includes itself");
  EXPECT_EQ(ErrorOf([] { SceneComposer("/nowhere/base.xml"); }),
            "model file /nowhere/base.xml does not exist");
}

TEST(SceneComposer, BrokenFiles) {
  EXPECT_EQ(ErrorOfPart("<mujoco>\n<worldbody>\n</mujoco>"),
            "part.xml:2: not valid XML (the element that begins here is not closed, or closed by the end of "
            "another element)");
  EXPECT_EQ(ErrorOfPart(""), "part.xml:1: not valid XML (the file is empty)");
  EXPECT_EQ(ErrorOfPart("\n<robot/>"), "part.xml:2: expected an MJCF model (<mujoco>), got <robot>");
  EXPECT_EQ(ErrorOfPart("<mujoco><worldbody>\n<geom euler='1 2'/></worldbody></mujoco>"),
            "part.xml:2: <geom>: attribute 'euler': expected 3 numbers, got '1 2'");
  // The error has one line, whatever the file contains.
  EXPECT_EQ(ErrorOfPart("<mujoco><worldbody><geom euler='1\n2'/></worldbody></mujoco>"),
            "part.xml:1: <geom>: attribute 'euler': expected 3 numbers, got '1 2'");
  EXPECT_EQ(ErrorOfPart("<mujoco><default class='other'/></mujoco>"),
            "part.xml:1: the outermost default class must be called 'main', not 'other'");
}

TEST(SceneComposer, MuJoCosErrorsNameTheLineOfThePart) {
  EXPECT_EQ(ErrorOfPart("<mujoco><worldbody>\n<body name='b'>\n<geom name='g' size='0.1' material='no'/>\n"
                        "</body></worldbody></mujoco>"),
            "part.xml:3: MuJoCo: material 'p/no' not found in geom 0 ('p/g')");
  EXPECT_EQ(ErrorOfPart("<mujoco><worldbody>\n<body>\n<geom size='0.1 x'/>\n</body></worldbody></mujoco>"),
            "part.xml:3: MuJoCo: problem reading attribute 'size' (<geom>)");
  EXPECT_EQ(
      ErrorOfPart("<mujoco><worldbody>\n<body>\n<geom class='no' size='1'/>\n</body></worldbody></mujoco>"),
      "part.xml:3: MuJoCo: unknown default class (<geom>)");
  EXPECT_EQ(ErrorOfPart("<mujoco/>", "<mujoco>\n<option integrator='magic'/></mujoco>"),
            "base.xml:2: MuJoCo: invalid keyword: 'magic' (<option>)");
  EXPECT_EQ(ErrorOfPart("<mujoco><worldbody>\n<body name='b'><joint/></body></worldbody></mujoco>"),
            "part.xml:2: MuJoCo: mass and inertia of moving bodies must be larger than mjMINVAL ('p/b')");
}

TEST(SceneComposer, AttachingWhereItCannotBe) {
  TempFolder folder;
  const auto base = folder.Write("base.xml", "<mujoco><worldbody><body name='post'/></worldbody></mujoco>");
  const auto part = folder.Write("part.xml", "<mujoco><worldbody><geom size='1'/></worldbody></mujoco>");
  SceneComposer composer(base);
  composer.Attach(part, "p/", Pose{});
  EXPECT_EQ(ErrorOf([&] { composer.Attach(part, "p/", Pose{}); }),
            part.string() + ":1: cannot be attached as 'p': a body of this name already exists");
  EXPECT_EQ(ErrorOf([&] { composer.Attach(part, "post/", Pose{}); }),
            part.string() + ":1: cannot be attached as 'post': a body of this name already exists");
  EXPECT_EQ(ErrorOf([&] { composer.Attach(part, "q/", Pose{}, {.parent_body = "p/no"}); }),
            part.string() + ":1: cannot be attached to body 'p/no': the scene has no such body");
  EXPECT_EQ(
      ErrorOf([&] { composer.Attach(part, "q/", Pose{}, {.mount = Mount::kFree, .parent_body = "p"}); }),
      part.string() + ":1: a part on a body cannot be free or placed");
}

TEST(SceneComposer, MassOfAMeshThatIsNotConvex) {
  // The mesh consists of two cubes of 1 m, at x = -1 and 1.
  std::string vertices, faces;
  for (const int cube : {0, 1}) {
    for (int i = 0; i < 8; ++i) {
      const double corner[3] = {2.0 * cube - 1.5 + (i & 1), -0.5 + (i >> 1 & 1), -0.5 + (i >> 2 & 1)};
      for (const double x : corner) vertices += std::to_string(x) + " ";
    }
    for (const int i : {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                        2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5}) {
      faces += std::to_string(i + 8 * cube) + " ";
    }
  }
  OnePart one(
      "<mujoco><asset><mesh name='m' vertex='" + vertices + "' face='" + faces +
      "'/></asset><default><default class='c'><geom density='10'/></default></default><worldbody>"
      "<body name='b'><geom class='c' type='mesh' mesh='m'/><geom type='mesh' mesh='m' mass='2'/></body>"
      "</worldbody></mujoco>");
  const ModelPtr inferred = Compile(one.composer);
  const int body = Id(inferred, mjOBJ_BODY, "p/b");
  ASSERT_TRUE(one.composer.SetMeshMasses(*inferred));
  const ModelPtr corrected = Compile(one.composer);
  // The volumes between the center of mass and the faces of one cube are 1/6, 1/2 and four times 1/6 m^3.
  EXPECT_NEAR(corrected->body_mass[body], 10 * 2 * (1 + 1 / 3.0) + 2, 1e-6);
  one.composer.RemoveMeshMasses();
  EXPECT_EQ(Compile(one.composer)->body_mass[body], inferred->body_mass[body]);
  EXPECT_GT(inferred->body_mass[body], 30);
}

TEST(SceneComposer, GivenMassesOfMeshesStay) {
  OnePart one(
      "<mujoco><asset><mesh name='m' vertex='0 0 0 1 0 0 0 1 0 0 0 1'/></asset><worldbody>"
      "<body name='b'><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/><geom type='mesh' mesh='m'/>"
      "<body name='c'><geom type='mesh' mesh='m' mass='3'/></body></body></worldbody></mujoco>");
  EXPECT_FALSE(one.composer.SetMeshMasses(*Compile(one.composer)));
}

}  // namespace evalbus::scene_composer_test
