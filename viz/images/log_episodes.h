// The episodes of a log from which videos can be made.
#pragma once

#include <filesystem>
#include <vector>

#include "bus/episode_reader.h"
#include "models/mujoco_ptr.h"
#include "viz/images/video_timing.h"

namespace evalbus::viz {

// Channels of the messages that videos show.
inline const EpisodeReader::Channels kVideoChannels = {channels::kState, channels::kContacts,
                                                       channels::kPartial};

// Returns the numbers of the episodes from which a video can be made, in the log's order. Prints warnings
// about damage to standard error. Throws InputError for a log without MODEL or STATE.
std::vector<int> EpisodesOf(const std::filesystem::path& log);

// Throws InputError with the available numbers if a wanted episode is not in the log.
void CheckEpisodes(const std::filesystem::path& log, const std::vector<int>& numbers,
                   const std::vector<int>& wanted);

// Returns the time of the decisive moment, s. Throws InputError if the log does not have it.
double DecisiveMoment(const EpisodeMessages& episode);
// Returns the times of a video's frames. Throws the errors of FrameTimes() and DecisiveMoment().
std::vector<FrameTime> TimesOf(const EpisodeMessages& episode, VideoTiming timing);
// Returns whether a video with this timing shows how the episode ended.
bool ShowsEnd(const EpisodeMessages& episode, const VideoTiming& timing);

// Loads the visual model from the run folder that contains the log, even if the folder has been moved since.
// For a log outside a run folder, loads the file that MODEL names. Throws InputError.
ModelPtr VisualModel(model_info_t info, const std::filesystem::path& log);

}  // namespace evalbus::viz
