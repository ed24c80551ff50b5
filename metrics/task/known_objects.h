// Determines which conditions of a task can be judged if a source does not provide the poses of all
// manipulated objects (model_info_t.object_is_tracked). A source never provides the poses of other parts, so
// those of free and of placed parts are unknown, too. Pure.
#pragma once

#include <string>
#include <vector>

#include "evalbus/model_info_t.hpp"
#include "models/expression.h"
#include "models/task_description.h"

namespace evalbus::metrics {

class KnownObjects {
 public:
  KnownObjects(const model_info_t& model, const TaskDescription& task);

  // Returns whether every manipulated object's pose is known.
  bool all() const { return all_objects_; }
  // Returns 1 for each geom id that belongs to an object or part with an unknown pose, otherwise 0; empty if
  // all poses are known.
  const std::vector<uint8_t>& unknown_geoms() const { return unknown_geoms_; }
  // Returns whether a geom that must not be touched (of a part that is not manipulated, or in
  // model_info_t.forbidden_contact_geom) is among the unknown geoms.
  bool lacks_forbidden_contact_geoms() const { return lacks_forbidden_contact_geoms_; }

  // Returns false if a name in the expression refers to an object or part with an unknown pose, or to
  // something in it. `reached` stands for the expression of its stage. Returns true for an absent expression.
  bool Knows(const Expression& expression, const TaskDescription& task) const;

 private:
  void AddUnknown(const std::string& name, const model_info_t& model);
  bool KnowsNames(const YamlValue& value) const;

  std::vector<std::string> unknown_;
  std::vector<uint8_t> unknown_geoms_;
  bool all_objects_ = true, lacks_forbidden_contact_geoms_ = false;
};

}  // namespace evalbus::metrics
