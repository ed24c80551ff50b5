// JSON schemas of the topics. A schema named foxglove.* contains those members of Foxglove's schema of this
// name that evalbus publishes (https://docs.foxglove.dev/docs/visualization/message-schemas).
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace evalbus::exports {

std::string FrameTransformsSchema();
std::string SceneUpdateSchema();
std::string JointStatesSchema();
std::string LogSchema();
std::string CompressedImageSchema();
std::string RobotSchema();
std::string ContactsSchema();
std::string EventSchema();
std::string EpisodeSchema();
// Returns the schema for numbers at these paths, such as "cartesian_path_length_m.left", each with its
// display name.
std::string MetricsSchema(const std::vector<std::pair<std::string, std::string>>& paths);

}  // namespace evalbus::exports
