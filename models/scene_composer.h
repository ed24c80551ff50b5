// Composes several MJCF files into one document. MuJoCo 2.2 has no attach of its own.
#pragma once

#include <mujoco/mujoco.h>

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "models/pose.h"

namespace evalbus {

// How an attached file's body moves; all but kFixed only on the world.
enum class Mount {
  kFixed,
  kFree,   // on a free joint with the name of the body
  kMocap,  // placed through mjData.mocap_pos and mocap_quat; like a fixed body it never touches the world or
           // other fixed and mocap bodies
};

// Each attached file becomes one body, named after its prefix ("pot" for "pot/"), that stands for the file's
// world: it sits at the given pose and holds the file's bodies, geoms, sites and cameras. Every name in the
// file, and every reference to one, gets the prefix ("pot/handle"). Defaults of one file never reach another.
//
// Each file keeps its own <compiler> settings: angles, Euler sequences and folders are converted; a setting
// that MuJoCo has only once for everything and that differs from the base file's is an InputError. Of
// <option>, <visual>, <statistic> and <size> only the base file's count, and keyframes and lights of attached
// files are dropped. What MuJoCo 2.2 does not know is dropped with a line in warnings() where physics stays
// meaningful, else it is an InputError. All errors name file and line.
class SceneComposer {
 public:
  // base_file: options, floor, lights, cameras; its names stay as they are.
  explicit SceneComposer(const std::filesystem::path& base_file);
  ~SceneComposer();

  // Attaches an MJCF file under a prefix that ends in "/", to the world or to a body attached before
  // ("left/link7"). stiffness: of position servos, by their names in the file, in place of the file's, N m /
  // rad or N / m; these servos lose their velocity gain.
  void Attach(const std::filesystem::path& file, const std::string& prefix, const Pose& pose,
              Mount mount = Mount::kFixed, const std::string& parent_body = "",
              const std::map<std::string, double>& stiffness = {});

  // A camera of the world or of a body, in place of the one there of this name; it looks along its -z axis, y
  // is up in the image, the field of view is the vertical one. Full names, as for all below.
  void SetCamera(const std::string& name, const Pose& pose, double fov_deg, const std::string& body = "");

  // Replaces a joint's attribute ("damping", "armature").
  void SetJointAttribute(const std::string& joint, const std::string& attribute, double value);
  // Bodies that never touch one another.
  void Exclude(const std::string& body, const std::string& other);

  // Gives every body without an <inertial> the inertia it has in `model`, which must be this document
  // compiled.
  void SetInertials(const mjModel& model);

  // The composed document; discard_visual: with the compiler option that drops what is only seen. Equal calls
  // give equal bytes.
  std::string ToXml(bool discard_visual = false) const;
  // "file:line" of the base file's <option>, or of the file if it has none.
  std::string OptionSource() const;
  // "file:line" that a line of ToXml() came from, or empty.
  std::string Locate(int line) const;

  const std::vector<std::string>& warnings() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace evalbus
