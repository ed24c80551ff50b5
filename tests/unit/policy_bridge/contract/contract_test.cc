#include "policy_bridge/contract/contract.h"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/sha256.h"
#include "policy_bridge/actions/action_converter.h"
#include "policy_bridge/policy_options.h"
#include "policy_bridge/remote/observation_builder.h"
#include "tests/unit/policy_bridge/policy_scene.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::policy::contract_test {

const std::string kGood = R"(description: as small as one can be
wire: openpi
url: ws://127.0.0.1:8000
rate_hz: 20
observation:
  - {key: image, camera: head, size_px: [64, 48], mirror: true}
  - {key: state, state: [left.joint_position_rad, {signal: left.gripper_opening, scale: -1, offset: 1}]}
  - {key: prompt, prompt: true}
prompts: {lift_pot: up with it}
action:
  kind: joint_delta
  delta_on: measured
  values: 8
  chunk_steps: 10
  execute_steps: 5
  scale: 0.1
  arms:
    - {arm: left, indices: 0-6, gripper: {index: 7, open: -1, closed: 1, threshold: 0}}
)";

// Returns the error of the contract after replacing `from` with `to`.
std::string ErrorWith(const std::string& from, const std::string& to) {
  std::string text = kGood;
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), to);
  try {
    ParseContract(text, "mine.yaml");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(Contract, MatchesItsFile) {
  const Contract contract = ParseContract(kGood, "folder/mine.yaml");
  EXPECT_EQ(contract.name, "mine");
  EXPECT_EQ(contract.wire, Wire::kOpenpi);
  EXPECT_EQ(contract.rate_hz, 20);
  ASSERT_EQ(contract.observation.size(), 3u);
  const ImageForm& form = contract.observation[0].image;
  EXPECT_EQ(form.view.camera, "head");
  EXPECT_EQ(form.view.width_px, 64);
  EXPECT_EQ(form.view.encoding, "rgb8");
  EXPECT_TRUE(form.mirror);
  EXPECT_FALSE(form.chw);
  const std::vector<Signal>& signals = contract.observation[1].signals;
  ASSERT_EQ(signals.size(), 2u);
  EXPECT_EQ(signals[1].name, "left.gripper_opening");
  EXPECT_EQ(signals[1].scale, -1);
  EXPECT_EQ(contract.PromptFor("lift_pot", "lift the pot"), "up with it");
  EXPECT_EQ(contract.PromptFor("pack_box", "close the box"), "close the box");
  EXPECT_EQ(contract.actions.kind, ActionKind::kJointDelta);
  EXPECT_EQ(contract.actions.delta_on, DeltaOn::kMeasured);
  EXPECT_EQ(contract.actions.scale, std::vector<double>(8, 0.1));
  ASSERT_EQ(contract.actions.arms.size(), 1u);
  EXPECT_EQ(contract.actions.arms[0].indices, (std::vector<int>{0, 1, 2, 3, 4, 5, 6}));
  // The threshold is in the middle of -1 to 1, expressed for the value computed from 0 to 1.
  EXPECT_EQ(contract.actions.arms[0].gripper.threshold, 0.5);
  EXPECT_EQ(contract.chunk_steps, 10);
  EXPECT_EQ(contract.execute_steps, 5);
  EXPECT_TRUE(contract.needs_images());
  EXPECT_FALSE(contract.is_privileged());
}

TEST(Contract, MistakesAreReportedWithLineAndKey) {
  const std::vector<std::array<std::string, 3>> mistakes = {
      {"wire: openpi", "wire: openpy", "mine.yaml:2: key 'wire': unknown 'openpy'; did you mean 'openpi'?"},
      {"wire: openpi", "wire: lerobot", std::string("mine.yaml:2: key 'wire': ") + kNoPickles},
      {"ws://127.0.0.1:8000", "http://127.0.0.1:8000",
       "mine.yaml:3: key 'url': http://127.0.0.1:8000: wrong scheme; expected ws://HOST:PORT"},
      {"ws://127.0.0.1:8000", "ws://127.0.0.1:99999",
       "mine.yaml:3: key 'url': ws://127.0.0.1:99999: not a valid port; expected ws://HOST:PORT"},
      {"rate_hz: 20", "rate_hz: fast",
       "mine.yaml:4: key 'rate_hz': expected a number in [5, 500], got 'fast'"},
      {"rate_hz: 20\n", "", "mine.yaml:1: key 'rate_hz': required here, but missing"},
      {"execute_steps: 5", "execute_steps: 11",
       "mine.yaml:15: key 'execute_steps': expected at most 'chunk_steps', 10"},
      {"  execute_steps: 5\n", "",
       "mine.yaml:10: key 'execute_steps': required here, but missing in 'action'"},
      {"  delta_on: measured\n", "",
       "mine.yaml:10: key 'action': expected 'delta_on', target or measured, with this kind"},
      {"kind: joint_delta", "kind: eef_delta", "mine.yaml:10: key 'action': expected 'frame' with this kind"},
      {"left.joint_position_rad", "left.joint_positions_rad",
       "mine.yaml:7: key 'state[0]': unknown signal 'joint_positions_rad'; did you mean "
       "'joint_position_rad'?"},
      {"left.joint_position_rad", "joint_position_rad",
       "mine.yaml:7: key 'state[0]': expected ARM.SIGNAL or object.NAME.SIGNAL, for example "
       "left.joint_position_rad, got 'joint_position_rad'"},
      {", size_px: [64, 48]", "",
       "mine.yaml:6: key 'observation[0]': expected 'size_px': [WIDTH, HEIGHT], the size in which the "
       "camera's image is rendered"},
      {"rate_hz: 20", "rate_hz: 20\nbatch_size: 8",
       "mine.yaml:5: key 'batch_size': only allowed for the wire groot; servers of other wires can batch the "
       "requests of their connections themselves"},
      {"mirror: true", "rotate_deg: 45", "mine.yaml:6: key 'rotate_deg': expected 0, 90, 180 or 270"},
      {"key: prompt", "key: state", "mine.yaml:8: key 'observation[2]': key 'state' given twice"},
      {"key: prompt", "key: [state, x]",
       "mine.yaml:8: key 'observation[2]': keys 'state' and 'state.x': one is the map that contains the "
       "other"},
      {"prompt: true", "prompt: true, mirror: true",
       "mine.yaml:8: key 'mirror': only allowed for a camera or depth"},
      {"index: 7", "index: 8", "mine.yaml:18: key 'index': expected a whole number from 0 to 7, got '8'"},
      {"indices: 0-6", "indices: 2-8", "mine.yaml:18: key 'indices': expected indices less than 'values', 8"},
      {"closed: 1", "closed: -1", "mine.yaml:18: key 'closed': expected a number other than 'open'"},
      {"indices: 0-6", "indices: []", "mine.yaml:18: key 'indices': expected at least one index"},
      {"scale: -1", "indices: []", "mine.yaml:7: key 'indices': expected at least one index"},
      {"scale: -1", "scale: 0", "mine.yaml:7: key 'scale': expected a number other than 0"},
      {"scale: -1", "frame: base", "mine.yaml:7: key 'frame': only allowed for poses of arms"},
      {"left.joint_position_rad", "{signal: object.pot.position_m, point: grip}",
       "mine.yaml:7: key 'point': only allowed for poses of arms"},
      {"offset: 1}]", "offset: 1}], type: uint8",
       "mine.yaml:7: key 'type': requires 'decimals: 0' for each signal, and usually a 'scale', for example "
       "255"},
      {"key: image", "key: []", "mine.yaml:6: key 'key': expected at least one key"},
      {"scale: 0.1\n", "scale: 0.1\n  first_step_rad: 1e308\n",
       "mine.yaml:17: key 'first_step_rad': expected a number in (0, 100], got '1e308'"},
      {"threshold: 0}", "threshold: 2}",
       "mine.yaml:18: key 'threshold': expected a number between 'open' and 'closed'"},
  };
  for (const auto& [from, to, message] : mistakes) EXPECT_EQ(ErrorWith(from, to), message) << to;
}

TEST(Contract, NamesWhatThePolicyWasTrainedOn) {
  const auto with = [](const std::string& key) {
    return ParseContract(key + "\n" + kGood, "folder/mine.yaml");
  };
  EXPECT_TRUE(ParseContract(kGood, "mine.yaml").trained_on.empty());
  const Contract one = with("trained_on: ../demos");
  ASSERT_EQ(one.trained_on.size(), 1u);
  EXPECT_EQ(one.trained_on[0].where, "folder/mine.yaml:1: key 'trained_on'");
  EXPECT_EQ(one.PathOf(one.trained_on[0]), "folder/../demos");
  const Contract two = with("trained_on:\n  - demos\n  - /runs/more");
  ASSERT_EQ(two.trained_on.size(), 2u);
  EXPECT_EQ(two.trained_on[1].where, "folder/mine.yaml:3: key 'trained_on[1]'");
  EXPECT_EQ(two.PathOf(two.trained_on[1]), "/runs/more");
  EXPECT_EQ(ErrorWith("rate_hz: 20", "rate_hz: 20\ntrained_on: []"),
            "mine.yaml:5: key 'trained_on': expected at least one run folder or training set");
  EXPECT_EQ(ErrorWith("rate_hz: 20", "rate_hz: 20\ntrained_on: {run: a}"),
            "mine.yaml:5: key 'trained_on': expected text, got a map");
}

TEST(Contract, AConstantIsATextOrNumbersOrAnInteger) {
  const auto constant = [](const std::string& value) {
    std::string text = kGood;
    const std::string prompt = "prompt: true";
    return ParseContract(text.replace(text.find(prompt), prompt.size(), "constant: " + value), "mine.yaml")
        .observation[2]
        .constant;
  };
  EXPECT_EQ(constant("'7'"), Value("7"));
  EXPECT_EQ(constant("v1.0"), Value("v1.0"));
  EXPECT_EQ(
      ErrorWith("prompt: true", "constant: 7"),
      "mine.yaml:8: key 'constant': expected {integer: 7} for a whole number, [7] for a float32 or '7' for a "
      "text, got 7 without quotes");
  EXPECT_EQ(constant("[7]"), Value(FloatArray({7}, {1})));
  EXPECT_EQ(constant("{integer: 7}"), Value(7));
  EXPECT_EQ(constant("{integer: -1}"), Value(-1));
  EXPECT_EQ(ErrorWith("prompt: true", "constant: {integer: 0.5}"),
            "mine.yaml:8: key 'integer': expected a whole number from -1000000000 to 1000000000, got '0.5'");
  EXPECT_EQ(ErrorWith("prompt: true", "constant: {number: 7}"),
            "mine.yaml:8: key 'number': unknown key here; expected one of integer");
}

// Contracts that differ in the policy's inputs, or in the actions that they refuse, are different.
TEST(Contract, JsonHasTheValuesOfConstantsAndTheFirstStep) {
  const auto constant = [](const std::string& text) {
    std::string all = kGood;
    const std::string prompt = "prompt: true";
    all.replace(all.find(prompt), prompt.size(), "constant: " + text);
    const nlohmann::ordered_json json = ContractJson(ParseContract(all, "mine.yaml"));
    return json["observation"][2]["constant"].dump();
  };
  EXPECT_EQ(constant("[0, 0.5, 1]"), "[0.0,0.5,1.0]");
  EXPECT_EQ(constant("[5, 0.5, 1]"), "[5.0,0.5,1.0]");
  EXPECT_EQ(constant("'7'"), "\"7\"");
  EXPECT_EQ(constant("{integer: 7}"), "{\"integer\":7}");
  const std::string text(300, 'a');
  EXPECT_EQ(constant(text), "\"" + text + "\"");
  Contract contract = ParseContract(kGood, "mine.yaml");
  contract.first_step_rad = 0.25;
  EXPECT_EQ(ContractJson(contract)["action"]["first_step_rad"], 0.25);
  EXPECT_FALSE(ContractJson(contract).contains("groot_dialect"));
  contract.groot_dialect = ClientOptions::GrootDialect::kN16;
  EXPECT_EQ(ContractJson(contract)["groot_dialect"], "n1.6");
}

// A process that is restarted during a run reads the contract's file again.
TEST(Contract, OfARunIsTheOneThatTheLauncherRead) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "mine.yaml";
  std::ofstream(file) << kGood;
  for (const std::string& policy : {file.string(), std::string("ws://127.0.0.1:9")}) {
    PolicyOptions options{.policy = policy, .contract = policy == file ? "" : file.string()};
    options.contract_sha256 = Sha256Text(kGood);
    EXPECT_EQ(FindContractOf(options)->text, kGood);
    options.contract_sha256 = Sha256Text(kGood + "# another\n");
    try {
      FindContractOf(options);
      ADD_FAILURE() << policy;
    } catch (const InputError& error) {
      EXPECT_EQ(error.what(),
                file.string() + " changed during the run; restore it and use --resume, or start a new run");
    }
  }
}

