// The episodes of a log from which videos can be made.
#pragma once

#include <filesystem>
#include <vector>

#include "bus/episode_reader.h"
#include "models/mujoco_ptr.h"

namespace evalbus::viz {

// Messages that videos show.
inline const EpisodeReader::Channels kVideoChannels = {channels::kState, channels::kContacts,
                                                       channels::kPartial};

// Returns the numbers of the episodes from which a video can be made, in the log's order. Prints warnings
// about damage to standard error. Throws InputError for a log without MODEL or STATE.
std::vector<int> EpisodesOf(const std::filesystem::path& log);

// Throws InputError, with the available numbers, if a wanted episode is not in the log.
void CheckEpisodes(const std::filesystem::path& log, const std::vector<int>& numbers,
                   const std::vector<int>& wanted);

// Loads the visual model from the run folder that contains the log, even if the folder has been moved since.
// For a log outside of a run folder, loads the file that MODEL names. Throws InputError.
ModelPtr VisualModel(model_info_t info, const std::filesystem::path& log);

}  // namespace evalbus::viz
