// Reads the input as a log, packed or not, with the code of every program that reads logs. The first byte
// selects the kind of the rest. 0 to 127 is a log. 128 and above is a Conversation that is recorded as a
// valid log, so that the code after the parsing of the log's framing is also reached.
#include <cstdlib>

#include "base/errors.h"
#include "bus/event_log.h"
#include "policy_bridge/policies/replay_policy.h"
#include "results/rescorer.h"
#include "tests/fuzz/conversation.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/scratch_file.h"
#include "tests/unit/small_world.h"
#include "viz/images/parallel_frame_renderer.h"
#include "viz/images/video.h"

namespace evalbus {
namespace {

Samples Episode() {
  Samples samples;
  samples[channels::kModel.name] = {Encode(small_world::Model())};
  samples[channels::kEpisodeBegin.name] = {Encode(episode_begin_t{})};
  for (int64_t tick = 0; tick < 5; ++tick) {
    samples[channels::kState.name].push_back(Encode(small_world::State(tick)));
    samples[channels::kContacts.name].push_back(Encode(small_world::Contacts(tick)));
    action_t action{};
    action.header = small_world::Header(tick);
    samples[channels::kAction.name].push_back(Encode(action));
    partial_metrics_t partial{};
    partial.header = action.header;
    samples[channels::kPartial.name].push_back(Encode(partial));
  }
  episode_end_t end{};
  end.header = small_world::Header(4);
  end.end_reason = "time_limit";
  samples[channels::kEpisodeEnd.name] = {Encode(end)};
  episode_summary_t summary{};
  summary.header = end.header;
  samples[channels::kEpisodeSummary.name] = {Encode(summary)};
  return samples;
}

// A bad log must cause no exception other than InputError.
template <class Read>
void Try(const Read& read) {
  try {
    read();
  } catch (const InputError&) {
  }
}

}  // namespace
}  // namespace evalbus

FUZZ_TARGET(event_log) {
  using namespace evalbus;
  static const ScratchFolder folder;
  static const Samples samples = Episode();
  static const TaskDescription task = ParseTask(small_world::kTask, "small.yaml", false);
  if (size == 0) return 0;
  const std::filesystem::path file = folder.path() / "events.lcmlog";
  if (*data < 128) {
    folder.Write("events.lcmlog", data + 1, size - 1);
  } else {
    std::filesystem::remove(file);
    EventLogWriter log(file);
    const auto write = [&](std::string_view channel, const Bytes& message) {
      log.Write(channel, message, 0);
    };
    Conversation({data + 1, size - 1}, samples).Hold(write, [](int) {});
  }

  Try([&] {
    EventLogReader reader(file);
    size_t bytes = 0;
    for (LogEvent event; reader.Next(&event);) bytes += 28 + event.channel.size() + event.data.size();
    // Every byte belongs to an event or is reported as damaged.
    if (bytes + static_cast<size_t>(reader.damaged_bytes()) != reader.size()) std::abort();
  });

  Try([&] {
    for (const results::RescoredEpisode& episode : results::Rescorer().Rescore(file).episodes) {
      results::DescribeDifference(episode.recorded, episode.summary);
    }
  });
  // Rescores with a task of the user, which determines when the episode ends.
  Try([&] { results::Rescorer(task).Rescore(file); });
  Try([&] { policy::OpenRecording(file)(0); });
  // Rendering reads the log until it finds that it has no model to render.
  Try([&] {
    viz::ParallelFrameRenderer frame_renderer({}, 1);
    viz::MakeLogVideos(file, {"overview"}, &frame_renderer, folder.path());
  });
  return 0;
}
