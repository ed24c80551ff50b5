// What other people's tools are shown of an episode: messages in JSON, shaped as Foxglove's schemas where
// there is one, each topic with its JSON schema. The same for an MCAP file, a live Foxglove server and
// PlotJuggler.
//
// Times are simulated, from the episode's begin. Frames are named as MODEL's bodies, poses are in "world".
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

namespace evalbus::tools {

struct Topic {
  std::string name;
  std::string schema_name;
  // JSON Schema.
  std::string schema;
  // Said once an episode: who comes later is told it again.
  bool is_kept = false;
};

struct Message {
  // Place in topics().
  size_t topic = 0;
  int64_t time_ns = 0;
  std::shared_ptr<const std::string> json;
};

// Topics that every run has, in this order; "/metrics" follows when the first scores say which there are.
enum TopicId : size_t {
  kTransforms,     // "/tf"
  kScene,          // "/scene": the visual model, once an episode
  kContactMarks,   // "/contact_marks": a ball and an arrow for each contact
  kJoints,         // "/joint_states": measured
  kJointCommands,  // "/joint_commands"
  kRobot,          // "/robot": wrists, grippers, counters
  kContacts,       // "/contacts"
  kEvents,         // "/events": stages, slips, grasps, collisions, the end
  kLog,            // "/log": what components said, and the events
  kEpisode,        // "/episode": which it is; said again with its result
  kFixedTopics,
};

// A time as Foxglove's schemas have it: {"sec", "nsec"}.
nlohmann::ordered_json TimeJson(int64_t time_ns);

class Encoder {
 public:
  using Emit = std::function<void(const Message&)>;
  // JSON of the entities of a SceneUpdate for a MODEL and, where it is known, a seed (tools/scene.h); null:
  // nothing is drawn.
  using SceneOf =
      std::function<std::shared_ptr<const std::string>(const model_info_t&, std::optional<int64_t> seed)>;

  Encoder(Emit emit, SceneOf scene);

  // Any message of a run, as it came. Those of no episode that MODEL describes, or that do not fit it, say
  // nothing; what does not decode is counted.
  void Hear(std::string_view channel, std::span<const uint8_t> data);

  // Grows; what is there stays. A later topic of the same name takes the place of the earlier one.
  const std::vector<Topic>& topics() const { return topics_; }
  int64_t undecodable() const { return undecodable_; }
  // Of the latest STATE; -1 before.
  int64_t time_ns() const { return time_ns_; }

 private:
  void Hear(const model_info_t& model);
  void Hear(const episode_begin_t& begin);
  void Hear(const state_t& state);
  void Hear(const contacts_t& contacts);
  void Hear(const partial_metrics_t& partial);
  void Hear(const action_t& action);
  void Hear(const episode_end_t& end);
  void Hear(const episode_summary_t& summary);
  void Hear(const log_t& line);

  bool IsOurs(const header_t& header) const { return track_ && track_->IsOurs(header); }
  void Enter(const header_t& header);
  void SayEpisode(const episode_summary_t* summary);
  void SayEvents();
  void SayLog(int64_t time_ns, int level, const std::string& name, const std::string& text);
  void Say(size_t topic, int64_t time_ns, const nlohmann::ordered_json& json);
  std::string FrameName(size_t body) const;

  Emit emit_;
  SceneOf scene_;
  std::vector<Topic> topics_;
  std::optional<size_t> metrics_topic_;
  std::vector<uint8_t> model_bytes_;
  std::shared_ptr<const model_info_t> model_;
  std::optional<episode_begin_t> begin_;
  // The episode under way; null: none.
  std::unique_ptr<viz::EpisodeTrack> track_;
  std::set<std::tuple<int, int64_t, std::string>> said_events_;
  int64_t time_ns_ = -1;
  int64_t undecodable_ = 0;
};

// A metric's name with its unit, as the keys of "/metrics" have it: "cartesian_path_length.left" ->
// "cartesian_path_length_m.left".
std::string NameWithUnit(const std::string& name);

}  // namespace evalbus::tools
