// evalbus-collision: contacts and clearance of a run.
#include "bus/host.h"
#include "collision/collision_component.h"

int main(int argc, char** argv) {
  return evalbus::HostMain(
      argc, argv,
      "Checks every STATE on the bus for collisions: CONTACTS lists all touching geom pairs with depth, "
      "point and normal,\n"
      "and from time to time the robot's clearance to the scene. Works on the physics model that MODEL "
      "names.",
      [](CLI::App*) {},
      [](evalbus::Bus* bus) { return std::make_unique<evalbus::collision::CollisionComponent>(bus); });
}
