// Tests that the files that commands write are complete or absent, replace only regular files, and leave
// nothing else behind.
#include <fcntl.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "bus/channels.h"
#include "bus/event_log.h"
#include "tests/integration/harness.h"

namespace evalbus::outputs_test {

namespace fs = std::filesystem;

class Outputs : public testing::Test {
 protected:
  void SetUp() override {
    Evaluate({ShortTask(folder_.path(), 0.4), "--policy", "random", "--episodes", "2", "--in-process"}, run_);
    fs::create_directory(work_);
  }
  // Returns commands that write one file each, with the output option last.
  std::vector<std::vector<std::string>> Commands() const {
    return {{"evalbus", "export", run_, "--csv"},
            {"evalbus", "report", run_, "-o"},
            {"evalbus", "compare", run_, run_, "--json"},
            {"evalbus", "compare", run_, run_, "--report"},
            {"evalbus", "rescore", run_, "--out"}};
  }
  Result Write(std::vector<std::string> command, const fs::path& file) {
    command.push_back(file);
    return RunProgram(command, {work_, nullptr});
  }

  TemporaryFolder folder_;
  const fs::path run_ = folder_.path() / "run", work_ = folder_.path() / "work";
};

TEST_F(Outputs, GoThroughWhatIsNoFile) {
  const fs::path fifo = work_ / "fifo", device = work_ / "null";
  ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0);
  const bool has_device = mknod(device.c_str(), S_IFCHR | 0600, makedev(1, 3)) == 0;
  for (const auto& command : Commands()) {
    SCOPED_TRACE(testing::PrintToString(command));
    {
      Program reader({"/bin/cat", fifo});
      const Result result = Write(command, fifo);
      EXPECT_EQ(result.code, 0) << result.err;
      EXPECT_EQ(reader.Wait(), 0);
      EXPECT_GT(reader.out().size(), 100u);
      EXPECT_TRUE(fs::is_fifo(fifo));
    }
    if (has_device) {
      EXPECT_EQ(Write(command, device).code, 0);
      EXPECT_TRUE(fs::is_character_file(device));
    }
    // Standard output is a regular file here, which rescore refuses to overwrite.
    if (command[1] == "rescore") continue;
    const Result out = Write(command, "/dev/stdout");
    EXPECT_EQ(out.code, 0) << out.err;
    EXPECT_GT(out.out.size(), 100u);
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(work_), {}), has_device ? 2 : 1);
}

TEST_F(Outputs, ATableAloneIsOnStandardOutput) {
  const fs::path file = work_ / "table.csv";
  ASSERT_EQ(Write({"evalbus", "export", run_, "--csv"}, file).code, 0);
  for (const char* name : {"-", "/dev/stdout"}) {
    const Result piped = Write({"evalbus", "export", run_, "--csv"}, name);
    EXPECT_EQ(piped.code, 0) << piped.err;
    EXPECT_EQ(piped.out, ReadText(file));
    EXPECT_NE(piped.err.find("2 episodes"), std::string::npos) << piped.err;
  }
}

TEST_F(Outputs, AreRefusedInOneLineIfInvalid) {
  fs::create_symlink("loop", work_ / "loop");
  for (const auto& command : Commands()) {
    for (const std::string& file : {std::string(), work_.string(), (work_ / "no/such/folder").string(),
                                    (work_ / std::string(300, 'x')).string(), (work_ / "loop").string()}) {
      const Result result = Write(command, file);
      SCOPED_TRACE(testing::PrintToString(command) + file);
      // With an empty name, export has no output and fails. The other commands use their default output.
      EXPECT_EQ(result.code, file.empty() && command[1] != "export" ? 0 : 1) << result.out;
      EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), result.code) << result.err;
      EXPECT_EQ(result.err.find("filesystem error"), std::string::npos) << result.err;
    }
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(work_), {}), 1);
}

TEST_F(Outputs, NeverReplaceFilesOfARun) {
  std::vector<std::vector<std::string>> commands = Commands();
  for (const char* option : {"--hdf5", "--mcap", "--inspect"})
    commands.push_back({"evalbus", "export", run_, option});
  for (const char* option : {"--markdown", "--latex"})
    commands.push_back({"evalbus", "compare", run_, run_, option});
  for (const char* option : {"--junit", "--markdown"})
    commands.push_back({"evalbus", "gate", run_, run_, option});
  commands.push_back({"evalbus", "why", run_, "--json"});
  commands.push_back({"evalbus", "judge", run_, "--json"});
  fs::create_symlink(run_ / "episodes.jsonl", work_ / "link");
  for (const fs::path& file :
       {run_ / "run.json", run_ / "episodes.jsonl", LogFile(run_, 0), work_ / "link"}) {
    const std::string content = ReadText(file);
    for (const auto& command : commands) {
      SCOPED_TRACE(testing::PrintToString(command) + " " + file.string());
      const Result result = Write(command, file);
      EXPECT_EQ(result.code, 1);
      EXPECT_EQ(std::ranges::count(result.err, '\n'), 1) << result.err;
      EXPECT_NE(result.err.find("choose another name"), std::string::npos) << result.err;
      EXPECT_EQ(ReadText(file), content);
    }
  }
  // Other files in the folder may be replaced.
  for (int i = 0; i < 2; ++i) {
    const Result result = Write({"evalbus", "export", run_, "--csv"}, run_ / "table.csv");
    EXPECT_EQ(result.code, 0) << result.err;
  }
}

