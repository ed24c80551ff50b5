#include "export/episode_table.h"

#include <algorithm>
#include <map>
#include <set>

#include "base/interned.h"
#include "results/operator_results.h"
#include "results/verdicts.h"

namespace evalbus::exports {
namespace {

std::string Quoted(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + "\"";
}

std::string Number(double value) {
  // dump() returns the shortest text that parses to the same number. Counts get no decimal point.
  const std::string text = nlohmann::json(value).dump();
  return text.ends_with(".0") ? text.substr(0, text.size() - 2) : text;
}

// Columns whose values are equal for all episodes of a run, so that tables of several runs can be
// concatenated. A value is empty if run.json lacks it.
constexpr char kRunColumns[] = "run,policy,policy_name,task,variation,robot,control_hz,evalbus_version";

std::string RunCells(const results::RecordedRun& run) {
  const auto text = [&](const char* key) {
    const auto found = run.info.find(key);
    return found != run.info.end() && found->is_string() ? found->get<std::string>() : "";
  };
  const auto hz = run.info.find("control_hz");
  std::string cells;
  for (const std::string& cell :
       {run.name, text("policy"), run.policy, run.task, run.variation,
        std::filesystem::path(text("robot")).stem().string(),
        hz != run.info.end() && hz->is_number() ? Number(hz->get<double>()) : "", text("evalbus_version")}) {
    cells += Quoted(cell) + ",";
  }
  return cells;
}

// Columns with the verdicts of operators on the episodes of several runs.
class OperatorColumns {
 public:
  explicit OperatorColumns(const std::vector<results::RecordedRun>& runs) {
    for (const results::RecordedRun& run : runs) {
      for (results::Verdict& verdict : results::ReadVerdictsOf(run)) {
        operators_.insert(verdict.operator_name);
        verdicts_[run.folder][{verdict.episode, verdict.operator_name}] = std::move(verdict);
      }
    }
  }

  std::string Header() const {
    std::string header;
    for (const std::string& name : operators_) {
      for (const char* what : {"verdict.", "stages_reached.", "rubric."}) header += "," + Quoted(what + name);
    }
    return header;
  }

  // Returns empty cells for an episode that the operator has not judged.
  std::string Cells(const results::RecordedRun& run, int episode) const {
    std::string cells;
    for (const std::string& name : operators_) {
      const auto of_run = verdicts_.find(run.folder);
      const results::Verdict* verdict = nullptr;
      if (of_run != verdicts_.end()) {
        const auto found = of_run->second.find({episode, name});
        if (found != of_run->second.end()) verdict = &found->second;
      }
      cells += verdict ? std::string(",") + results::Word(verdict->outcome) : ",";
      cells += verdict && verdict->stages ? "," + std::to_string(*verdict->stages) : ",";
      cells += verdict && verdict->rubric ? "," + Number(*verdict->rubric) : ",";
    }
    return cells;
  }

 private:
  std::set<std::string> operators_;
  // Verdicts by run folder, then by episode and operator.
  std::map<std::filesystem::path, std::map<std::pair<int, std::string>, results::Verdict>> verdicts_;
};

}  // namespace

std::string EpisodeTable(const std::vector<results::RecordedRun>& runs) {
  std::vector<std::string> names;
  std::map<std::string_view, size_t> index;
  // Values of each episode, with the indices of their columns.
  std::vector<std::vector<std::pair<size_t, double>>> values;
  for (const results::RecordedRun& run : runs) {
    for (const results::RecordedEpisode& episode : run.episodes) {
      auto& cells = values.emplace_back();
      metrics::NamedNumbers numbers;
      for (const auto& [name, value] : episode.parameters)
        numbers.emplace_back(Interned("parameters." + std::string(name)), value);
      for (const auto& number : episode.Values()) numbers.push_back(number);
      for (const auto& number :
           metrics::FlattenedValues(metrics::PosesJson(episode.final_poses), "final_poses"))
        numbers.push_back(number);
      for (const auto& [name, value] : numbers) {
        const auto [column, is_new] = index.emplace(name, names.size());
        if (is_new) names.emplace_back(name);
        cells.emplace_back(column->second, value);
      }
    }
  }
  const bool has_notes = std::ranges::any_of(runs, [](const results::RecordedRun& run) {
    return std::ranges::any_of(run.episodes, [](const auto& episode) { return !episode.note.empty(); });
  });
  const bool has_training = std::ranges::any_of(runs, [](const results::RecordedRun& run) {
    return std::ranges::any_of(run.episodes,
                               [](const auto& episode) { return episode.seen_in_training.has_value(); });
  });
  std::string table = std::string(kRunColumns) + ",episode,seed,end_reason,failure_reason,complete";
  if (has_training) table += std::string(",") + metrics::kSeenInTraining;
  for (const std::string& name : names) table += "," + Quoted(name);
  const OperatorColumns operators(runs);
  table += operators.Header() + (has_notes ? ",note\n" : "\n");
  auto row = values.begin();
  for (const results::RecordedRun& run : runs) {
    const std::string run_cells = RunCells(run);
    for (const results::RecordedEpisode& episode : run.episodes) {
      table += run_cells + std::to_string(episode.episode) + "," + std::to_string(episode.seed) + "," +
               Quoted(episode.end_reason) + "," + Quoted(episode.failure_reason) + "," +
               (episode.complete ? "1" : "0");
      const std::optional<bool> seen = episode.seen_in_training;
      if (has_training) table += !seen ? "," : *seen ? ",1" : ",0";
      std::vector<std::string> cells(names.size());
      for (const auto& [column, value] : *row++) cells[column] = Number(value);
      for (const std::string& cell : cells) table += "," + cell;
      table += operators.Cells(run, episode.episode);
      table += has_notes ? "," + Quoted(episode.note) + "\n" : "\n";
    }
  }
  return table;
}

}  // namespace evalbus::exports
