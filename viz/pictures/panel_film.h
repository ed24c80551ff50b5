// Films with panels: one episode with everything that is known of it; two of them side by side; many in a
// grid. As everywhere, frame n shows simulated time n / 30 s; what is over holds its last picture, and the
// end is held for kPanelHold frames.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "viz/pictures/film_crew.h"
#include "viz/pictures/film_facts.h"
#include "viz/pictures/film_layout.h"

namespace evalbus::viz {

inline constexpr int kPanelHold = 60;

// An episode, of which only what is shown is kept.
struct FilmedEpisode {
  std::filesystem::path log;
  model_info_t model;
  std::optional<int64_t> seed;
  // One for each frame.
  std::vector<state_t> states;
  FilmFacts facts;
  // In a grid or beside another: whose it is.
  std::string name;
};

// Throws InputError for a MODEL that contradicts itself.
FilmedEpisode ToFilm(const RecordedEpisode& episode, const std::string& policy,
                     const std::filesystem::path& log);
// Those of a log: of these numbers, or all. Throws InputError as FilmLog does.
std::vector<FilmedEpisode> ReadEpisodesToFilm(const std::filesystem::path& log,
                                              const std::vector<int>& episodes, const std::string& policy);

// The cameras of a full film where none are named: overview, then the head's and the wrists'.
std::vector<std::string> FullCameras(const mjModel& model);

using FilmProgress = std::function<void(double share)>;

// The first camera is the main one; the film is as large as the crew's frames. Throws InputError (too many or
// unknown cameras, size, file), EnvironmentError; so do the others. No file is left half-written.
void FilmFull(const FilmedEpisode& episode, const std::vector<std::string>& cameras, FilmCrew* crew,
              const std::filesystem::path& file, const FilmProgress& progress);

struct JointFilmOptions {
  std::string title, subtitle;
  std::string camera = kDefaultCamera;
  FrameSize size{1280, 720};
  // Of a grid.
  GridShape shape;
  FilmProgress progress;
};
// Two.
void FilmPair(const std::vector<FilmedEpisode>& episodes, const JointFilmOptions& options,
              const std::filesystem::path& file);
// As many as the grid has cells, or fewer.
void FilmGrid(const std::vector<FilmedEpisode>& episodes, const JointFilmOptions& options,
              const std::filesystem::path& file);

}  // namespace evalbus::viz