// Every event that remains in these logs is intact.
TEST_F(Outputs, ATrainingSetNeedsEveryActionAndTheEnd) {
  const fs::path log = LogFile(run_, 0);
  const std::string text = ReadText(log);
  size_t without_action = 0, action_size = 0, end = 0;
  {
    EventLogReader reader(log);
    size_t begin = 0, actions = 0;
    for (LogEvent event; reader.Next(&event);) {
      const size_t size = 28 + event.channel.size() + event.data.size();
      if (event.channel == channels::kAction && actions++ == 3) {
        without_action = begin;
        action_size = size;
      }
      if (event.channel == channels::kEpisodeEnd && end == 0) end = begin;
      begin += size;
    }
  }
  ASSERT_GT(action_size, 0u);
  ASSERT_GT(end, 0u);
  const auto refused = [&](const std::string& damaged, const std::string& reason) {
    WriteText(log, damaged);
    for (const char* option : {"--hdf5", "--safetensors"}) {
      const Result result = Write({"evalbus", "export", run_, option}, work_ / "set");
      EXPECT_EQ(result.code, 1) << option;
      EXPECT_NE(result.err.find(log.string() + ": " + reason), std::string::npos) << result.err;
      EXPECT_FALSE(fs::exists(work_ / "set"));
    }
  };
  refused(text.substr(0, without_action) + text.substr(without_action + action_size), "no action for tick 3");
  const Result replay =
      RunProgram({"evalbus", "run", "lift_pot/position", "--policy", "replay_anyway:" + run_.string(),
                  "--episodes", "1", "--in-process", "--out", work_ / "replay"});
  EXPECT_NE(replay.code, 0) << replay.out;
  EXPECT_NE((replay.out + replay.err).find("has no action for tick 3"), std::string::npos)
      << replay.out << replay.err;
  refused(text.substr(0, end), "the end of the episode is missing");
  const Result truncated =
      RunProgram({"evalbus", "run", "lift_pot/position", "--policy", "replay:" + run_.string(), "--episodes",
                  "1", "--in-process", "--out", work_ / "truncated"});
  EXPECT_EQ(truncated.code, 1) << truncated.out;
  EXPECT_NE(truncated.err.find(log.string() + ": the end of the episode is missing"), std::string::npos)
      << truncated.err;
  EXPECT_FALSE(fs::exists(work_ / "truncated"));
  WriteText(log, text);
}

TEST_F(Outputs, AnMcapFileHoldsOneEpisode) {
  const fs::path both = work_ / "both.lcmlog", file = work_ / "both.mcap";
  WriteText(both, ReadText(LogFile(run_, 0)) + ReadText(LogFile(run_, 1)));
  const Result result = RunProgram({"evalbus", "export", both, "--mcap", file});
  EXPECT_EQ(result.code, 1);
  EXPECT_NE(result.err.find("both.lcmlog: holds several episodes (0, 1 ...); expected a log of one episode"),
            std::string::npos)
      << result.err;
  EXPECT_FALSE(fs::exists(file));
}

TEST_F(Outputs, OnAFullDiskLeaveWhatWasThere) {
  if (unshare(CLONE_NEWNS) != 0 || mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0 ||
      mount("tmpfs", work_.c_str(), "tmpfs", 0, "size=8k") != 0) {
    GTEST_SKIP() << "no file system of our own on this machine: " << std::strerror(errno);
  }
  WriteText(work_ / "fill", std::string(4096, 'x'));
  for (const auto& command : Commands()) {
    if (command[1] == "export" || command[1] == "rescore")
      continue;  // these files are too small to fill the disk
    SCOPED_TRACE(testing::PrintToString(command));
    WriteText(work_ / "file", "before");
    const Result result = Write(command, work_ / "file");
    EXPECT_EQ(result.code, 2) << result.out;
    EXPECT_EQ(result.err, "error: cannot write " + (work_ / "file").string() + ": No space left on device\n");
    EXPECT_EQ(ReadText(work_ / "file"), "before");
    EXPECT_EQ(std::distance(fs::directory_iterator(work_), {}), 2);
  }
  umount(work_.c_str());
}

