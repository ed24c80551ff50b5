// evalbus-policy: the process that executes the policy of a run.
#include "base/arguments.h"
#include "base/plugins.h"
#include "bus/host.h"
#include "policy_bridge/policy_component.h"
#include "policy_bridge/policy_options.h"

int main(int argc, char** argv) {
  if (const auto code = evalbus::LoadPlugins(evalbus::kPolicyPlugins)) return *code;
  evalbus::policy::PolicyOptions options;
  return evalbus::HostMain(
      argc, argv, "Runs a policy: answers every state of the sim with an action.",
      [&](CLI::App* app) { evalbus::AddOptions(app, &options); },
      [&](evalbus::Bus* bus) { return std::make_unique<evalbus::policy::PolicyComponent>(bus, options); });
}
