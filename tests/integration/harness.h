// Helpers of integration tests. They run programs as child processes, read run folders and logs, and wait for
// conditions.
#pragma once

#include <gtest/gtest.h>
#include <sys/types.h>

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bus/bus.h"
#include "tests/deadline.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kIsSanitized = true;
#else
constexpr bool kIsSanitized = false;
#endif

// Polls a condition until it is true; returns false at the deadline.
bool WaitFor(const std::function<bool()>& condition);

std::string ReadText(const std::filesystem::path& file);
void WriteText(const std::filesystem::path& file, const std::string& text);

// Returns a bus URL that no other test and no other process of this machine uses.
std::string UniqueUrl();
// Skips the test if this machine has no bus for tests.
#define EVALBUS_NEEDS_BUS() \
  if (!WhyNoBus().empty()) GTEST_SKIP() << WhyNoBus()
const std::string& WhyNoBus();

// A child process. Our programs are named without a folder: "evalbus", "evalbus-sim".
class Program {
 public:
  struct Setting {
    std::filesystem::path working_folder;
    // Runs in the child before the program starts.
    std::function<void()> before;
  };
  explicit Program(std::vector<std::string> command) : Program(std::move(command), Setting{}) {}
  Program(std::vector<std::string> command, const Setting& setting);
  // Kills the program if it is still running.
  ~Program();
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  pid_t pid() const { return pid_; }
  bool running();
  void Signal(int signal);
  // Returns the exit code or 128 + signal. If the program does not end, fails the test and returns -1.
  int Wait();
  std::string out() const { return ReadText(folder_.path() / "out"); }
  std::string err() const { return ReadText(folder_.path() / "err"); }

 private:
  TemporaryFolder folder_;
  pid_t pid_ = -1;
  int code_ = -1;
  bool ended_ = false;
};

struct Result {
  int code;
  std::string out, err;
};
Result RunProgram(std::vector<std::string> command, const Program::Setting& setting = {});

// Runs `evalbus run` with these arguments; fails the test unless it exits with 0.
void Evaluate(const std::vector<std::string>& arguments, const std::filesystem::path& out);

// Returns the standard error of `evalbus render` without the lines that it prints every ten seconds.
std::string WithoutProgress(const std::string& err);

// Writes a task with this time limit into the folder; returns the file.
std::string ShortTask(const std::filesystem::path& folder, double time_limit_s,
                      const std::string& task = "lift_pot");

// Returns the run of the variation "position" in the folder of a plan's policy, whose name contains the
// task's path. Returns an empty path if there is none.
std::filesystem::path OnlyRun(const std::filesystem::path& policy);

// Suspends processes (SIGSTOP) until it is destroyed.
class Stopped {
 public:
  explicit Stopped(std::vector<pid_t> processes);
  ~Stopped();
  Stopped(const Stopped&) = delete;
  Stopped& operator=(const Stopped&) = delete;

 private:
  std::vector<pid_t> processes_;
};

// Returns the process ids of the children of `parent` whose program has this name.
std::vector<pid_t> ChildrenOf(pid_t parent, const std::string& program = "");

struct RecordedLog {
  struct Event {
    std::string channel;
    std::vector<uint8_t> data;
    int64_t time_us = 0;
  };
  std::vector<Event> events;
  int64_t damaged_bytes = 0;

  std::vector<std::vector<uint8_t>> Payloads(std::string_view channel) const;
  // Returns the messages of the channel; one that does not decode fails the test.
  template <class Message>
  std::vector<Message> Messages(const Channel<Message>& channel) const {
    std::vector<Message> messages;
    for (const Event& event : events) {
      if (event.channel != channel.name) continue;
      EXPECT_TRUE(Decode(event.data, &messages.emplace_back())) << channel.name;
    }
    return messages;
  }
};
RecordedLog ReadLog(const std::filesystem::path& file);
std::filesystem::path LogFile(const std::filesystem::path& run, int episode);
// Expects a line in RUN/logs/COMPONENT.log that has this level and, somewhere after it, this text.
void ExpectLogged(const std::filesystem::path& run, const std::string& component, const std::string& level,
                  const std::string& text);

// Fails the test unless both logs hold the same STATE, CONTACTS, ACTION and PARTIAL, byte for byte.
void ExpectSameTicks(const RecordedLog& a, const RecordedLog& b);
// Fails the test unless both runs have the same episodes.jsonl and summary.json, byte for byte.
void ExpectSameScores(const std::filesystem::path& run_a, const std::filesystem::path& run_b);

std::vector<nlohmann::ordered_json> Episodes(const std::filesystem::path& run);

// Returns why a JSON file, or a line of a .jsonl file, does not match docs/schema/SCHEMA.json; empty if it
// does.
std::string SchemaError(const std::string& schema, const std::filesystem::path& file);

}  // namespace evalbus
