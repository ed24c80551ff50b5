// JSON schemas of the topics: those named foxglove.* have the members that Foxglove's schema of this name
// asks for (https://docs.foxglove.dev/docs/visualization/message-schemas), as far as we fill them.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace evalbus::tools {

std::string FrameTransformsSchema();
std::string SceneUpdateSchema();
std::string JointStatesSchema();
std::string LogSchema();
std::string CompressedImageSchema();
std::string RobotSchema();
std::string ContactsSchema();
std::string EventSchema();
std::string EpisodeSchema();
// Of numbers at these paths ("cartesian_path_length_m.left"), each with what people call it.
std::string MetricsSchema(const std::vector<std::pair<std::string, std::string>>& paths);

}  // namespace evalbus::tools
