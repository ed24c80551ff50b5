// Films of a run's finished episodes, made beside it: one `evalbus render` at a time, at low priority. One
// that fails or is killed is tried once more.
#pragma once

#include <deque>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "cli/launch/processes.h"
#include "cli/launch/run_controller.h"

namespace evalbus::launch {

class Filming : public RunListener {
 public:
  // The command that makes the films of an episode.
  using Render = std::function<std::vector<std::string>(int episode)>;

  // Passes everything on to `next`. Without cameras it does only that.
  Filming(const results::RunFolder& folder, const std::vector<std::string>& cameras, RunListener* next);
  Filming(const results::RunFolder& folder, std::vector<std::string> cameras, RunListener* next,
          Render render);
  // A film that is not finished leaves no file.
  ~Filming() override;

  void OnEpisodeBegin(const episode_begin_t& begin) override { next_->OnEpisodeBegin(begin); }
  void OnPartial(const partial_metrics_t& partial) override { next_->OnPartial(partial); }
  void OnEpisodeDone(const nlohmann::ordered_json& episode) override;
  void OnRemark(const std::string& text) override { next_->OnRemark(text); }
  void Poll(SteadyTime now) override;

  // Waits for the films that are missing, or until a stop is requested. Returns how many episodes still lack
  // theirs. Throws EnvironmentError if one could not be made; no further ones are then tried.
  size_t Finish();

 private:
  void Advance();
  size_t Missing() const { return waiting_.size() + filming_.has_value(); }

  const results::RunFolder& folder_;
  std::vector<std::string> cameras_;
  RunListener* next_;
  Render render_;
  std::deque<int> waiting_;
  std::optional<int> filming_;
  std::set<int> tried_again_;
  std::string failure_;
  Processes processes_;
};

}  // namespace evalbus::launch
