// evalbus-policy: a policy of a run.
#include <CLI/CLI.hpp>

#include "policy_bridge/factory.h"
#include "policy_bridge/policy_component.h"

int main(int argc, char** argv) {
  std::string policy = "expert";
  return evalbus::HostMain(
      argc, argv, "Runs a policy: answers every state of the sim with an action.",
      [&](CLI::App* app) {
        app->add_option("--policy", policy, evalbus::policy::PolicyHelp())->capture_default_str();
      },
      [&](evalbus::Bus* bus) { return std::make_unique<evalbus::policy::PolicyComponent>(bus, policy); });
}