// docs/connecting_a_policy.md, Actions, describes DROID's velocities.
TEST(Contract, AVelocityIsOnTheTargetOrOnTheMeasurement) {
  std::string text = kGood;
  const std::string kind = "kind: joint_delta";
  text.replace(text.find(kind), kind.size(), "kind: joint_velocity");
  const Contract contract = ParseContract(text, "mine.yaml");
  EXPECT_EQ(contract.actions.kind, ActionKind::kJointVelocity);
  EXPECT_EQ(contract.actions.delta_on, DeltaOn::kMeasured);
  EXPECT_EQ(ContractJson(contract)["action"]["delta_on"], "measured");
  EXPECT_EQ(ErrorWith("kind: joint_delta\n  delta_on: measured", "kind: joint_velocity"),
            "mine.yaml:10: key 'action': expected 'delta_on', target or measured, with this kind");
  EXPECT_EQ(ErrorWith("kind: joint_delta", "kind: joint_position"),
            "mine.yaml:12: key 'delta_on': only allowed for deltas and velocities");
}

TEST(Contract, AllPresetsAreReadableAndDistinguishable) {
  const std::vector<Contract> all = AllContracts();
  std::vector<std::string> names, jsons;
  for (const Contract& contract : all) {
    names.push_back(contract.name);
    jsons.push_back(ContractJson(contract).dump());
    EXPECT_FALSE(contract.description.empty()) << contract.name;
    EXPECT_TRUE(IsContract(contract.name));
    EXPECT_NO_THROW(MakePolicyClient(ClientOptionsOf(contract))) << contract.name;
  }
  EXPECT_EQ(names,
            (std::vector<std::string>{"groot_bimanual_panda", "openpi_aloha", "openpi_droid", "openpi_libero",
                                      "openvla", "openvla_oft_aloha", "plain", "roboarena", "roboeval",
                                      "roboeval_dev", "vla_eval", "xpolicylab"}));
  std::ranges::sort(jsons);
  EXPECT_EQ(std::ranges::adjacent_find(jsons), jsons.end());
  EXPECT_FALSE(IsContract("expert"));
  EXPECT_FALSE(IsContract("replay:runs/a.yaml/b"));
  try {
    FindContract("roboval");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(), "there is no policy contract 'roboval'; did you mean 'roboeval'?");
  }
}

