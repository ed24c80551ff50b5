#include "base/output_files.h"

#include <gtest/gtest.h>

#include "base/errors.h"

namespace evalbus {
namespace {

TEST(OutputFiles, MustDiffer) {
  EXPECT_NO_THROW(
      CheckFilesDiffer({{"--json", ""}, {"--markdown", ""}, {"--latex", "/tmp/a"}, {"--report", "/tmp/b"}}));
  try {
    CheckFilesDiffer({{"--json", "/tmp/a"}, {"--markdown", "/tmp/b/../a"}});
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(), "--json and --markdown name the same file: /tmp/b/../a");
  }
}

}  // namespace
}  // namespace evalbus
