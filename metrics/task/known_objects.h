// Which conditions of a task can be judged where a source does not know the poses of all manipulated objects
// (model_info_t.object_is_tracked). Pure.
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

  // Every object's pose is known.
  bool all() const { return unknown_.empty(); }
  // By geom id: 1 for the geoms of objects whose poses are not known; empty where all are.
  const std::vector<uint8_t>& unknown_geoms() const { return unknown_geoms_; }
  // One of these geoms must not be touched (model_info_t.forbidden_contact_geom).
  bool lacks_forbidden_contact_geoms() const { return lacks_forbidden_contact_geoms_; }

  // No name in the expression stands for an object that is not known, or for a part of it; of `reached`, in
  // the expression of that stage. An expression that is not there is known.
  bool Knows(const Expression& expression, const TaskDescription& task) const;

 private:
  bool KnowsNames(const YamlValue& value) const;

  std::vector<std::string> unknown_;
  std::vector<uint8_t> unknown_geoms_;
  bool lacks_forbidden_contact_geoms_ = false;
};

}  // namespace evalbus::metrics
