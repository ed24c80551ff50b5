#include "results/blind_order.h"

#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <system_error>

#include "base/errors.h"
#include "base/json_file.h"
#include "base/random.h"
#include "base/sha256.h"

namespace evalbus::results {
namespace {

// Random stream of the order. kLightStream (base/random.h) has the same number, which is harmless, because
// lights do not depend on the order. A different number would invalidate the verdicts of judgments that have
// begun.
constexpr uint32_t kOrderStream = 0x10003;

// Fisher-Yates shuffle.
template <class T>
void Shuffle(Random* random, std::vector<T>* values) {
  for (size_t left = values->size(); left > 1; --left) {
    std::swap((*values)[left - 1], (*values)[static_cast<size_t>(random->Index(static_cast<int>(left)))]);
  }
}

}  // namespace

std::vector<std::pair<int, int>> EpisodesOfEqualSeeds(const RecordedRun& a, const RecordedRun& b) {
  if (a.task_name() != b.task_name()) {
    throw InputError(fmt::format("{} ran {}, {} ran {}: expected runs of the same task and variation", a.name,
                                 a.task_name(), b.name, b.task_name()));
  }
  std::error_code ignored;  // of folders that do not exist
  if (std::filesystem::equivalent(a.folder, b.folder, ignored))
    throw InputError(fmt::format("{}: given twice, expected two different runs", a.folder.string()));
  std::map<int64_t, int> by_seed;
  for (const RecordedEpisode& episode : b.episodes) by_seed[episode.seed] = episode.episode;
  std::vector<std::pair<int, int>> pairs;
  for (const RecordedEpisode& episode : a.episodes) {
    if (const auto found = by_seed.find(episode.seed); found != by_seed.end())
      pairs.emplace_back(episode.episode, found->second);
  }
  if (pairs.empty()) {
    throw InputError(
        fmt::format("{} and {} have no seed in common: run both with the same --seed", a.name, b.name));
  }
  return pairs;
}

std::string RunIdentity(const RecordedRun& run) {
  nlohmann::ordered_json values;
  for (const char* key : {"run_id", "policy", "policy_name", "policy_contract", "latency", "execution",
                          "seed", "git_commit", "plugins", "physics_sha256"}) {
    values[key] = run.info.value(key, nlohmann::ordered_json());
  }
  return Sha256Text(ToText(values));
}

std::vector<JudgedEpisode> BlindOrder(const std::vector<std::pair<int, int>>& pairs, int64_t seed) {
  Random random(seed, kOrderStream);
  std::vector<std::pair<int, int>> shuffled = pairs;
  Shuffle(&random, &shuffled);
  // The elements are char, because elements of vector<bool> cannot be swapped by reference.
  std::vector<char> is_swapped(pairs.size());
  for (size_t i = 0; i < is_swapped.size(); ++i) is_swapped[i] = i % 2 == 1;
  // If the number of pairs is odd, one run comes first in one more pair than the other. This draw decides
  // which run.
  if (random.Index(2) == 1) {
    for (char& swapped : is_swapped) swapped = !swapped;
  }
  Shuffle(&random, &is_swapped);
  std::vector<JudgedEpisode> order;
  for (size_t i = 0; i < shuffled.size(); ++i) {
    order.push_back({0, shuffled[i].first});
    order.push_back({1, shuffled[i].second});
    if (is_swapped[i]) std::swap(order[order.size() - 2], order.back());
  }
  return order;
}

}  // namespace evalbus::results
