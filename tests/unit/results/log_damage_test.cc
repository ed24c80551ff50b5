// A log of three episodes is truncated or damaged at any position. Undamaged episodes keep their scores.
#include <gtest/gtest.h>

#include <fstream>
#include <random>

#include "base/errors.h"
#include "bus/channels.h"
#include "bus/message.h"
#include "results/rescorer.h"
#include "tests/unit/small_world.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::results::log_damage_test {

constexpr int kEpisodes = 3;
constexpr int64_t kTicks = 4;

class LogDamage : public testing::Test {
 protected:
  void SetUp() override {
    for (int episode = 0; episode < kEpisodes; ++episode) {
      WriteEpisode(episode);
      log_ += Read();
      end_.push_back(log_.size());
    }
    const RescoredLog whole = Rescore(log_);
    ASSERT_EQ(whole.episodes.size(), 3u);
    for (const RescoredEpisode& episode : whole.episodes) {
      EXPECT_TRUE(episode.summary.complete);
      expected_.push_back(episode.summary);
    }
  }
  std::string Read() const {
    std::ifstream stream(file_, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  RescoredLog Rescore(const std::string& bytes) {
    std::ofstream(file_, std::ios::binary) << bytes;
    return Rescorer().Rescore(file_);
  }
  // Expects these episodes to be present and complete, with their scores.
  void ExpectEpisodes(const std::vector<int>& episodes, const RescoredLog& log, const std::string& what) {
    for (const int episode : episodes) {
      int found = 0;
      for (const RescoredEpisode& rescored : log.episodes) {
        found += SameBits(rescored.summary, expected_[static_cast<size_t>(episode)]);
      }
      ASSERT_EQ(found, 1) << "episode " << episode << ", " << what;
    }
  }

  std::string log_;
  // Byte offset of the end of each episode.
  std::vector<size_t> end_;
  std::vector<episode_summary_t> expected_;

 private:
  void WriteEpisode(int32_t episode) {
    std::filesystem::remove(file_);
    EventLogWriter writer(file_);
    const auto write = [&](std::string_view channel, const auto& message) {
      std::vector<uint8_t> bytes(static_cast<size_t>(message.getEncodedSize()));
      message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
      writer.Write(channel, Encode(message), 0);
    };
    write(channels::kModel, small_world::Model());
    episode_begin_t begin{};
    begin.header.episode = episode;
    write(channels::kEpisodeBegin, begin);
    for (int64_t tick = 0; tick < kTicks; ++tick) {
      write(channels::kState, small_world::State(tick, episode));
      write(channels::kContacts, small_world::Contacts(tick, {}, episode));
    }
    episode_end_t end{};
    end.header = small_world::Header(kTicks - 1, episode);
    end.end_reason = "time_limit";
    write(channels::kEpisodeEnd, end);
    writer.Close();
  }

  TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_.path() / "events.lcmlog";
};

TEST_F(LogDamage, CutAnywhereKeepsEveryEpisodeBefore) {
  for (size_t size = 0; size <= log_.size(); size += size < 1500 ? 1 : 29) {
    const RescoredLog log = Rescore(log_.substr(0, size));
    std::vector<int> whole;
    for (int episode = 0; episode < kEpisodes; ++episode) {
      if (end_[static_cast<size_t>(episode)] <= size) whole.push_back(episode);
    }
    ExpectEpisodes(whole, log, "cut at " + std::to_string(size));
    // Other episodes are not reported as complete.
    for (size_t i = whole.size(); i < log.episodes.size(); ++i) {
      EXPECT_FALSE(log.episodes[i].summary.complete) << "cut at " << size;
      EXPECT_FALSE(log.episodes[i].has_end) << "cut at " << size;
    }
  }
}

TEST_F(LogDamage, FlippedBytesCostOnlyTheEpisodesHit) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 2000; ++trial) {
    std::string bytes = log_;
    const auto hit = static_cast<int>(random() % kEpisodes);
    const size_t begin = hit == 0 ? 0 : end_[static_cast<size_t>(hit) - 1];
    for (int flips = 1 + static_cast<int>(random() % 5); flips > 0; --flips) {
      bytes[begin + random() % (end_[static_cast<size_t>(hit)] - begin)] ^=
          static_cast<char>(1 << random() % 8);
    }
    std::vector<int> others;
    for (int episode = 0; episode < kEpisodes; ++episode) {
      if (episode != hit) others.push_back(episode);
    }
    try {
      ExpectEpisodes(others, Rescore(bytes), "trial " + std::to_string(trial));
    } catch (const InputError&) {
      // If MODEL is damaged, its task may be invalid, and the log is refused.
    }
  }
}

TEST_F(LogDamage, AnotherMessageVersionIsRefusedByName) {
  // message_version follows the fingerprint and the session of MODEL.
  std::string bytes = log_;
  const size_t version = 28 + std::string(channels::kModel).size() + 16;
  bytes[version + 3] = 0;
  try {
    Rescore(bytes);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what())
                  .find("events.lcmlog: message version 0, but this evalbus reads version " +
                        std::to_string(model_info_t::VERSION)),
              std::string::npos)
        << error.what();
  }
  // MODEL has the fingerprint of another version, so it cannot be decoded.
  bytes = log_.substr(0, end_[0]);
  bytes[version - 9] ^= 1;
  EXPECT_THROW(Rescore(bytes), InputError);
}

}  // namespace evalbus::results::log_damage_test
