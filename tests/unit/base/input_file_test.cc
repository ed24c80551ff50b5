#include "base/input_file.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstring>
#include <fstream>
#include <functional>
#include <iterator>
#include <vector>

#include "base/errors.h"
#include "base/sha256.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::input_file_test {

namespace fs = std::filesystem;

template <class Read>
std::string ErrorOf(const Read& read) {
  try {
    read();
  } catch (const InputError& error) {
    return error.what();
  }
  return "(no error)";
}

class InputFileTest : public testing::Test {
 protected:
  // Expects each way to open a file to report the same reason.
  void ExpectRefused(const fs::path& file, const std::string& reason) const {
    EXPECT_EQ(ErrorOf([&] { InputFile{file}; }), file.string() + ": cannot be read: " + reason);
    EXPECT_EQ(ErrorOf([&] { ReadInput(file); }), file.string() + ": cannot be read: " + reason);
    EXPECT_EQ(ErrorOf([&] { OpenInput(file); }), file.string() + ": cannot be read: " + reason);
    EXPECT_EQ(ErrorOf([&] { CheckInput(file); }), file.string() + ": cannot be read: " + reason);
    EXPECT_EQ(ErrorOf([&] { ReadInput(file, "plan"); }), file.string() + ": cannot read the plan: " + reason);
  }

  const TemporaryFolder folder_;
  const fs::path file_ = folder_.path() / "a";
};

TEST_F(InputFileTest, ReadsFilesOfAnyLength) {
  for (const size_t size : {0, 1, 65536, 200001}) {
    std::string text(size, 'x');
    if (size > 2) text[size - 2] = '\0';
    std::ofstream(file_, std::ios::binary) << text;
    EXPECT_EQ(InputFile(file_).size(), size);
    EXPECT_EQ(ReadInput(file_), text);
    std::ifstream stream = OpenInput(file_);
    EXPECT_EQ(std::string(std::istreambuf_iterator<char>(stream), {}), text);
  }
  fs::create_symlink("a", folder_.path() / "link");
  EXPECT_EQ(ReadInput(folder_.path() / "link").size(), 200001u);
  // The kernel reports a size of 0 for this file, although it has content.
  EXPECT_EQ(InputFile("/proc/self/cmdline").size(), 0u);
  EXPECT_GT(ReadInput("/proc/self/cmdline").size(), 3u);
}

TEST_F(InputFileTest, CountsCompleteLines) {
  EXPECT_EQ(CountLines(file_), 0);
  std::ofstream(file_) << "a\nb\nc";
  EXPECT_EQ(CountLines(file_), 2);
  EXPECT_THROW(CountLines(folder_.path()), InputError);
  EXPECT_THROW(CountLines(folder_.path() / std::string(300, 'x')), InputError);
}

// The machine has failed and not the user, so the error is not an InputError.
TEST_F(InputFileTest, AFailedReadIsNotTheEndOfTheFile) {
  // stat() reports a regular file, but its first byte cannot be read.
  const fs::path unreadable = "/proc/self/mem";
  for (const auto& read :
       std::vector<std::function<void()>>{[&] { ReadInput(unreadable); }, [&] { Sha256File(unreadable); }}) {
    try {
      read();
      ADD_FAILURE();
    } catch (const EnvironmentError& error) {
      EXPECT_STREQ(error.what(), "/proc/self/mem: cannot be read: Input/output error");
    }
  }
}

TEST_F(InputFileTest, AStreamIsTheFileThatWasOpened) {
  std::ofstream(file_) << "before";
  std::ifstream stream = OpenInput(file_);
  fs::remove(file_);
  std::ofstream(file_) << "after";
  std::string text;
  stream >> text;
  EXPECT_EQ(text, "before");
}

TEST_F(InputFileTest, RefusesAtOnceWhatIsNoFile) {
  ExpectRefused(file_, "No such file or directory");
  ExpectRefused(folder_.path(), "a folder, expected a file");
  ExpectRefused("/dev/zero", "a device, expected a file");
  fs::create_symlink("/dev/zero", folder_.path() / "link");
  ExpectRefused(folder_.path() / "link", "a device, expected a file");
  // A FIFO without a writer: an ordinary open() would block forever.
  ASSERT_EQ(mkfifo(file_.c_str(), 0600), 0);
  ExpectRefused(file_, "a named pipe, expected a file");
  const fs::path name = folder_.path() / "socket";
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strcpy(address.sun_path, name.c_str());
  const int listener = socket(AF_UNIX, SOCK_STREAM, 0);
  ASSERT_EQ(bind(listener, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  ExpectRefused(name, "a socket, expected a file");
  close(listener);
  fs::create_symlink("loop", folder_.path() / "loop");
  ExpectRefused(folder_.path() / "loop", "Too many levels of symbolic links");
}

}  // namespace evalbus::input_file_test
