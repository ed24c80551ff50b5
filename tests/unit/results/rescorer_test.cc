// Logs of episodes that continued after their success are rescored with the original and with a different
// task description.
#include "results/rescorer.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "bus/channels.h"
#include "bus/message.h"
#include "lcmtypes/clock.h"
#include "lcmtypes/extended_value.h"
#include "tests/unit/small_world.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::results::rescorer_test {

class RescoreAfterSuccess : public testing::Test {
 protected:
  // At tick k the pot is lifted by k * 0.05 m. Success requires 0.1 m, which is reached at tick 2. Ticks last
  // 0.02 s.
  void WriteLog(int64_t last_tick, const std::string& end_reason, const std::string& detail = "",
                const char* clock = clock_name::kLockstep) {
    std::filesystem::remove(file_);
    EventLogWriter writer(file_);
    const auto write = [&](const char* channel, const auto& message) {
      writer.Write(channel, Encode(message), 0);
    };
    model_info_t model = small_world::Model();
    model.after_success_us = 60'000;
    model.clock = clock;
    write(channels::kModel.name, model);
    write(channels::kEpisodeBegin.name, episode_begin_t{});
    for (int64_t tick = 0; tick <= last_tick; ++tick) {
      state_t state = small_world::State(tick);
      state.body[small_world::kPot].position_m[2] = 1.001 + 0.05 * static_cast<double>(tick);
      write(channels::kState.name, state);
      write(channels::kContacts.name, small_world::Contacts(tick, {}));
    }
    episode_end_t end{};
    end.header = small_world::Header(last_tick);
    end.end_reason = end_reason;
    end.detail = detail;
    write(channels::kEpisodeEnd.name, end);
    writer.Close();
  }
  // Rescores the log with a description in which success requires this height.
  episode_summary_t Rescore(const std::string& height) {
    std::string text = small_world::kTask;
    const size_t success = text.find("success:"), at = text.find("min_m: 1.1", success);
    text.replace(at, 10, "min_m: " + height);
    const RescoredLog log = Rescorer(ParseTask(text, "small.yaml", false)).Rescore(file_);
    EXPECT_EQ(log.episodes.size(), 1u);
    return log.episodes.at(0).summary;
  }
  static std::string Text(const episode_summary_t& summary) {
    return fmt::format("{} at tick {}, {}, {:g} s, held {:g} s", summary.end_reason, summary.header.tick,
                       summary.complete ? "complete" : "not complete", summary.metrics.completion_time_s,
                       ExtendedValue(summary.extended, "success_held_s"));
  }

  TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_.path() / "events.lcmlog";
};

TEST_F(RescoreAfterSuccess, EndsWhereTheSimWouldHaveEndedIt) {
  WriteLog(5, "success");
  EXPECT_EQ(Text(Rescorer().Rescore(file_).episodes.at(0).summary),
            "success at tick 5, complete, 0.04 s, held 0.06 s");
  EXPECT_EQ(Text(Rescore("1.1")), "success at tick 5, complete, 0.04 s, held 0.06 s");
  // With a lower height, success is one tick earlier.
  EXPECT_EQ(Text(Rescore("1.05")), "success at tick 4, complete, 0.02 s, held 0.06 s");
  // With a greater height, the log lacks a tick of the time after success, or there is no success.
  const episode_summary_t later = Rescore("1.15");
  EXPECT_EQ(Text(later), "aborted at tick 5, not complete, 0.06 s, held 0.04 s");
  EXPECT_EQ(later.end_detail,
            "the log ends before after_success_s have passed since this description's success");
  EXPECT_EQ(Text(Rescore("2")), "success at tick 5, not complete, 0.1 s, held nan s");
}

TEST_F(RescoreAfterSuccess, WhatElseEndedItEndsItHereToo) {
  WriteLog(3, "success", "after the success: policy_error, no such grasp");
  EXPECT_EQ(Text(Rescore("1.1")), "success at tick 3, complete, 0.04 s, held 0.02 s");
  WriteLog(3, "server_error", "connection closed");
  EXPECT_EQ(Text(Rescore("1.1")), "server_error at tick 3, not complete, 0.04 s, held 0.02 s");
  // In this log, the time after success had passed before the server failed.
  WriteLog(6, "server_error", "connection closed");
  EXPECT_EQ(Text(Rescore("1.1")), "success at tick 5, complete, 0.04 s, held 0.06 s");
  WriteLog(3, "time_limit");
  EXPECT_EQ(Text(Rescore("1.1")), "aborted at tick 3, not complete, 0.04 s, held 0.02 s");
}

TEST_F(RescoreAfterSuccess, LikewiseInRealtimeWhereTicksComeLater) {
  WriteLog(7, "success", "", clock_name::kRealtime);
  EXPECT_EQ(Text(Rescore("1.1")), "success at tick 7, complete, 0.04 s, held 0.06 s");
  EXPECT_EQ(Text(Rescore("1.2")), "success at tick 7, complete, 0.08 s, held 0.06 s");
  EXPECT_EQ(Text(Rescore("1.25")), "aborted at tick 7, not complete, 0.1 s, held 0.04 s");
}

}  // namespace evalbus::results::rescorer_test
