#include "tests/integration/harness.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <regex>
#include <sstream>
#include <thread>

#include "base/errors.h"
#include "base/run_layout.h"
#include "bus/channels.h"
#include "bus/event_log.h"
#include "bus/private_network.h"
#include "bus/recorder/recorder.h"

namespace evalbus {
namespace {

namespace fs = std::filesystem;
using std::chrono::steady_clock;

std::string g_why_no_bus;

std::string Replace(std::string text, const std::string& what, const std::string& with) {
  size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  for (; at != std::string::npos; at = text.find(what, at + with.size())) text.replace(at, what.size(), with);
  return text;
}

}  // namespace

bool WaitFor(const std::function<bool()>& condition) {
  const auto end = steady_clock::now() + kDeadline;
  while (!condition()) {
    if (steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

std::string ReadText(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

void WriteText(const fs::path& file, const std::string& text) {
  std::ofstream(file, std::ios::binary) << text;
  EXPECT_EQ(fs::file_size(file), text.size()) << file;
}

std::string UniqueUrl() {
  static std::vector<ReservedBus> buses;
  buses.push_back(ReservedBus::Draw());
  return buses.back().url();
}

const std::string& WhyNoBus() { return g_why_no_bus; }

Program::Program(std::vector<std::string> command, const Setting& setting) {
  if (command[0].starts_with("evalbus")) command[0] = std::string(EVALBUS_BINARY_DIR "/bin/") + command[0];
  std::vector<char*> argv;
  for (std::string& argument : command) argv.push_back(argument.data());
  argv.push_back(nullptr);
  const std::string out = folder_.path() / "out", err = folder_.path() / "err";
  pid_ = fork();
  if (pid_ == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    const int flags = O_WRONLY | O_CREAT | O_APPEND;
    dup2(open("/dev/null", O_RDONLY), STDIN_FILENO);
    dup2(open(out.c_str(), flags, 0644), STDOUT_FILENO);
    dup2(open(err.c_str(), flags, 0644), STDERR_FILENO);
    if (!setting.working_folder.empty() && chdir(setting.working_folder.c_str()) != 0) _exit(126);
    if (setting.before) setting.before();
    execvp(argv[0], argv.data());
    _exit(127);
  }
  EXPECT_GT(pid_, 0);
}

Program::~Program() {
  if (!running()) return;
  Signal(SIGKILL);
  Wait();
}

bool Program::running() {
  int status = 0;
  if (!ended_ && waitpid(pid_, &status, WNOHANG) == pid_) {
    ended_ = true;
    code_ = WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
  }
  return !ended_;
}

void Program::Signal(int signal) {
  if (!ended_) kill(pid_, signal);
}

int Program::Wait() {
  EXPECT_TRUE(WaitFor([this] { return !running(); })) << out() << err();
  return code_;
}

Result RunProgram(std::vector<std::string> command, const Program::Setting& setting) {
  Program program(std::move(command), setting);
  const int code = program.Wait();
  return {code, program.out(), program.err()};
}

void Evaluate(const std::vector<std::string>& arguments, const fs::path& out) {
  std::vector<std::string> command = {"evalbus", "run", "--out", out};
  command.insert(command.end(), arguments.begin(), arguments.end());
  const Result result = RunProgram(command);
  ASSERT_EQ(result.code, 0) << result.out << result.err;
  EXPECT_EQ(result.err, "");
}

std::string WithoutProgress(const std::string& err) {
  return std::regex_replace(err, std::regex("recording video of [^\n]*\n"), "");
}

std::string ShortTask(const fs::path& folder, double time_limit_s, const std::string& task) {
  const std::string models = EVALBUS_SOURCE_DIR "/models/";
  std::string text = ReadText(models + "tasks/" + task + ".yaml");
  text = Replace(text, "../", models);
  text = std::regex_replace(text, std::regex("time_limit_s: \\d+"),
                            "time_limit_s: " + std::to_string(time_limit_s));
  const fs::path file = folder / ("short_" + task.substr(task.rfind('_') + 1) + ".yaml");
  WriteText(file, text);
  return file;
}

fs::path OnlyRun(const fs::path& policy) {
  for (const auto& entry : fs::directory_iterator(policy)) {
    const std::string name = entry.path().filename();
    if (entry.is_directory() && !name.starts_with(".") && name.ends_with("position")) return entry.path();
  }
  return {};
}

Stopped::Stopped(std::vector<pid_t> processes) : processes_(std::move(processes)) {
  for (const pid_t process : processes_) EXPECT_EQ(kill(process, SIGSTOP), 0);
}

Stopped::~Stopped() {
  for (const pid_t process : processes_) kill(process, SIGCONT);
}

std::vector<pid_t> ChildrenOf(pid_t parent, const std::string& program) {
  std::vector<pid_t> children;
  const std::string pid = std::to_string(parent);
  std::istringstream list(ReadText("/proc/" + pid + "/task/" + pid + "/children"));
  for (pid_t child; list >> child;) {
    std::error_code error;
    const fs::path exe = fs::read_symlink("/proc/" + std::to_string(child) + "/exe", error);
    if (program.empty() || exe.filename() == program) children.push_back(child);
  }
  return children;
}

std::vector<std::vector<uint8_t>> RecordedLog::Payloads(std::string_view channel) const {
  std::vector<std::vector<uint8_t>> payloads;
  for (const Event& event : events) {
    if (event.channel == channel) payloads.push_back(event.data);
  }
  return payloads;
}

RecordedLog ReadLog(const fs::path& file) {
  EventLogReader reader(file);
  RecordedLog log;
  for (LogEvent event; reader.Next(&event);) {
    log.events.push_back({std::string(event.channel), {event.data.begin(), event.data.end()}, event.time_us});
  }
  log.damaged_bytes = reader.damaged_bytes();
  EXPECT_FALSE(log.events.empty()) << file;
  return log;
}

fs::path LogFile(const fs::path& run, int episode) { return EpisodeFolder(run, episode) / "events.lcmlog"; }

void ExpectLogged(const fs::path& run, const std::string& component, const std::string& level,
                  const std::string& text) {
  const std::string log = ReadText(evalbus::LogFile(run, component));
  std::istringstream lines(log);
  for (std::string line; std::getline(lines, line);) {
    const size_t at = line.find((level.empty() ? "" : " [" + level) + "] " + component);
    if (at != std::string::npos && line.find(text, at) != std::string::npos) return;
  }
  ADD_FAILURE() << "no [" << level << "] line with '" << text << "' in the log of " << component << ":\n"
                << log;
}

// Byte offsets of header_t.episode, which follows the fingerprint and the session, and of header_t.attempt.
constexpr int kEpisode = 16, kAttempt = 20;

void ExpectSameTicks(const RecordedLog& a, const RecordedLog& b) {
  for (const char* channel :
       {channels::kState.name, channels::kContacts.name, channels::kAction.name, channels::kPartial.name}) {
    auto payloads_a = a.Payloads(channel), payloads_b = b.Payloads(channel);
    if (channels::kAction == channel) {
      // The answer to the last state has no effect and may arrive after the log was closed. In this case it
      // is in the log of the next episode.
      const auto states = a.Payloads(channels::kState);
      const size_t num_states = states.size();
      const auto is_of_another_episode = [&](const std::vector<uint8_t>& payload) {
        return !std::equal(payload.begin() + kEpisode, payload.begin() + kAttempt,
                           states.at(0).begin() + kEpisode);
      };
      for (auto* payloads : {&payloads_a, &payloads_b}) {
        std::erase_if(*payloads, is_of_another_episode);
        ASSERT_GE(payloads->size() + 1, num_states);
        payloads->resize(num_states - 1);
      }
    }
    ASSERT_EQ(payloads_a.size(), payloads_b.size()) << channel;
    EXPECT_GT(payloads_a.size(), 5u) << channel;
    // Retried episodes differ in the number of the attempt only.
    for (auto* payloads : {&payloads_a, &payloads_b}) {
      for (std::vector<uint8_t>& payload : *payloads)
        std::fill_n(payload.begin() + kAttempt, sizeof(int32_t), 0);
    }
    const auto [first, unused] = std::mismatch(payloads_a.begin(), payloads_a.end(), payloads_b.begin());
    EXPECT_EQ(first, payloads_a.end())
        << channel << " differs first in message " << first - payloads_a.begin();
  }
}

void ExpectSameScores(const fs::path& run_a, const fs::path& run_b) {
  for (const char* file : {"episodes.jsonl", "summary.json"}) {
    EXPECT_NE(ReadText(run_a / file), "") << run_a / file;
    EXPECT_EQ(ReadText(run_a / file), ReadText(run_b / file));
  }
}

std::vector<nlohmann::ordered_json> Episodes(const fs::path& run) {
  std::vector<nlohmann::ordered_json> episodes;
  std::istringstream lines(ReadText(run / "episodes.jsonl"));
  for (std::string line; std::getline(lines, line);) episodes.push_back(nlohmann::ordered_json::parse(line));
  return episodes;
}

// Debian's python3 has the package jsonschema.
std::string SchemaError(const std::string& schema, const fs::path& file) {
  const Result result = RunProgram({"/usr/bin/python3", "-c",
                                    "import json, jsonschema, pathlib, sys\n"
                                    "path, file = map(pathlib.Path, sys.argv[1:])\n"
                                    "schema, text = json.loads(path.read_text()), file.read_text()\n"
                                    "jsonschema.Draft202012Validator.check_schema(schema)\n"
                                    "resolver = jsonschema.RefResolver(path.as_uri(), schema)\n"
                                    "validator = jsonschema.Draft202012Validator(schema, resolver=resolver)\n"
                                    "documents = text.splitlines() if file.suffix == '.jsonl' else [text]\n"
                                    "if not documents: raise SystemExit('empty')\n"
                                    "for document in documents: validator.validate(json.loads(document))\n",
                                    fs::path(EVALBUS_SOURCE_DIR) / "docs/schema" / (schema + ".json"), file});
  return result.code == 0 ? "" : file.string() + ": " + result.err;
}

}  // namespace evalbus

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  // Isolates this process and its children, so that they exchange no messages with other processes.
  try {
    evalbus::EnterPrivateNetwork();
  } catch (const evalbus::EnvironmentError&) {
    // This machine does not permit namespaces. Its own multicast also works, because with ttl=0 nothing
    // leaves the machine.
    evalbus::g_why_no_bus = evalbus::WhyNoMulticast(evalbus::UniqueUrl());
  }
  return RUN_ALL_TESTS();
}
