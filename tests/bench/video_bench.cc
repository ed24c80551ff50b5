// Measures the cost of videos for an evaluation by alternating `evalbus run` with and without --video. Videos
// are recorded during the run at the lowest priority. The benchmark reports when the evaluation has finished
// and how much longer the videos take.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "base/errors.h"
#include "runner/processes.h"
#include "tests/bench/rounds.h"

namespace evalbus {
namespace {

struct Times {
  double evaluated = 0, with_video = 0;  // s
};

// Returns the seconds until the scores were complete and until the videos were complete.
Times Run(int episodes, const std::filesystem::path& folder, const std::string& options) {
  const std::string command = fmt::format("{} run lift_pot/position --episodes {} --seed 1 --out {} {} 2>&1",
                                          (runner::Processes::BinaryFolder() / "evalbus").string(), episodes,
                                          folder.string(), options);
  const auto start = std::chrono::steady_clock::now();
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), pclose);
  Times times;
  std::string said;
  for (char line[500]; std::fgets(line, sizeof line, pipe.get());) {
    char episode[20];
    std::sscanf(line, "%*d %19s in %lf s", episode, &times.evaluated);
    said += line;
  }
  times.with_video = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (said.find(fmt::format("Success in {} of {} ", episodes, episodes)) == std::string::npos) {
    throw EnvironmentError("the run failed: " + said);
  }
  const auto has_video = [](const auto& entry) { return entry.path().extension() == ".mp4"; };
  const std::filesystem::recursive_directory_iterator files(folder);
  const auto videos = std::count_if(begin(files), end(files), has_video);
  if (videos != (options.find("--video") == std::string::npos ? 0 : episodes)) {
    throw EnvironmentError(fmt::format("{} videos: {}", videos, said));
  }
  std::filesystem::remove_all(folder);
  return times;
}

void Measure(const std::string& title, const std::string& options, const Amount& amount,
             const std::filesystem::path& folder) {
  std::vector<double> plain, beside, ratio, with_video;
  for (int round = 0; round < amount.rounds; ++round) {
    plain.push_back(Run(amount.episodes, folder, options).evaluated);
    const Times times = Run(amount.episodes, folder, options + " --video overview");
    beside.push_back(times.evaluated);
    with_video.push_back(times.with_video);
    ratio.push_back(beside.back() / plain.back());
  }
  fmt::print(
      "{:<20} {} episodes evaluated in {:.2f} s, with videos beside them in {:.2f} s: {:.2f} times ({:.2f} "
      "to "
      "{:.2f}); videos done after {:.1f} s\n",
      title, amount.episodes, Median(plain), Median(beside), Median(ratio),
      *std::min_element(ratio.begin(), ratio.end()), *std::max_element(ratio.begin(), ratio.end()),
      Median(with_video));
  std::fflush(stdout);
}

}  // namespace
}  // namespace evalbus

int main(int argc, char** argv) {
  evalbus::Amount amount{.episodes = 10, .rounds = 5};
  if (const auto code = evalbus::ParseAmount(
          argc, argv, "Times runs with videos made beside them against the same without.", &amount))
    return *code;
  return evalbus::RunInFolder([&](const std::filesystem::path& folder) {
    evalbus::Measure("separate processes", "", amount, folder / "run");
    evalbus::Measure("one process", "--in-process", amount, folder / "run");
  });
}
