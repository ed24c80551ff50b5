// Example of a subscriber: `listener BUS EPISODES` prints one line for each of EPISODES episodes. BUS is the
// address that `evalbus run` prints in its first line or receives with --url.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>

#include "bus/bus.h"
#include "bus/channels.h"

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "error: expected the bus, udpm://ADDRESS:PORT?ttl=0, and a number of episodes\n");
    return 1;
  }
  try {
    evalbus::Bus bus(argv[1]);
    int left = std::atoi(argv[2]);
    bus.Subscribe(evalbus::channels::kEpisodeSummary, [&](const evalbus::episode_summary_t& summary) {
      std::printf("episode %d: %s after %.2f s\n", summary.header.episode, summary.end_reason.c_str(),
                  static_cast<double>(summary.header.sim_time_us) * 1e-6);
      --left;
    });
    std::printf("listening\n");
    std::fflush(stdout);
    while (left > 0) bus.Handle(std::chrono::steady_clock::now() + std::chrono::seconds(1));
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 1;
  }
}
