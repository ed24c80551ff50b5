// JSON schemas of the topics. Schemas named foxglove.* contain the members of Foxglove's schema of that name
// (https://docs.foxglove.dev/docs/visualization/message-schemas) that evalbus publishes.
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
// Schema of numbers at these paths ("cartesian_path_length_m.left"), each with its display name.
std::string MetricsSchema(const std::vector<std::pair<std::string, std::string>>& paths);

}  // namespace evalbus::exports
