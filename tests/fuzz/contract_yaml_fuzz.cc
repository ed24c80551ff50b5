// Reads arbitrary text as a policy's contract, converts it to JSON, and checks it against the robot of a
// small scene.
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "policy_bridge/actions/action_converter.h"
#include "policy_bridge/contract/contract.h"
#include "policy_bridge/remote/observation_builder.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/small_scene.h"

FUZZ_TARGET(contract_yaml) {
  using namespace evalbus;
  static const SmallScene folder;
  static const TaskDescription task = ParseTask(SmallTask(), folder.path() / "task.yaml", true);
  static const Scene scene = BuildScene(task, LoadRobot(folder.path() / "robot.yaml"));
  try {
    const policy::Contract contract = policy::ParseContract(std::string(data, data + size), "contract.yaml");
    policy::ContractJson(contract).dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
    policy::ActionConverter(contract.actions, *scene.physics, scene.info);
    policy::ObservationBuilder(contract, *scene.physics, scene.info);
  } catch (const InputError&) {
  }
  return 0;
}
