// Composes several MJCF files into one document. MuJoCo 2.2 has no function that attaches models.
#pragma once

#include <mujoco/mujoco.h>

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "models/pose.h"

namespace evalbus {

// How an attached file's body moves. Bodies other than kFixed can be attached only to the world.
enum class Mount {
  kFixed,
  kFree,   // on a free joint with the name of the body
  kMocap,  // placed through mjData.mocap_pos and mocap_quat; like a fixed body, it never collides with the
           // world or with other fixed and mocap bodies
};

// How a file is attached.
struct Attachment {
  Mount mount = Mount::kFixed;
  // Body to which the file is attached. It must already be in the document ("left/link7"); empty for the
  // world.
  std::string parent_body{};
  // Replaces the stiffness of position servos, by their names in the file, N m / rad or N / m, and removes
  // their velocity gain.
  std::map<std::string, double> stiffness{};
  // Bodies of the file that are removed, with everything attached to them.
  std::vector<std::string> without{};
  // True if the file's lights are added to the scene.
  bool keep_lights = false;
};

// Each attached file becomes one body, named after its prefix ("pot" for "pot/"). The body replaces the
// file's world: it has the given pose, and contains the file's bodies, geoms, sites and cameras. Every name
// in the file, and every reference to a name, gets the prefix ("pot/handle"). Defaults of one file never
// affect another. Equal meshes and textures from files are merged, so two arms of one model share them.
//
// Each file keeps its own <compiler> settings: angles, Euler sequences and folders are converted. A setting
// that MuJoCo has only once per document and that differs from the base file's is an InputError. Only the
// base file's <option>, <visual>, <statistic> and <size> are used; keyframes and skyboxes of attached files
// are dropped, and so are their lights unless keep_lights is true. Attributes that MuJoCo 2.2 does not
// support are dropped with a line in warnings() if the physics stays meaningful; otherwise they are an
// InputError. All errors name file and line.
class SceneComposer {
 public:
  // base_file: MJCF file with options, floor, lights and cameras. Its names are not prefixed.
  explicit SceneComposer(const std::filesystem::path& base_file);
  ~SceneComposer();

  // Attaches an MJCF file under a prefix that ends in "/".
  void Attach(const std::filesystem::path& file, const std::string& prefix, const Pose& pose,
              const Attachment& how = {});

  // Adds a camera to the world or a body. If the world or body already has a camera with this name, replaces
  // it. The camera looks along its -z axis, y points up in the image, and the field of view is vertical. This
  // function and all functions below expect names of the composed document, which include the prefixes of the
  // attached files.
  void SetCamera(const std::string& name, const Pose& pose, double fov_deg, const std::string& body = "");

  // Returns whether there is a texture with this name. If it was merged with an equal texture, it becomes a
  // separate texture again.
  bool KeepTexture(const std::string& name);
  // Adds a texture of type 2d from a PNG file. source: "file:line" of its description.
  void AddTexture(const std::string& name, const std::filesystem::path& file, const std::string& source);

  // Adds a site to a body. Throws InputError if there is a site with this name.
  void AddSite(const std::string& name, const Pose& pose, const std::string& body);

  // Replaces an attribute of a joint ("damping", "armature").
  void SetJointAttribute(const std::string& joint, const std::string& attribute, double value);
  // Adds a number to the document's <custom> section, for programs that read the compiled model.
  void SetNumber(const std::string& name, double value);
  // Disables contacts between two bodies.
  void Exclude(const std::string& body, const std::string& other);

  // Sets the inertia of every body that has mass but no <inertial> to its inertia in `model`, which must have
  // been compiled from this document.
  void SetInertials(const mjModel& model);

  // Gives geoms whose mass MuJoCo infers from a mesh the mass density x volume, and returns whether there are
  // any. `model` must have been compiled from this document. MuJoCo 2.2 uses the volume of a box with the
  // mesh's inertia. Newer versions, and this function, use the sum of the tetrahedra between the mesh's
  // center of mass and its faces. For meshes that are not convex, the volumes differ by up to a factor of 2.5
  // in RoboEval's parts. Centers and radii of gyration are the same.
  bool SetMeshMasses(const mjModel& model);
  // Removes the masses that SetMeshMasses() set.
  void RemoveMeshMasses();

  // Returns the composed document. discard_visual: sets the compiler option that drops visual geoms, and
  // omits textures. Equal calls return equal bytes.
  std::string ToXml(bool discard_visual = false) const;
  // Returns "file:line" of the base file's <option>, or of the file if it has no <option>.
  std::string OptionSource() const;
  // Returns "file:line" of the source of a line of ToXml(discard_visual); empty if unknown.
  std::string Locate(int line, bool discard_visual) const;

  const std::vector<std::string>& warnings() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace evalbus
