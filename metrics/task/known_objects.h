// Determines which conditions of a task can be judged if a source does not provide the poses of all
// manipulated objects (model_info_t.object_is_tracked). Pure.
#pragma once

#include <string>
#include <vector>

#include "evalbus/model_info_t.hpp"
#include "models/expression.h"
#include "models/task_description.h"

namespace evalbus::metrics {

class KnownObjects {
 public:
  explicit KnownObjects(const model_info_t& model);

  // Returns whether every object's pose is known.
  bool all() const { return unknown_.empty(); }
  // Returns 1 for each geom id that belongs to an object with an unknown pose, otherwise 0; empty if all
  // poses are known.
  const std::vector<uint8_t>& unknown_geoms() const { return unknown_geoms_; }
  // Returns whether a geom that must not be touched (model_info_t.forbidden_contact_geom) is among the
  // unknown geoms.
  bool lacks_forbidden_contact_geoms() const { return lacks_forbidden_contact_geoms_; }

  // Returns false if a name in the expression refers to an object with an unknown pose, or to a part of such
  // an object. `reached` stands for the expression of its stage. Returns true for an absent expression.
  bool Knows(const Expression& expression, const TaskDescription& task) const;

 private:
  bool KnowsNames(const YamlValue& value) const;

  std::vector<std::string> unknown_;
  std::vector<uint8_t> unknown_geoms_;
  bool lacks_forbidden_contact_geoms_ = false;
};

}  // namespace evalbus::metrics
