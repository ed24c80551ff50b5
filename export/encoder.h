// Converts the messages of an episode to JSON for external tools, with a JSON schema for each topic. Uses
// Foxglove's schemas where they exist. Shared by MCAP files, the live Foxglove server and PlotJuggler.
//
// Times are simulated times since tick 0 of the episode. Frames are named after MODEL's bodies; poses are in
// the frame "world".
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "evalbus/action_t.hpp"
#include "evalbus/contacts_t.hpp"
#include "evalbus/episode_begin_t.hpp"
#include "evalbus/episode_end_t.hpp"
#include "evalbus/episode_summary_t.hpp"
#include "evalbus/log_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "evalbus/partial_metrics_t.hpp"
#include "evalbus/state_t.hpp"
#include "viz/viewer/episode_track.h"

namespace evalbus::exports {

struct Topic {
  std::string name;
  std::string schema_name;
  // Text of the JSON schema.
  std::string schema;
};

struct Message {
  // Index of the topic in topics().
  size_t topic = 0;
  int64_t time_ns = 0;
  std::shared_ptr<const std::string> json;
};

// Topics that every run has, in this order. "/metrics" is added when the first scores show which metrics
// exist.
enum TopicId : size_t {
  kTransforms,     // "/tf"
  kScene,          // "/scene": the visual model, once per episode
  kContactMarks,   // "/contact_marks": a sphere and an arrow for each contact
  kJoints,         // "/joint_states": measured
  kJointCommands,  // "/joint_commands"
  kRobot,          // "/robot": wrists, grippers, counters
  kContacts,       // "/contacts"
  kEvents,         // "/events": stages, slips, grasps, collisions, the cause, the end
  kLog,            // "/log": log messages of the components, and the events
  kEpisode,        // "/episode": its parameters; published again with its result
  kFixedTopics,
};

// Returns a time as in Foxglove's schemas: {"sec", "nsec"}.
nlohmann::ordered_json TimeJson(int64_t time_ns);

class Encoder {
 public:
  using Emit = std::function<void(const Message&)>;
  // Returns the JSON entities of a SceneUpdate for a MODEL and, if known, a seed (export/scene.h). If it
  // returns null, no scene is shown.
  using SceneOf =
      std::function<std::shared_ptr<const std::string>(const model_info_t&, std::optional<int64_t> seed)>;

  Encoder(Emit emit, SceneOf scene);

  // Processes any encoded message of a run. EPISODE_BEGIN and STATE begin an episode if their header is new.
  // Other messages are ignored if they belong to another episode or do not fit MODEL, except log lines, which
  // are always emitted. Undecodable messages are counted.
  void Receive(std::string_view channel, std::span<const uint8_t> data);

  // The list only grows. A topic replaces earlier topics with the same name.
  const std::vector<Topic>& topics() const { return topics_; }
  int64_t undecodable() const { return undecodable_; }
  // Returns the number of episodes, and repeated attempts of episodes, that have begun.
  int64_t num_attempts() const { return num_attempts_; }
  // Returns the simulated time of the current episode's latest STATE, ns; -1 before its first STATE.
  int64_t time_ns() const { return time_ns_; }

 private:
  void Receive(const model_info_t& model);
  void Receive(const episode_begin_t& begin);
  void Receive(const state_t& state);
  void Receive(const contacts_t& contacts);
  void Receive(const partial_metrics_t& partial);
  void Receive(const action_t& action);
  void Receive(const episode_end_t& end);
  void Receive(const episode_summary_t& summary);
  void Receive(const log_t& line);

  bool IsOurs(const header_t& header) const { return track_ && track_->IsOurs(header); }
  void Enter(const header_t& header);
  void EmitEpisode(const episode_summary_t* summary);
  void EmitEvents();
  void EmitLog(int64_t time_ns, int level, const std::string& name, const std::string& text);
  void EmitJson(size_t topic, int64_t time_ns, const nlohmann::ordered_json& json);
  std::string FrameName(size_t body) const;

  Emit emit_;
  SceneOf scene_;
  std::vector<Topic> topics_;
  std::optional<size_t> metrics_topic_;
  std::vector<uint8_t> model_bytes_;
  std::shared_ptr<const model_info_t> model_;
  std::optional<episode_begin_t> begin_;
  // The current episode; null if there is none.
  std::unique_ptr<viz::EpisodeTrack> track_;
  std::set<std::tuple<int, int64_t, std::string>> emitted_events_;
  int64_t time_ns_ = -1;
  int64_t undecodable_ = 0;
  int64_t num_attempts_ = 0;
};

// Inserts a metric's unit into its name, as in the keys of "/metrics". "cartesian_path_length.left" becomes
// "cartesian_path_length_m.left".
std::string NameWithUnit(const std::string& name);

}  // namespace evalbus::exports