// Contracts for a Panda fit the robot of LiftPot. ALOHA's arms have six joints, and this is reported.
TEST(Contract, PresetsFitTheRobotsTheyAreFor) {
  const PolicyScene& scene = GetPolicyScene();
  for (const Contract& contract : AllContracts()) {
    const bool is_aloha = contract.name.find("aloha") != std::string::npos;
    try {
      ActionConverter(contract.actions, scene.model(), scene.info());
      ObservationBuilder(contract, scene.model(), scene.info());
      EXPECT_FALSE(is_aloha) << contract.name;
    } catch (const InputError& error) {
      EXPECT_TRUE(is_aloha) << contract.name << ": " << error.what();
    }
  }
}

TEST(Contract, KeyComesFromTheEnvironment) {
  Contract contract = ParseContract(kGood, "mine.yaml");
  contract.api_key_env = "EVALBUS_TEST_NO_SUCH_KEY";
  EXPECT_THROW(ClientOptionsOf(contract), InputError);
  setenv("EVALBUS_TEST_NO_SUCH_KEY", "secret", 1);
  EXPECT_EQ(ClientOptionsOf(contract).api_key, "secret");
  unsetenv("EVALBUS_TEST_NO_SUCH_KEY");
  EXPECT_EQ(ContractJson(contract).dump().find("secret"), std::string::npos);
}

}  // namespace evalbus::policy::contract_test
