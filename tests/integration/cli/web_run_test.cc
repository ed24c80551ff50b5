// Tests evalbus web: a browser follows a run while it is active, is killed and is resumed.
#include "tests/integration/harness.h"

namespace evalbus::web_run_test {

// check_live.py documents what is compared.
TEST(WebRun, BrowserFollowsARunThatIsKilledAndResumed) {
  EVALBUS_NEEDS_BUS();
  const TemporaryFolder folder;
  const Result result = RunProgram({"/usr/bin/python3", EVALBUS_SOURCE_DIR "/tests/browser/check_live.py",
                                    EVALBUS_BINARY_DIR "/bin/evalbus", folder.path().string()});
  if (result.code == 77) GTEST_SKIP() << result.out;
  EXPECT_EQ(result.code, 0) << result.out << result.err;
}

}  // namespace evalbus::web_run_test