// One of the calls for the file fails, or this call and all later ones fail, because the disk is full or has
// an error.
TEST_F(Outputs, AnHdf5FileIsRightOrNotThere) {
  if (kIsSanitized) GTEST_SKIP() << "a sanitizer must be the first library of a process";
  const fs::path file = work_ / "set.hdf5", counted = folder_.path() / "calls";
  const auto write = [&](const std::string& call) {
    return RunProgram({"evalbus", "export", run_, "--hdf5", file},
                      {work_, [&] {
                         setenv("LD_PRELOAD", FAILING_CALLS, 1);
                         setenv("FAILING_CALL", call.c_str(), 1);
                         setenv("FAILING_BELOW", work_.c_str(), 1);
                         setenv("COUNTED_CALLS", counted.c_str(), 1);
                       }});
  };
  std::string right;
  for (const char* call : {"pwrite", "fsync", "close", "rename"}) {
    fs::remove(counted);
    ASSERT_EQ(write(call + std::string(":0:28")).code, 0);
    right = ReadText(file);
    fs::remove(file);
    int calls = 0;
    ASSERT_EQ(std::sscanf(ReadText(counted).c_str(), (call + std::string(" %d")).c_str(), &calls), 1) << call;
    ASSERT_GE(calls, 1);
    for (int number = 1; number <= calls; ++number) {
      const char* const error = number % 3 == 0 ? ":28" : number % 3 == 1 ? ":28+" : ":5";
      const std::string failing = call + (":" + std::to_string(number)) + error;
      const Result result = write(failing);
      EXPECT_EQ(result.code, 2) << failing << result.out;
      EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << failing << result.err;
      EXPECT_NE(result.err.find(error[1] == '5' ? "Input/output error" : "No space left on device"),
                std::string::npos)
          << failing << result.err;
      EXPECT_TRUE(fs::is_empty(work_)) << failing;
    }
  }
  EXPECT_EQ(write("pwrite:0:28").code, 0);
  EXPECT_EQ(ReadText(file), right);
}

TEST_F(Outputs, WhatCannotBePrintedIsNoSuccess) {
  for (const std::vector<std::string>& command :
       std::vector<std::vector<std::string>>{{"evalbus", "compare", run_, run_},
                                             {"evalbus", "tasks", "list"},
                                             {"evalbus", "--help"},
                                             {"evalbus", "run", "--help"},
                                             {"evalbus", "export", run_, "--csv", "-"}}) {
    const Result result =
        RunProgram(command, {work_, [] { dup2(open("/dev/full", O_WRONLY), STDOUT_FILENO); }});
    EXPECT_EQ(result.code, 2) << command[1];
    EXPECT_NE(result.err.find("error: cannot write "), std::string::npos) << result.err;
  }
}

// The run folder's name is too long, or the folder is a link to itself.
TEST_F(Outputs, InvalidRunFoldersAreRefusedInOneLine) {
  const std::vector<std::string> names = {std::string(5000, 'x'), (work_ / std::string(300, 'x')).string(),
                                          (work_ / "loop").string()};
  fs::create_symlink("loop", work_ / "loop");
  for (const std::string& name : names) {
    for (const std::vector<std::string>& command :
         std::vector<std::vector<std::string>>{{"evalbus", "run", "lift_pot", "--in-process", "--out", name},
                                               {"evalbus", "report", name},
                                               {"evalbus", "export", name, "--csv", "a.csv"},
                                               {"evalbus", "compare", name, name},
                                               {"evalbus", "rescore", name},
                                               {"evalbus", "replay", name},
                                               {"evalbus", "render", name}}) {
      const Result result = RunProgram(command, {work_, nullptr});
      EXPECT_EQ(result.code, 1) << command[1] << result.out;
      EXPECT_TRUE(result.err.starts_with("error: ")) << result.err;
      EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
      EXPECT_EQ(result.err.find("filesystem error"), std::string::npos) << result.err;
    }
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(work_), {}), 1);
}

TEST_F(Outputs, ARunIsCalledByItsFolder) {
  const std::string task = ShortTask(folder_.path(), 0.1);
  for (const char* out : {"x/", "."}) {
    const fs::path folder = work_ / "in";
    fs::create_directory(folder);
    const Result result = RunProgram(
        {"evalbus", "run", task, "--policy", "hold", "--episodes", "1", "--in-process", "--out", out},
        {folder, nullptr});
    EXPECT_EQ(result.code, 0) << result.err;
    const fs::path run = std::string(out) == "." ? folder : folder / "x";
    EXPECT_EQ(nlohmann::json::parse(ReadText(run / "run.json"))["run_id"], run.filename().string()) << out;
    fs::remove_all(folder);
  }
}

}  // namespace evalbus::outputs_test
