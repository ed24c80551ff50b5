// Runs every command of the first ten minutes of docs/connecting_a_policy.md as printed there, except for the
// server's address and the number of episodes.
#include <sstream>

#include "tests/doubles/policy_server.h"
#include "tests/integration/harness.h"

namespace evalbus::connecting_page_test {

namespace fs = std::filesystem;
using policy::FloatArray;
using policy::Map;
using policy::PolicyServerDouble;
using policy::Value;

// Returns the lines of the code blocks of a section.
std::vector<std::string> Commands(const std::string& heading) {
  std::istringstream page(ReadText(EVALBUS_SOURCE_DIR "/docs/connecting_a_policy.md"));
  std::vector<std::string> commands;
  bool here = false, in_block = false;
  for (std::string line; std::getline(page, line);) {
    if (line.starts_with("## ")) here = line == "## " + heading;
    if (line.starts_with("```")) {
      in_block = !in_block;
    } else if (here && in_block) {
      commands.push_back(line);
    }
  }
  return commands;
}

void Replace(const std::string& from, const std::string& to, std::string* text) {
  for (size_t at = 0; (at = text->find(from, at)) != std::string::npos; at += to.size()) {
    text->replace(at, from.size(), to);
  }
}

TEST(ConnectingPage, FirstTenMinutes) {
  EVALBUS_NEEDS_BUS();
  // The source folder as a user has it, without the developer's folder runs/.
  TemporaryFolder folder;
  for (const char* name : {"python", "models"}) {
    fs::create_directory_symlink(fs::path(EVALBUS_SOURCE_DIR) / name, folder.path() / name);
  }
  fs::create_directory_symlink(EVALBUS_BINARY_DIR, folder.path() / "build");
  const Program::Setting here{.working_folder = folder.path(), .before = {}};

  // The checkpoint always returns zeros, which are RoboEval's joint deltas.
  PolicyServerDouble checkpoint({.answer = [](const Value&) -> Value {
    return Map{{"actions", FloatArray(std::vector<double>(160, 0), {10, 16})}};
  }});
  std::unique_ptr<Program> server;
  int run = 0;
  for (std::string command : Commands("The first ten minutes")) {
    if (command.find("scripted_policy.py") != std::string::npos) {
      server =
          std::make_unique<Program>(std::vector<std::string>{"/bin/sh", "-c", "exec env " + command}, here);
      ASSERT_TRUE(
          WaitFor([&] { return server->out().find("ready") != std::string::npos || !server->running(); }));
      ASSERT_TRUE(server->running()) << server->err();
      continue;
    }
    Replace("ws://127.0.0.1:8000", checkpoint.url(), &command);
    // Evaluates one episode instead of the page's twenty, to save time.
    Replace("--episodes 20", "--episodes 1", &command);
    const Result result = RunProgram({"/bin/sh", "-c", command}, here);
    EXPECT_EQ(result.code, 0) << command << "\n" << result.out << result.err;
    ++run;
  }
  EXPECT_EQ(run, 6);
}

}  // namespace evalbus::connecting_page_test
