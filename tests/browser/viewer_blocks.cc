// Writes the blocks of a recorded run as files with the names that a server uses, so that the page can be
// developed and tested without a server: block/ID, episode/0/EPISODE, run/0 and episodes/0. Also writes
// live/000 and so on, which are the blocks that an observer's page receives while the first episode is
// active.
#include <fmt/format.h>

#include <filesystem>
#include <iostream>
#include <string>

#include "base/errors.h"
#include "base/write_whole.h"
#include "bus/channels.h"
#include "bus/event_log.h"
#include "report/episode_tracks.h"
#include "results/episode_logs.h"

namespace evalbus {
namespace {

namespace fs = std::filesystem;

void Write(const fs::path& file, const std::string& bytes) {
  fs::create_directories(file.parent_path());
  WriteWhole(file, bytes);
}

// Writes the live stream from the log's messages, with a block every 25 ticks.
void WriteLive(const fs::path& log, const viz::EpisodeTrack& whole, const viz::SceneBlocks& scene,
               const fs::path& folder) {
  viz::EpisodeTrack track(std::make_shared<model_info_t>(whole.model()), whole.episode(),
                          {.run = 0, .policy = "live", .scene = scene.id(), .bodies = scene.moving_bodies()});
  int number = 0, layout = -1;
  int64_t sent = 0;
  const auto flush = [&](bool now) {
    if (track.layout() == layout && track.ticks() < sent + 25 && !now) return;
    const bool is_whole = track.layout() != layout;
    Write(folder / fmt::format("{:03}", number++), is_whole ? track.EpisodeBlock() : track.TicksBlock(sent));
    layout = track.layout();
    sent = track.ticks();
  };
  EventLogReader reader(log);
  const auto hear = [&]<class Message>(const LogEvent& event, const Channel<Message>& channel) {
    Message message{};
    if (!(channel == event.channel) || !Decode(event.data, &message)) return;
    if constexpr (std::is_same_v<Message, episode_begin_t>) {
      track.Receive(message, scene.Appearance(message.seed));
    } else {
      track.Receive(message);
    }
    if (track.ticks() > 0) flush(false);
  };
  for (LogEvent event; reader.Next(&event);) {
    hear(event, channels::kEpisodeBegin);
    hear(event, channels::kState);
    hear(event, channels::kContacts);
    hear(event, channels::kPartial);
    hear(event, channels::kEpisodeEnd);
    hear(event, channels::kEpisodeSummary);
  }
}

int Main(const fs::path& run_folder, const fs::path& out) {
  const results::RecordedRun run = results::ReadRun(run_folder);
  report::Scenes scenes;
  Write(out / "run/0", results::RunBlock(run, 0));
  Write(out / "episodes/0", viz::EpisodesBlock(0, 0, report::EpisodeRows(run)));
  for (const results::RecordedEpisode& episode : run.episodes) {
    const fs::path log = results::EpisodeLogs(run.folder, {episode.episode}).front();
    const auto track = report::TrackEpisode(log, {.policy = run.policy}, &scenes);
    Write(out / fmt::format("episode/0/{}", episode.episode), track->EpisodeBlock());
    if (&episode == &run.episodes.front()) {
      WriteLive(log, *track, scenes.Of(track->model(), run.folder), out / "live");
    }
  }
  for (const auto& [id, bytes] : scenes.blocks()) Write(out / "block" / id, *bytes);
  return 0;
}

}  // namespace
}  // namespace evalbus

int main(int argc, char** argv) try {
  if (argc != 3) throw evalbus::InputError("usage: viewer_blocks RUN FOLDER");
  return evalbus::Main(argv[1], argv[2]);
} catch (const std::exception& error) {
  return evalbus::ReportError(error);
}
