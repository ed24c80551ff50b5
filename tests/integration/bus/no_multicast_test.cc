// On a machine without multicast, a bus that the user requests fails with advice. By default, the run falls
// back to a private network namespace or, if that is not permitted, to one process, and reports it.
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>

#include "tests/integration/harness.h"

namespace evalbus::no_multicast_test {

namespace fs = std::filesystem;

// Enters a network namespace without any route.
void LeaveNetwork() {
  if (unshare(CLONE_NEWNET) != 0 && unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) _exit(125);
}

// Like LeaveNetwork(), but the process cannot create another namespace afterwards.
void LeaveNetworkForGood() {
  LeaveNetwork();
  sock_filter instructions[] = {
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_unshare, 0, 1),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | 1),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
  };
  sock_fprog filter{std::size(instructions), instructions};
  if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 || prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter) != 0)
    _exit(125);
}

class NoMulticast : public testing::Test {
 protected:
  void SetUp() override {
    if (RunProgram({"true"}, {"", LeaveNetworkForGood}).code != 0)
      GTEST_SKIP() << "no network namespaces here";
    task_ = ShortTask(folder_.path(), 0.2);
  }
  Result Run(const std::vector<std::string>& more, const std::function<void()>& before) {
    std::vector<std::string> command = {"evalbus", "run", task_, "--policy", "hold", "--episodes", "1"};
    command.insert(command.end(), more.begin(), more.end());
    return RunProgram(command, {folder_.path(), before});
  }

  TemporaryFolder folder_;
  std::string task_;
};

TEST_F(NoMulticast, AnExplicitRequestFailsWithTheFix) {
  const Result result = Run({"--url", "udpm://239.255.76.67:7667?ttl=0", "--out", "run"}, LeaveNetwork);
  EXPECT_EQ(result.code, 2);
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  for (const char* word : {"udpm://239.255.76.67:7667", "ip route add", "--in-process", "doctor"})
    EXPECT_NE(result.err.find(word), std::string::npos) << result.err;
  EXPECT_FALSE(fs::exists(folder_.path() / "run"));
}

TEST_F(NoMulticast, TheDefaultUsesAPrivateNetworkWithAMessage) {
  const Result result = Run({"--out", "run"}, LeaveNetwork);
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(result.err, "");
  EXPECT_NE(result.out.find("private network namespace"), std::string::npos) << result.out;
  EXPECT_NE(result.out.find("doctor"), std::string::npos) << result.out;
  EXPECT_EQ(Episodes(folder_.path() / "run").size(), 1u);
  EXPECT_EQ(nlohmann::json::parse(ReadText(folder_.path() / "run/run.json"))["in_process"], false);
}

TEST_F(NoMulticast, OtherwiseRunsInOneProcessWithAMessage) {
  const Result result = Run({"--out", "run"}, LeaveNetworkForGood);
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(result.err, "");
  EXPECT_NE(result.out.find("everything in one process"), std::string::npos) << result.out;
  EXPECT_EQ(nlohmann::json::parse(ReadText(folder_.path() / "run/run.json"))["in_process"], true);
  ASSERT_EQ(Run({"--out", "asked", "--in-process"}, LeaveNetworkForGood).code, 0);
  ExpectSameScores(folder_.path() / "run", folder_.path() / "asked");
}

TEST_F(NoMulticast, ComponentsFailWithTheFix) {
  const Result result =
      RunProgram({"evalbus-metrics", "--url", "udpm://239.255.76.67:7667?ttl=0"}, {"", LeaveNetwork});
  EXPECT_EQ(result.code, 2);
  EXPECT_NE(result.err.find("ip route add"), std::string::npos) << result.err;
}

TEST_F(NoMulticast, DoctorExplains) {
  const Result result = RunProgram({"evalbus", "doctor"}, {"", LeaveNetwork});
  EXPECT_EQ(result.code, 2);
  for (const char* word :
       {"FAIL", "ip link set lo up multicast on", "ip route add 224.0.0.0/4 dev lo", "--in-process"})
    EXPECT_NE(result.out.find(word), std::string::npos) << result.out;
  EXPECT_EQ(result.err, "");
}

TEST(Doctor, IsContentWhereEverythingWorks) {
  EVALBUS_NEEDS_BUS();
  const Result result = RunProgram({"evalbus", "doctor"});
  EXPECT_NE(result.out.find("ok    LCM multicast"), std::string::npos) << result.out;
  EXPECT_NE(result.out.find("ok    component programs"), std::string::npos) << result.out;
}

}  // namespace evalbus::no_multicast_test
