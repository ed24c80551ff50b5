// Writes the initial corpus to CORPUS/TARGET/. Run it when a message type or the input format of a target
// changes.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "base/random.h"
#include "bus/channels.h"
#include "bus/event_log.h"
#include "evalbus/all_messages.hpp"
#include "policy_bridge/contract/contract.h"
#include "policy_bridge/wire/codecs.h"
#include "tests/fuzz/conversation.h"
#include "tests/fuzz/small_scene.h"
#include "tests/unit/lcm_datagram.h"
#include "tests/unit/small_world.h"

namespace evalbus {
namespace {

// A contract for arms of one joint that has one value of every kind.
constexpr char kSmallContract[] = R"(description: all there is
wire: groot
groot_dialect: n1.6_flat
url: tcp://127.0.0.1:5555
api_key_env: KEY
deadlines: {connect_s: 1, first_reply_s: 2, reply_s: 3, return_s: 4}
rate_hz: 20
answer_window: 0.25
settle_steps: 2
prompts: {small: go}
observation:
  - {key: [video, a], camera: view, size_px: [8, 6], fovy_deg: 50, shadows: false, rotate_deg: 90, mirror: true,
     resize_px: [4, 4], resize: stretch, color: bgr, layout: chw, history_ticks: [-2, 0]}
  - {key: [video, b], depth: view, size_px: [8, 6]}
  - key: state.all
    type: float64
    shape: [1, 6]
    state:
      - left.joint_position_rad
      - {signal: right.gripper_opening, scale: -1, offset: 1, decimals: 1}
      - {signal: left.position_m, indices: [2, 0], frame: base}
      - {signal: object.pot.rotation_6d, indices: 0-1}
  - {key: text, prompt: true}
  - {key: word, constant: word}
  - {key: numbers, constant: [1, 2]}
  - {key: step, counter: observation}
action:
  keys: [a, b]
  kind: eef_delta
  delta_on: measured
  frame: wrist
  point: flange
  rotation: axis_angle_robosuite
  values: 8
  chunk_steps: 4
  execute_steps: 2
  first_step_rad: 1
  scale: 0.5
  offset: [0, 0, 0, 0, 0, 0, 0, 1]
  lower: -1
  upper: 1
  arms:
    - {arm: left, indices: 0-5, gripper: {index: 6, open: 1, closed: -1, threshold: 0.5, sticky_steps: 2}}
)";

// A task with every predicate and quantity, and with all randomizations except textures.
constexpr char kAllWords[] = R"(name: words
title: Every word of a task description
instruction: lift it
robot: {file: robot.yaml, base: {position_m: [0, 0, 0], yaw_deg: 3}}
time_limit_s: 1
scene:
  base: scene.xml
  parts:
    - {name: counter, model: counter.xml, pose: {position_m: [0.7, 0, 0]}}
    - {name: pot, model: pot.xml, pose: {position_m: [0.7, 0, 1.1], quaternion_wxyz: [1, 0, 0, 0]}, free: true}
    - {name: lid, model: pot.xml, pose: {position_m: [0.7, 0.4, 1.1], yaw_rad: 1}}
    - {name: cup, model: pot.xml, pose: {position_m: [0.7, -0.4, 1.1]}, free: true}
  cameras: {front: {position_m: [1, 0, 1], look_at_m: [0, 0, 1], vertical_fov_deg: 50}}
objects: [pot, {name: lid, may_touch: [lid/handle]}]
joints: {left/joint: {position_deg: 5}}
variations:
  all:
    alias: All
    randomize:
      - spawn_box: {object: pot, center_m: [0.7, 0], half_extents_m: [0.1, 0.1], min_distance_m: 0.1}
      - spawn_plane: {objects: [lid], origin_m: [0.7, 0.5, 1.1], half_extents_m: [0.1, 0.1], spacing_m: 0.1,
                      jitter_m: [0.01, 0.01, 0]}
      - spawn_yaw: {object: pot, bound_deg: 30}
      - spawn_joint: {joint: right/joint, min_deg: -5, max_rad: 0.1}
      - distractors: {objects: [cup], center_m: [0.7, -0.4], half_extents_m: [0.1, 0.1], min_count: 0, max_count: 1}
      - mass: {of: [pot], min_factor: 0.5, max_factor: 2}
      - friction: {of: [pot, left/hand], min_factor: 0.5, max_factor: 2}
      - color: {of: [pot], min_rgb: [0, 0, 0], max_rgb: [1, 1, 1]}
      - light: {name: key, min_factor: 0.5, max_factor: 2}
      - camera: {name: overview, shift_m: [0.1, 0.1, 0.1], turn_deg: 5}
    joints: {left/joint: {position_rad: 0.1}}
    cameras: {overview: {position_m: [1, 0, 1], look_at_m: [0, 0, 1], vertical_fov_deg: 50}}
    instruction: lift this
    poses: {lid: {position_m: [0.7, 0.5, 1.1]}}
    parts:
      - {name: post, model: counter.xml, pose: {position_m: [5, 0, 1]}}
    robot_base: {position_m: [0, 0, 0.1]}
    failure: {position: {object: pot, axis: z, max_m: 0.1}}
metrics: {slip_sample_window_ticks: 1, collision_sample_window_ticks: 2, track_joint_jerk: true}
stages:
  - {name: held, when: {holding: {gripper: first, object: pot}}}
  - {name: other, when: {holding: {gripper: other, object: pot}}}
  - {name: left, when: {latched: {holding: {gripper: left, object: pot}}}}
  - {name: high, when: {height_above: {object: pot, min_m: 1.05}}}
  - {name: there, when: {inside: {object: pot, center_m: [0.7, 0, 1], half_extents_m: [0.1, 0.1, 0.1]}}}
  - {name: bent, when: {joint_fraction: {joint: left/joint, min: 0.4}}}
  - {name: near, when: {distance: {a: pot, b: lid, max_m: 0.3}}}
  - {name: lies, when: {on: {object: pot, support: counter}}}
  - {name: still, when: {lasts: {min_s: 0.04, when: {speed: {object: pot, max_mps: 0.1}}}}}
  - {name: rests, when: {all: [reached: {stage: still}, joint_speed: {arm: all, max_radps: 1}]}}
  - {name: above, when: {inside: {object: pot, frame: lid, center_m: [0, 0, 0], half_extents_m: [1, 1, 1]}}}
success:
  any:
    - all: [not: {touching: {a: pot, b: counter}}, tilt_below: {object: pot, axis: x, max_deg: 5}]
    - {touching: {a: left_gripper, b: pot}}
target_distance: {between: {distance: {a: left, b: pot}}, lift: {lift: {object: pot}}}
pose_error: {tilt: {object: pot, axis: x}}
other_robots: {small: {target_distance: {joint_fraction: {joint: right/joint}}}}
)";

