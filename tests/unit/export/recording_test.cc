#include "export/recording.h"

#include <gmock/gmock.h>

#include "base/errors.h"
#include "bus/channels.h"
#include "bus/event_log.h"
#include "bus/message.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::exports::recording_test {

// The beginning of the log is lost. Without an error, an MCAP file without the requested images would look as
// if the cameras had recorded none.
TEST(AddImages, RefusesALogWithoutItsBeginning) {
  const TemporaryFolder folder;
  const std::filesystem::path log = folder.path() / "events.lcmlog";
  EventLogWriter writer(log);
  writer.Write(channels::kState, Encode(state_t{}), 0);
  writer.Close();
  EncodedEpisode episode;
  try {
    AddImages(log, {"head"}, "64x48", &episode);
    FAIL() << "no error";
  } catch (const InputError& error) {
    EXPECT_EQ(error.what(),
              log.string() + ": images cannot be rendered: no complete MODEL and EPISODE_BEGIN");
  }
  EXPECT_TRUE(episode.topics.empty());
}

}  // namespace evalbus::exports::recording_test
