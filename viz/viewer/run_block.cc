#include "viz/viewer/run_block.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "lcmtypes/end_reason.h"
#include "lcmtypes/source.h"
#include "viz/viewer/block.h"

namespace evalbus::viz {
namespace {

using Json = nlohmann::ordered_json;

Json Share(int part, int whole) { return whole > 0 ? Json(static_cast<double>(part) / whole) : Json(); }

template <class Names, class Counts>
Json Reasons(const Names& names, const Counts& counts) {
  Json list = Json::array();
  for (size_t k = 0; k < names.size(); ++k) list.push_back({names[k], counts[k]});
  return list;
}

Json Labeled(const RunLabel& label) {
  return {{"run", label.run},
          {"name", label.name},
          {"policy", label.policy},
          {"is_live", label.is_live},
          {"is_active", label.is_active},
          {"is_gone", label.is_gone},
          {"is_replaced", label.is_replaced},
          {"remarks", label.remarks},
          {"task", nullptr},
          {"variation", nullptr},
          {"clock", nullptr},
          {"planned", nullptr},
          {"episode", nullptr},
          {"attempt", nullptr},
          {"phase", ""},
          {"speed", nullptr},
          {"is_over", false},
          {"done", 0},
          {"complete", 0},
          {"judged", 0},
          {"successes", 0},
          {"rate", nullptr},
          {"interval", nullptr},
          {"interval_kind", nullptr},
          {"failure_reasons", Json::array()},
          {"components", Json::array()},
          {"pacing", nullptr},
          {"undecodable", 0}};
}

std::string Bytes(const Json& head) {
  BlockWriter block("run");
  block.head().update(head);
  return block.Bytes();
}

void AddCounted(const RunNumbers& numbers, Json* head) {
  (*head)["planned"] = numbers.planned;
  (*head)["done"] = numbers.done;
  (*head)["complete"] = numbers.complete;
  (*head)["judged"] = numbers.judged;
  (*head)["successes"] = numbers.successes;
  (*head)["rate"] = Share(numbers.successes, numbers.judged);
  if (numbers.judged > 0) {
    (*head)["interval"] = Json{numbers.lower, numbers.upper};
    (*head)["interval_kind"] = numbers.is_over ? "Wilson" : "anytime";
  }
  (*head)["failure_reasons"] = Json::array();
  for (const auto& [reason, count] : numbers.failure_reasons) {
    (*head)["failure_reasons"].push_back({reason, count});
  }
}

// Returns the number of complete episodes with a verdict.
int JudgedOf(const run_summary_t& run) {
  int judged = run.num_complete;
  for (size_t k = 0; k < run.failure_reason.size(); ++k) {
    if (run.failure_reason[k] == end_reason::kNotJudged) judged -= run.failure_episodes[k];
  }
  return judged;
}

double SecondsOf(SteadyTime::duration duration) { return std::chrono::duration<double>(duration).count(); }

}  // namespace

std::string RunBlock(const RunWatch& watch, const RunLabel& label, SteadyTime now,
                     const RunNumbers* counted) {
  Json head = Labeled(label);
  if (const model_info_t* model = watch.model()) {
    head["task"] = model->task;
    head["variation"] = model->variation;
    head["clock"] = model->clock;
  }
  if (!watch.other_version().empty()) head["remarks"].push_back("MODEL " + watch.other_version());
  if (watch.planned_episodes() > 0) head["planned"] = watch.planned_episodes();
  if (watch.episode() >= 0) {
    head["episode"] = watch.episode();
    head["attempt"] = watch.attempt();
  }
  head["phase"] = watch.Phase();
  if (watch.has_rates()) head["speed"] = watch.speed();
  // If the processes of the run have exited, the state in the run folder is used as well, because the last
  // message may have been lost.
  head["is_over"] = watch.is_over() || (!label.is_live && counted && counted->is_over);
  if (const run_summary_t* run = watch.run()) {
    head["done"] = run->num_episodes;
    head["complete"] = run->num_complete;
    const int judged = JudgedOf(*run);
    head["judged"] = judged;
    head["successes"] = run->num_success;
    head["rate"] = Share(run->num_success, judged);
    const bool is_final = watch.is_over() && !run->is_part;
    if (judged > 0) {
      head["interval"] = is_final ? Json{run->success_rate_wilson_lower, run->success_rate_wilson_upper}
                                  : Json{run->success_rate_anytime_lower, run->success_rate_anytime_upper};
      head["interval_kind"] = is_final ? "Wilson" : "anytime";
    }
    head["failure_reasons"] = Reasons(run->failure_reason, run->failure_episodes);
  }
  for (const auto& [name, health] : watch.health()) {
    head["components"].push_back(
        {{"name", name},
         {"state", StateWord(health.status)},
         {"text", health.status.error},
         {"lag_ticks", health.lag < 0 ? Json() : Json(health.lag)},
         {"silent_s", health.silent ? Json(SecondsOf(now - health.received)) : Json()},
         {"is_bad", health.is_bad()}});
  }
  if (const episode_end_t* pacing = watch.pacing()) {
    head["pacing"] = {
        {"deadline_misses", watch.scores() ? Json(watch.scores()->extended.deadline_misses) : Json()},
        {"late_ticks", pacing->late_ticks},
        {"error_p99_s", NumberOrNull(pacing->pacing_error.p99_s)},
        {"action_latency_p50_s", NumberOrNull(pacing->action_latency.p50_s)},
        {"action_latency_p99_s", NumberOrNull(pacing->action_latency.p99_s)}};
  }
  head["undecodable"] = watch.undecodable();
  if (counted) AddCounted(*counted, &head);
  return Bytes(head);
}

std::string RunBlock(const RunNumbers& numbers, const RunLabel& label) {
  Json head = Labeled(label);
  head["task"] = numbers.task;
  head["variation"] = numbers.variation;
  head["clock"] = numbers.clock;
  head["is_over"] = numbers.is_over;
  AddCounted(numbers, &head);
  return Bytes(head);
}
EpisodeRow RowOf(const episode_summary_t& summary, const std::string& task, const std::string& variation) {
  EpisodeRow row;
  row.episode = summary.header.episode;
  row.seed = summary.seed;
  row.task = task;
  row.variation = variation;
  row.end_reason = summary.end_reason;
  row.failure_reason = summary.failure_reason;
  row.success = summary.metrics.success;
  row.complete = summary.complete;
  row.time = summary.metrics.completion_time_s;
  row.text = summary.explanation.text;
  row.cause_time = summary.cause.time_s;
  row.cause_text = summary.cause.text;
  const auto add = [](int64_t count, std::optional<int64_t>* sum) {
    if (count != kUnavailableCount) *sum = sum->value_or(0) + count;
  };
  add(summary.metrics.slip_count, &row.slips);
  const extended_metrics_t& extended = summary.extended;
  for (size_t k = 0; k < extended.name.size() && k < extended.value_mixed.size(); ++k) {
    if (extended.name[k].starts_with("grasp_count")) add(std::llround(extended.value_mixed[k]), &row.grasps);
  }
  add(summary.metrics.env_collision_count, &row.collisions);
  add(summary.metrics.self_collision_count, &row.collisions);
  for (const auto is_reached : summary.metrics.stage_reached) add(is_reached ? 1 : 0, &row.stages);
  return row;
}

std::string EpisodesBlock(int run, size_t from, const std::vector<EpisodeRow>& rows) {
  BlockWriter block("episodes");
  block.head()["run"] = run;
  block.head()["from"] = from;
  Json& list = block.head()["episodes"] = Json::array();
  const auto count_or_null = [](const std::optional<int64_t>& count) {
    return count ? Json(*count) : Json();
  };
  for (const EpisodeRow& row : rows) {
    list.push_back({{"episode", row.episode},
                    {"seed", row.seed},
                    {"task", row.task},
                    {"variation", row.variation},
                    {"end_reason", row.end_reason},
                    {"failure_reason", row.failure_reason},
                    {"success", row.success},
                    {"complete", row.complete},
                    {"time_s", NumberOrNull(row.time)},
                    {"text", row.text},
                    {"cause_time_s", row.cause_text.empty() ? Json() : Json(row.cause_time)},
                    {"cause_text", row.cause_text.empty() ? Json() : Json(row.cause_text)},
                    {"slips", count_or_null(row.slips)},
                    {"grasps", count_or_null(row.grasps)},
                    {"collisions", count_or_null(row.collisions)},
                    {"stages", count_or_null(row.stages)},
                    {"has_track", row.has_track},
                    {"video", row.video.empty() ? Json() : Json(row.video)}});
  }
  return block.Bytes();
}

std::string NotesBlock(int run, const std::map<int, std::string>& notes, bool can_write) {
  BlockWriter block("notes");
  block.head()["run"] = run;
  block.head()["can_write"] = can_write;
  Json& list = block.head()["notes"] = Json::array();
  for (const auto& [episode, text] : notes) list.push_back({episode, text});
  return block.Bytes();
}

std::string LogBlock(int run, const std::vector<LogLine>& lines) {
  constexpr const char* kLevels[] = {"debug", "info", "warn", "error"};
  BlockWriter block("log");
  block.head()["run"] = run;
  Json& list = block.head()["lines"] = Json::array();
  for (const LogLine& logged : lines) {
    const log_t& line = logged.line;
    const auto level = static_cast<size_t>(std::clamp<int>(line.level, 0, std::size(kLevels) - 1));
    list.push_back({{"level", kLevels[level]},
                    {"component", line.component},
                    {"episode", line.header.episode < 0 ? Json() : Json(line.header.episode)},
                    {"tick", line.header.tick < 0 ? Json() : Json(line.header.tick)},
                    {"text", line.text},
                    {"time", logged.time}});
  }
  return block.Bytes();
}

}  // namespace evalbus::viz
