// evalbus run --log zstd: smaller logs give the same results, for evalbus and for LCM's own tools.
#include <signal.h>

#include <lcm/lcm-cpp.hpp>

#include "base/run_layout.h"
#include "tests/integration/harness.h"

namespace evalbus::packed_logs_test {

namespace fs = std::filesystem;

class PackedLogs : public testing::Test {
 protected:
  std::vector<std::string> Command(const fs::path& out, const std::vector<std::string>& more) {
    std::vector<std::string> command = {"evalbus",    "run", "lift_pot/position", "--policy", "noisy_expert",
                                        "--episodes", "4",   "--in-process",      "--out",    out};
    command.insert(command.end(), more.begin(), more.end());
    return command;
  }
  void Run(const fs::path& out, const std::vector<std::string>& more = {}) {
    const Result result = RunProgram(Command(out, more));
    ASSERT_EQ(result.code, 0) << result.err;
  }
  static std::string Said(const std::vector<std::string>& command) {
    const Result result = RunProgram(command);
    EXPECT_EQ(result.code, 0) << result.err;
    return result.out;
  }

  TemporaryFolder folder_;
  // Pages show the name of the folder, so both folders have the same name.
  const fs::path plain_ = folder_.path() / "plain/run", packed_ = folder_.path() / "packed/run";
};

TEST_F(PackedLogs, GiveTheSameResults) {
  Run(plain_, {"--workers", "2"});
  Run(packed_, {"--log", "zstd", "--workers", "2"});
  ExpectSameScores(plain_, packed_);
  for (int i = 0; i < 4; ++i) {
    const fs::path plain = EpisodeLog(plain_, i), packed = EpisodeLog(packed_, i);
    ASSERT_EQ(packed.filename(), "events.lcmlog.zst");
    EXPECT_FALSE(fs::exists(LogFile(packed_, i)));
    EXPECT_LT(fs::file_size(packed), fs::file_size(plain) / 2);
    ExpectSameTicks(ReadLog(packed), ReadLog(plain));
  }
  for (const fs::path& run : {plain_, packed_}) Said({"evalbus", "report", run});
  // The pages differ only in the names of logs and in this option of the run.
  std::string page = ReadText(packed_ / "report.html");
  for (size_t at; (at = page.find(".lcmlog.zst")) != std::string::npos;) page.erase(at + 7, 4);
  if (const size_t at = page.find("<td>zstd<"); at != std::string::npos) page.replace(at + 4, 4, "plain");
  EXPECT_TRUE(page == ReadText(plain_ / "report.html")) << packed_;
  const std::string rescored = Said({"evalbus", "rescore", packed_});
  EXPECT_NE(rescored.find("4 of 4 episodes have scores bit-identical to the recorded ones"),
            std::string::npos)
      << rescored;
  const fs::path again = folder_.path() / "again";
  Said({"evalbus", "run", "lift_pot/position", "--policy", "replay:" + packed_.string(), "--episodes", "4",
        "--in-process", "--out", again});
  ExpectSameTicks(ReadLog(EpisodeLog(again, 3)), ReadLog(EpisodeLog(plain_, 3)));
}

TEST_F(PackedLogs, AreUnpackedForLcm) {
  Run(packed_, {"--log", "zstd", "--only", "1"});
  const fs::path log = EpisodeLog(packed_, 1), unpacked = folder_.path() / "events.lcmlog";
  ASSERT_EQ(RunProgram({"zstd", "-q", "-d", log, "-o", unpacked}).code, 0);
  lcm::LogFile read_by_lcm(unpacked, "r");
  ASSERT_TRUE(read_by_lcm.good());
  const RecordedLog ours = ReadLog(log);
  EXPECT_GT(ours.events.size(), 1000u);
  for (const RecordedLog::Event& event : ours.events) {
    const lcm::LogEvent* same = read_by_lcm.readNextEvent();
    ASSERT_NE(same, nullptr);
    EXPECT_EQ(same->channel, event.channel);
    EXPECT_EQ(same->timestamp, event.time_us);
    const auto* const data = static_cast<const uint8_t*>(same->data);
    ASSERT_EQ(std::vector<uint8_t>(data, data + same->datalen), event.data);
  }
  EXPECT_EQ(read_by_lcm.readNextEvent(), nullptr);
}

// The run is killed while it writes a compressed log, and resumed without --log zstd, so the remaining logs
// are plain.
TEST_F(PackedLogs, AKilledRunIsResumed) {
  Run(plain_);
  {
    Program launcher(Command(packed_, {"--log", "zstd"}));
    ASSERT_TRUE(WaitFor([&] { return fs::exists(packed_ / "episodes/0001.partial/events.lcmlog"); }));
    launcher.Signal(SIGKILL);
    launcher.Wait();
  }
  const size_t before = Episodes(packed_).size();
  ASSERT_GE(before, 1u);
  ASSERT_LT(before, 4u);
  for (const fs::path& episode : EpisodeFolders(packed_)) {
    EXPECT_EQ(fs::exists(episode / "events.lcmlog.zst"), !IsUnfinished(episode)) << episode;
  }
  Run(packed_, {"--resume"});
  ExpectSameScores(plain_, packed_);
  for (int i = 0; i < 4; ++i) {
    const fs::path log = EpisodeLog(packed_, i);
    EXPECT_EQ(log.extension(), i < static_cast<int>(before) ? ".zst" : ".lcmlog");
    ExpectSameTicks(ReadLog(log), ReadLog(EpisodeLog(plain_, i)));
  }
}

TEST_F(PackedLogs, WhatIsCutOffIsOneLine) {
  Run(packed_, {"--log", "zstd", "--only", "0"});
  const fs::path log = EpisodeLog(packed_, 0);
  fs::resize_file(log, fs::file_size(log) / 2);
  for (const char* command : {"rescore", "render"}) {
    const Result result = RunProgram({"evalbus", command, log});
    EXPECT_EQ(result.code, 1) << command;
    EXPECT_EQ(result.err, "error: cannot read log " + log.string() + ": it is truncated\n") << command;
  }
  const Result other = RunProgram(Command(folder_.path() / "other", {"--log", "gzip"}));
  EXPECT_EQ(other.code, 1);
  EXPECT_EQ(other.err, "error: --log: expected plain or zstd, got 'gzip'\n");
}

}  // namespace evalbus::packed_logs_test
