// Replaces MuJoCo's global error and warning handlers. By default, MuJoCo waits for a key on errors, and
// writes a log file into the working folder. Only this file sets the handlers.
#pragma once

#include <functional>
#include <mutex>
#include <string>
#include <vector>

namespace evalbus {

// Turns MuJoCo's errors into EnvironmentError and sends its warnings to the sink. With MuJoCo 2.2, also
// installs the contacts of models/polyhedron_contacts.h. Must be called before the first MuJoCo function that
// can fail. Repeated calls have no effect.
void InstallMujocoHandlers();

// A sink receives MuJoCo's warnings, on the thread on which they occur. If it is empty (default), warnings
// are printed on stderr. Objects that the sink references must live until another sink is set and all MuJoCo
// functions that were called before have returned.
using MujocoWarningSink = std::function<void(const std::string&)>;
void SetMujocoWarningSink(MujocoWarningSink sink);

// Installs the handlers. While a guard exists, errors on its thread throw InputError, because they come from
// a user's model, and warnings are appended to a list. Only one guard exists at a time; other threads wait in
// the constructor. Because MuJoCo's compiler temporarily sets its own handlers, no other thread may call
// MuJoCo while a guard exists.
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
