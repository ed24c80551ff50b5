// What a policy process is told: the part of a run's options that `evalbus run` and `evalbus-policy` share.
#pragma once

#include <string>
#include <tuple>

#include "base/options.h"
#include "policy_bridge/factory.h"

namespace evalbus::policy {

struct PolicyOptions {
  // As CheckPolicy takes it.
  std::string policy = "expert";
};

template <class Options, class F>
requires std::is_same_v<std::remove_const_t<Options>, PolicyOptions>
void ForEachOption(Options& options, const F& f) {
  constexpr bool kFixed = true;
  ForEachRow(std::tuple{Option{&PolicyOptions::policy, "policy",
                               PolicyHelp() + "\nlcm: a process of yours on --url", Range{}, kFixed}},
             options, f);
}

}  // namespace evalbus::policy
