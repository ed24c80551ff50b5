// evalbus-policy: the built-in policies of a run.
#include <CLI/CLI.hpp>

#include "policy_bridge/policy_component.h"

int main(int argc, char** argv) {
  std::string policy = "expert";
  return evalbus::HostMain(
      argc, argv, "Answers every STATE on the bus with an ACTION.",
      [&](CLI::App* app) {
        app->add_option(
               "--policy", policy,
               "expert: scripted solution of the task; noisy_expert: the same, disturbed; random: smooth "
               "random\n"
               "targets; hold: stays at home; replay:RUN_OR_LOG: the recorded actions of an earlier run")
            ->capture_default_str();
      },
      [&](evalbus::Bus* bus) { return std::make_unique<evalbus::PolicyComponent>(bus, policy); });
}
