// evalbus-collision: computes contacts and clearance of a run.
#include "base/arguments.h"
#include "bus/host.h"
#include "collision/collision_component.h"
#include "collision/collision_options.h"

int main(int argc, char** argv) {
  evalbus::collision::CollisionOptions options;
  return evalbus::HostMain(
      argc, argv,
      "Checks every STATE on the bus for collisions: CONTACTS lists all touching geom pairs with depth, "
      "point and normal,\n"
      "and from time to time the robot's clearance to the scene. Works on the physics model that MODEL "
      "names.",
      [&](CLI::App* app) { evalbus::AddOptions(app, &options); },
      [&](evalbus::Bus* bus) {
        evalbus::contacts_from::Check(options.contacts);
        return std::make_unique<evalbus::collision::CollisionComponent>(
            bus, options.contacts == evalbus::contacts_from::kSource);
      });
}
