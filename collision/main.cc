// evalbus-collision: contacts and clearance of a run.
#include <string>

#include "base/arguments.h"
#include "base/json_file.h"
#include "base/options_json.h"
#include "bus/host.h"
#include "collision/collision_component.h"
#include "sim/sim_options.h"

int main(int argc, char** argv) {
  std::string contacts = evalbus::sim::contacts_from::kShapes;
  return evalbus::HostMain(
      argc, argv,
      "Checks every STATE on the bus for collisions: CONTACTS lists all touching geom pairs with depth, "
      "point and normal,\n"
      "and from time to time the robot's clearance to the scene. Works on the physics model that MODEL "
      "names.",
      [&](CLI::App* app) {
        evalbus::AddOptionsFile(app, [&](const std::string& file) {
          evalbus::sim::SimOptions sim;
          evalbus::ReadOptions(evalbus::ReadJsonFile(file), file, &sim);
          contacts = sim.contacts;
        });
        app->add_option("--contacts", contacts,
                        "what decides contacts: shapes (this checker) or source (MEASURED_CONTACTS)")
            ->check(
                CLI::IsMember({evalbus::sim::contacts_from::kShapes, evalbus::sim::contacts_from::kSource}))
            ->capture_default_str();
      },
      [&](evalbus::Bus* bus) {
        return std::make_unique<evalbus::collision::CollisionComponent>(
            bus, contacts == evalbus::sim::contacts_from::kSource);
      });
}
