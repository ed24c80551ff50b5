// The options in a run's run.json that evalbus-collision needs.
#pragma once

#include <string>
#include <tuple>
#include <type_traits>

#include "base/options.h"
#include "lcmtypes/source.h"

namespace evalbus::collision {

struct CollisionOptions {
  std::string contacts = contacts_from::kShapes;
};

template <class Options, class F>
requires std::is_same_v<std::remove_const_t<Options>, CollisionOptions>
void ForEachOption(Options& options, const F& f) {
  ForEachRow(std::tuple{Option{&CollisionOptions::contacts, "contacts",
                               "what decides contacts: shapes (this checker) or source (MEASURED_CONTACTS)"}},
             options, f);
}

}  // namespace evalbus::collision