// A run.json and episodes with its seeds.
std::string SmallRun() {
  std::string text =
      R"({"run_id": "run", "task": "lift_pot", "variation": "base", "policy": "hold", "episodes": 2, "seed": 7, )"
      R"("control_hz": 50.0, "task_sha256": "0", "physics_sha256": "0"})";
  for (int episode = 0; episode < 2; ++episode) {
    text +=
        R"(
{"task": "lift_pot", "variation": "base", "episode": )" +
        std::to_string(episode) + R"(, "seed": )" +
        std::to_string(SeedSource{7, kSharedSeeds, {}, {}}.OfEpisode(episode)) +
        R"(, "end_reason": "success", "failure_reason": "", "complete": true, "metrics": {"success": 1.0, )"
        R"("completion_time_s": 3.5, "path": {"left": 1.5}}, "extended": {"missing_ticks": 0}})";
  }
  return text + "\n";
}

void Write(const std::filesystem::path& file, const Bytes& bytes) {
  std::filesystem::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

// Writes messages of policy servers.
void WriteWires(const std::filesystem::path& corpus) {
  using policy::Array, policy::List, policy::Map, policy::Value;
  const auto write_text = [&](const char* target, const char* name, const std::string& text) {
    Write(corpus / target / name, Bytes(text.begin(), text.end()));
  };
  const Array actions = policy::FloatArray({0.5, -1, 0, 1}, {1, 2, 2});
  Write(corpus / "npy" / "actions", policy::EncodeNpy(actions));
  Write(corpus / "npy" / "number", policy::EncodeNpy({"<i8", {}, Bytes(8)}));
  Write(corpus / "npy" / "bytes", policy::EncodeNpy({"|u1", {3}, {0, 1, 2}}));
  write_text("json_numpy", "array", policy::EncodeJsonNumpy(actions));
  write_text("json_numpy", "rows",
             policy::EncodeJsonNumpy(List{Value(actions), Value(Array{"<f8", {}, Bytes(8)})}));
  write_text("json_numpy", "all", R"({"z": [null, true, -1, 2.5e3, "\u00e9\n", {}, []], "a": "error"})");
  const auto groot = [&](const char* name, const Value& value) {
    Write(corpus / "groot_codec" / name, policy::EncodeGroot(value));
  };
  groot("actions", List{Value(Map{{"arm", actions}}), Value(Map{})});
  groot("all", Map{{"z", List{nullptr, true, -1, 1 << 20, 2.5, "text", Bytes{1, 2}}}, {"error", "words"}});
  const Map modality = {{"delta_indices", List{0}}, {"modality_keys", List{"front"}}};
  groot(
      "configuration",
      Map{{"video", Map{{"__ModalityConfig_class__", true}, {"as_json", policy::EncodeJsonNumpy(modality)}}},
          {"state", Map{{"__ModalityConfig_class__", true}, {"as_dict", modality}}}});
}

void WriteAll(const std::filesystem::path& corpus) {
  int type = 0;
  ForEachMessage([&]<class Message>(const Message& empty) {
    Bytes bytes = Encode(empty);
    bytes.erase(bytes.begin(), bytes.begin() + 7);
    bytes[0] = static_cast<uint8_t>(type++);
    Write(corpus / "messages" / Message::getTypeName(), bytes);
  });

  // Writes whole and fragmented messages of two senders that interleave. One message is truncated.
  Bytes traffic;
  const auto send = [&](uint8_t sender, const std::string& datagram) {
    traffic.insert(traffic.end(), {sender, static_cast<uint8_t>(datagram.size() >> 8),
                                   static_cast<uint8_t>(datagram.size())});
    traffic.insert(traffic.end(), datagram.begin(), datagram.end());
  };
  const auto long_one = Fragments(7, "EVALBUS_MODEL", std::string(40, 'm'), 20);
  const auto other = Fragments(7, "B", std::string(30, 'b'), 16);
  send(1, MessageDatagram(6, "EVALBUS_STATE", "state"));
  for (size_t i = 0; i < 2; ++i) {
    send(1, long_one[i]);
    send(2, other[i]);
  }
  send(1, long_one[2]);
  Write(corpus / "datagrams/interleaved", traffic);

  // Writes an episode of five ticks as a Conversation for each of the components except CameraComponent, and
  // as a recorded log.
  const auto spoken = SpokenChannels();
  const auto channel = [&](std::string_view name) {
    return static_cast<uint8_t>(std::ranges::find(spoken, name, &SpokenChannel::name) - spoken.begin());
  };
  Bytes conversation;
  const auto say = [&](std::string_view name, uint8_t number) {
    conversation.insert(conversation.end(), {channel(name), number, 0});
  };
  for (uint8_t tick = 0; tick < 5; ++tick) {
    for (const char* name : {channels::kState.name, channels::kContacts.name, channels::kAction.name,
                             channels::kPartial.name, channels::kStatus.name}) {
      say(name, tick);
    }
    conversation.insert(conversation.end(), {kWait, 1});
  }
  say(channels::kEpisodeEnd, 0);
  say(channels::kEpisodeSummary, 0);
  say(channels::kRunSummary, 0);
  for (uint8_t i = 5; i < 50; ++i) say(channels::kStatus, i);
  const auto with_first = [&](uint8_t first) {
    Bytes input = conversation;
    input.insert(input.begin(), first);
    return input;
  };
  for (uint8_t part = 0; part < 9; ++part) {
    Write(corpus / "components" / ("episode_" + std::to_string(part)), with_first(part));
  }
  Bytes recorded = {128, channel(channels::kModel), 0, 0, channel(channels::kEpisodeBegin), 0, 0};
  recorded.insert(recorded.end(), conversation.begin(), conversation.end());
  Write(corpus / "event_log" / "conversation", recorded);
  // For CameraComponent, a policy requests images before and after the STATE of each tick.
  conversation = {9};
  for (uint8_t tick = 0; tick < 5; ++tick) {
    say(channels::kRequestImage.name, tick);
    say(channels::kState.name, tick);
    say(channels::kRequestImage.name, tick);
  }
  Write(corpus / "components/episode_9", conversation);

  // Writes an episode of three ticks as a log.
  const std::filesystem::path file = corpus / "event_log" / "episode";
  std::filesystem::remove(file);
  EventLogWriter log(file);
  log.Write(channels::kModel, Encode(small_world::Model()), 0);
  log.Write(channels::kEpisodeBegin, Encode(episode_begin_t{}), 0);
  for (int64_t tick = 0; tick < 3; ++tick) {
    log.Write(channels::kState, Encode(small_world::State(tick)), 0);
    log.Write(channels::kContacts, Encode(small_world::Contacts(tick)), 0);
  }
  episode_end_t end{};
  end.header = small_world::Header(2);
  end.end_reason = "time_limit";
  log.Write(channels::kEpisodeEnd, Encode(end), 0);
  log.Close();
  std::ifstream stream(file, std::ios::binary);
  Bytes bytes{std::istreambuf_iterator<char>(stream), {}};
  bytes.insert(bytes.begin(), 0);
  Write(file, bytes);

  // Writes small files of each kind.
  const auto write_text = [&](const char* target, const char* name, const std::string& text) {
    Write(corpus / target / name, Bytes(text.begin(), text.end()));
  };
  write_text("task_yaml", "small", SmallTask());
  write_text("task_yaml", "all_words", kAllWords);
  write_text("robot_yaml", "small", kSmallRobot);
  write_text("mjcf", "pot", kSmallPot);
  write_text("mjcf", "counter", kSmallCounter);
  write_text("run_reader", "run", SmallRun());
  write_text("contract_yaml", "small", kSmallContract);
  for (const policy::Contract& contract : policy::AllContracts()) {
    write_text("contract_yaml", contract.name.c_str(), contract.text);
  }

  // Writes requests to a policy server and its answers, in all formats of arrays.
  const policy::Value exchange = policy::Map{
      {"image", policy::Array{"|u1", {1, 2, 3}, policy::Bytes(6)}},
      {"actions", policy::FloatArray({0.5, -1}, {1, 2})},
      {"big_endian",
       policy::Map{
           {"__ndarray__", true}, {"dtype", ">f8"}, {"shape", policy::List{1}}, {"data", policy::Bytes(8)}}},
      {"scalar", policy::Map{{"__npgeneric__", true}, {"data", 1.5}, {"dtype", "<f8"}}},
      {"others", policy::List{nullptr, true, -1, 70000, "text", policy::Bytes{1, 2}, policy::List{}}}};
  Write(corpus / "msgpack/bytes", EncodeMsgpack(exchange, policy::ArrayKeys::kBytes));
  Write(corpus / "msgpack/texts", EncodeMsgpack(exchange, policy::ArrayKeys::kTexts));
  Write(corpus / "msgpack/msgpack_numpy", EncodeMsgpack(exchange, policy::ArrayKeys::kMsgpackNumpy));
  WriteWires(corpus);
}

}  // namespace
}  // namespace evalbus

int main(int argc, char** argv) {
  if (argc != 2) return 1;
  evalbus::WriteAll(argv[1]);
}
