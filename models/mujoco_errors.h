// MuJoCo's own answers to trouble are to wait for a key and to write a file into the working folder. Here is
// the one owner of the two global handlers that replace them.
#pragma once

#include <functional>
#include <mutex>
#include <string>
#include <vector>

namespace evalbus {

// From now on MuJoCo's errors are EnvironmentErrors and its warnings go to the sink. Once is enough for a
// process, before the first function of MuJoCo that may fail.
void InstallMujocoHandlers();

// Takes MuJoCo's warnings, on whichever thread they arise. Empty: lines on stderr, as at first. What a sink
// refers to must live until another is set and no function of MuJoCo runs that began before.
using MujocoWarningSink = std::function<void(const std::string&)>;
void SetMujocoWarningSink(MujocoWarningSink sink);

// Installs the handlers. While one of these exists, what happens on its thread is a compiler's: errors are
// InputErrors and warnings are appended to a list. One at a time; others wait in the constructor. MuJoCo's
// compiler sets handlers of its own meanwhile, so no other thread may run anything of MuJoCo then.
class MujocoCompileGuard {
 public:
  explicit MujocoCompileGuard(std::vector<std::string>* warnings);
  ~MujocoCompileGuard();
  MujocoCompileGuard(const MujocoCompileGuard&) = delete;
  MujocoCompileGuard& operator=(const MujocoCompileGuard&) = delete;

 private:
  std::unique_lock<std::mutex> lock_;
};

}  // namespace evalbus
