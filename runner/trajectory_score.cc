#include "runner/trajectory_score.h"

#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <memory>

#include "base/errors.h"
#include "base/input_file.h"
#include "base/random.h"
#include "base/run_layout.h"
#include "base/text.h"
#include "bus/channels.h"
#include "bus/event_log.h"
#include "bus/message.h"
#include "collision/clearance_watch.h"
#include "collision/tick_contacts.h"
#include "lcmtypes/clock.h"
#include "lcmtypes/end_reason.h"
#include "lcmtypes/source.h"
#include "metrics/episode/episode_scorer.h"
#include "models/robot_description.h"
#include "models/task_description.h"
#include "results/episode_json.h"
#include "results/run_folder.h"
#include "results/run_reader.h"
#include "results/summary_table.h"
#include "runner/run_json.h"
#include "runner/trajectory_table.h"
#include "sim/measured_scene.h"
#include "sim/prepared_scene.h"
#include "sim/sample_ticks.h"
#include "viz/terminal/terminal.h"

namespace evalbus::runner {
namespace {

namespace fs = std::filesystem;

// Maximum time between two samples. A longer gap indicates an error in the data or the unit.
constexpr double kLongestGap_s = 60;

// Accepted sampling rates. Other rates probably indicate a wrong unit: ticks would be interpolated over
// seconds, or all samples would lie within a few ticks.
constexpr NumberRange kSampleRate_hz{.min = 1, .max = 10000};

// Returns the median time between two samples; 0 if there is only one sample.
double UsualStep(const std::vector<sim::Sample>& samples) {
  std::vector<double> steps;
  for (size_t i = 1; i < samples.size(); ++i) steps.push_back(samples[i].time_s - samples[i - 1].time_s);
  if (steps.empty()) return 0;
  const auto middle = steps.begin() + static_cast<ptrdiff_t>(steps.size() / 2);
  std::ranges::nth_element(steps, middle);
  return *middle;
}

double OneOf(const YamlValue& value, const std::map<std::string, double>& units) {
  const auto found = units.find(value.Text());
  if (found != units.end()) return found->second;
  std::string expected;
  for (const auto& [unit, scale] : units) expected += (expected.empty() ? "" : " or ") + unit;
  value.Fail("expected " + expected + ", got '" + value.Text() + "'");
}

// Scores trajectories in the scene that all trajectories of a map share.
class Kinematics {
 public:
  explicit Kinematics(const TrajectoryMap& map) : map_(map) {}

  void Prepare(const fs::path& out) {
    sim::SimOptions options;
    options.task = map_.task;
    if (!map_.robot.empty()) options.robot = map_.robot;
    options.control_hz = map_.control_hz;
    options.is_source = true;
    options.out = out;
    options.run_id = NameOfRun(out);
    prepared_ = std::make_unique<sim::PreparedScene>(sim::PrepareScene(options));
    CheckNames();
    scene_ = std::make_unique<sim::MeasuredScene>(prepared_.get(), measured_, source_name::kFile);
    checker_ = std::make_unique<collision::CollisionChecker>(prepared_->scene.physics.get(), info());
    scorer_ = std::make_unique<metrics::EpisodeScorer>(info(), prepared_->task);
  }

  const sim::PreparedScene& prepared() const { return *prepared_; }
  const model_info_t& info() const { return prepared_->info; }

  std::vector<sim::Sample> Read(const fs::path& file) const;
  // Writes the log and returns the score.
  episode_summary_t Score(const std::vector<sim::Sample>& samples, int episode, const fs::path& log);

 private:
  // Throws InputError unless every joint and gripper is mapped and all mapped names exist.
  void CheckNames();

  TrajectoryMap map_;
  std::unique_ptr<sim::PreparedScene> prepared_;
  // Names of the mapped joints and objects.
  sim::Measured measured_;
  std::unique_ptr<sim::MeasuredScene> scene_;
  std::unique_ptr<collision::CollisionChecker> checker_;
  std::unique_ptr<metrics::EpisodeScorer> scorer_;
};

void Kinematics::CheckNames() {
  for (const auto& [name, column] : map_.joints) measured_.joints.push_back(name);
  for (const auto& [name, object] : map_.objects) measured_.objects.push_back(name);
  if (const auto fault = sim::MeasuredScene::FindFault(*prepared_, measured_)) {
    if (const auto joint = map_.joints.find(fault->name); joint != map_.joints.end())
      joint->second.where.Fail(fault->text);
    if (const auto object = map_.objects.find(fault->name); object != map_.objects.end()) {
      object->second.where.Fail(fault->text);
    }
    throw InputError(map_.file + ": joints: " + fault->text);
  }
  std::vector<std::string> grippers;
  for (const gripper_info_t& gripper : info().gripper) {
    grippers.push_back(gripper.name);
    if (!map_.grippers.contains(gripper.name)) {
      throw InputError(map_.file + ": grippers: '" + gripper.name +
                       "' is missing; set a gripper that was not recorded to 'open' or 'closed'");
    }
  }
  for (const auto& [name, gripper] : map_.grippers) {
    if (std::ranges::find(grippers, name) == grippers.end()) {
      throw InputError(map_.file + ": grippers: there is no gripper '" + name + "'" +
                       Suggestion(name, grippers));
    }
  }
}

std::vector<sim::Sample> Kinematics::Read(const fs::path& file) const {
  const std::unique_ptr<TrajectoryTable> table = OpenTable(file);
  std::vector<sim::Sample> samples;
  for (size_t k = 0; k < measured_.joints.size(); ++k) {
    const std::string& name = measured_.joints[k];
    const sim::JointMap& joint = map_.joints.at(name);
    const std::vector<double> column = table->Column(joint.name);
    samples.resize(column.size());
    for (size_t row = 0; row < column.size(); ++row) {
      const double position = joint.Position(column[row]) * (scene_->slides(k) ? 1 : map_.joint_scale);
      samples[row].position.push_back(position);
      const std::string fault = scene_->PositionFault(k, position);
      if (fault.empty()) continue;
      throw InputError(
          fmt::format("{}: column '{}': {}{}", table->Place(row), Printable(joint.name), fault,
                      fault.ends_with("degrees?") && map_.joint_scale == 1 ? " (joints: unit: deg)" : ""));
    }
  }
  const size_t rows = samples.size();
  // An episode of one sample has no tick to score.
  if (rows == 1) throw InputError(table->Place(0) + ": expected two rows or more, got one");
  if (map_.time_column.empty()) {
    for (size_t row = 0; row < rows; ++row) samples[row].time_s = static_cast<double>(row) / map_.rate_hz;
  } else {
    const std::vector<double> time = table->Column(map_.time_column);
    for (size_t row = 0; row < rows; ++row) {
      if (row > 0 && !(time[row] > time[row - 1])) {
        throw InputError(fmt::format("{}: column '{}': the time changes from {:g} to {:g}; it must increase",
                                     table->Place(row), Printable(map_.time_column), time[row - 1],
                                     time[row]));
      }
      samples[row].time_s = (time[row] - time[0]) * map_.time_scale;
      const double gap_s = row > 0 ? samples[row].time_s - samples[row - 1].time_s : 0;
      if (gap_s <= kLongestGap_s) continue;
      throw InputError(fmt::format(
          "{}: column '{}': {:g} s after the previous sample, expected at most {:g} s (time: unit: "
          "s, ms, us or ns)",
          table->Place(row), Printable(map_.time_column), gap_s, kLongestGap_s));
    }
    const double usual_s = UsualStep(samples);
    constexpr double kRounding = 1e-6;
    if (rows > 1 &&
        (usual_s * kSampleRate_hz.max < 1 - kRounding || usual_s * kSampleRate_hz.min > 1 + kRounding)) {
      throw InputError(fmt::format(
          "{}: column '{}': samples are usually {:g} s apart, expected {:g} to {:g} s (time: unit: "
          "s, ms, us or ns)",
          file.string(), Printable(map_.time_column), usual_s, 1 / kSampleRate_hz.max,
          1 / kSampleRate_hz.min));
    }
  }
  for (const gripper_info_t& gripper : info().gripper) {
    const TrajectoryMap::Gripper& how = map_.grippers.at(gripper.name);
    if (how.column.empty()) {
      for (sim::Sample& sample : samples) sample.opening.emplace_back(how.always);
      continue;
    }
    const std::vector<double> column = table->Column(how.column);
    for (size_t row = 0; row < rows; ++row) {
      const double opening = (column[row] - how.closed) / (how.open - how.closed);
      if (!(opening >= -0.1 && opening <= 1.1)) {
        throw InputError(fmt::format("{}: column '{}': {:g} is not between closed ({:g}) and open ({:g})",
                                     table->Place(row), Printable(how.column), column[row], how.closed,
                                     how.open));
      }
      samples[row].opening.emplace_back(std::clamp(opening, 0.0, 1.0));
    }
  }
  for (const std::string& name : measured_.objects) {
    const TrajectoryMap::Object& object = map_.objects.at(name);
    for (sim::Sample& sample : samples) sample.object.emplace_back();
    for (size_t i = 0; i < 3; ++i) {
      const std::vector<double> column = table->Column(object.position[i]);
      for (size_t row = 0; row < rows; ++row) samples[row].object.back().position_m[i] = column[row];
    }
    for (size_t i = 0; i < 4; ++i) {
      const std::vector<double> column = table->Column(object.quaternion[i]);
      for (size_t row = 0; row < rows; ++row) samples[row].object.back().quat_wxyz[i] = column[row];
    }
  }
  for (size_t row = 0; row < rows; ++row) {
    const std::string fault = scene_->SampleFault(samples[row]);
    if (!fault.empty()) throw InputError(table->Place(row) + ": " + fault);
    for (size_t k = 0; k < measured_.objects.size(); ++k) {
      body_pose_t& pose = samples[row].object[k];
      pose = sim::PoseInFrame(pose, map_.objects.at(measured_.objects[k]).frame);
    }
    const std::string first_fault = row == 0 ? scene_->FirstSampleFault(samples[row]) : "";
    if (!first_fault.empty()) throw InputError(table->Place(row) + ": " + first_fault);
  }
  return samples;
}

episode_summary_t Kinematics::Score(const std::vector<sim::Sample>& samples, int episode,
                                    const fs::path& log) {
  EventLogWriter writer(log);
  const auto write = [&](const auto& channel, const auto& message, int64_t time_us) {
    writer.Write(channel.name, Encode(message), time_us);
  };
  episode_begin_t begin{};
  begin.header.episode = episode;
  begin.seed = SeedSource{}.OfEpisode(episode);
  write(channels::kModel, info(), 0);
  write(channels::kEpisodeBegin, begin, 0);
  scorer_->Start();
  const double tick_s = ControlPeriod(info());
  collision::ClearanceWatch clearance(checker_.get(), ControlPeriodUs(info()));
  clearance.Start();

  sim::SampleTicks ticks(tick_s, UsualStep(samples));
  for (const sim::Sample& sample : samples) ticks.Add(sample);

  episode_end_t end{};
  end.end_reason = end_reason::kEndOfData;
  std::optional<state_t> before;
  header_t header = begin.header;
  while (const auto tick = ticks.Next()) {
    header.tick = tick->number;
    header.sim_time_us = TickUs(tick->number, tick_s);
    state_t state =
        scene_->At(*tick->before, *tick->behind, tick->share, before ? &*before : nullptr, header);
    contacts_t contacts{};
    collision::FillContacts(state, checker_.get(), &clearance, &contacts);
    write(channels::kState, state, header.sim_time_us);
    write(channels::kContacts, contacts, header.sim_time_us);
    scorer_->Tick(state, contacts);
    partial_metrics_t partial{};
    scorer_->Partial(&partial);
    write(channels::kPartial, partial, header.sim_time_us);
    before = std::move(state);
    if (partial.verdict != partial_metrics_t::UNDECIDED) {
      end.end_reason = end_reason::Of(partial.verdict);
      break;
    }
    if (info().time_limit_us > 0 && header.sim_time_us >= info().time_limit_us) {
      end.end_reason = end_reason::kTimeLimit;
      break;
    }
  }
  // Ticks that are missing after the last scored one count, too.
  if (end.end_reason == end_reason::kEndOfData && ticks.next() - 1 > header.tick) {
    header.tick = ticks.next() - 1;
    header.sim_time_us = TickUs(header.tick, tick_s);
  }
  end.header = header;
  if (const int gaps = ticks.gaps(); gaps > 0) {
    end.detail = fmt::format("samples are missing in {}", Plural(gaps, "place"));
  }
  int64_t beyond_range = 0;
  std::string first_beyond_range;
  for (size_t row = 0; row < samples.size(); ++row) {
    const std::string beyond = scene_->BeyondRange(samples[row]);
    if (beyond.empty() || beyond_range++ > 0) continue;
    first_beyond_range = fmt::format("row {}: {}", row, beyond);
  }
  if (beyond_range > 0) {
    end.detail += (end.detail.empty() ? "" : "; ") + sim::BeyondRangeText(beyond_range, first_beyond_range);
  }
  scorer_->EndAt(header.tick);
  const episode_summary_t summary = scorer_->Summary(begin, end);
  write(channels::kEpisodeEnd, end, header.sim_time_us);
  write(channels::kEpisodeSummary, summary, header.sim_time_us);
  writer.Close();
  return summary;
}

}  // namespace

TrajectoryMap ReadTrajectoryMap(const std::string& text, const std::string& file) {
  const YamlMap yaml(ParseYaml(text, file), {"task", "joints"},
                     {"robot", "control_hz", "time", "rate_hz", "grippers", "objects"});
  TrajectoryMap map;
  map.file = file;
  const auto check = [](const YamlValue& name, const auto& find) {
    try {
      find(name.Text());
    } catch (const InputError& error) {
      name.Fail(error.what());
    }
    return name.Text();
  };
  map.task = check(yaml["task"], FindTask);
  if (const YamlValue* robot = yaml.Find("robot")) map.robot = check(*robot, FindRobot);
  if (const YamlValue* hz = yaml.Find("control_hz")) map.control_hz = hz->Number({.min = 5, .max = 500});
  const YamlValue *time = yaml.Find("time"), *rate = yaml.Find("rate_hz");
  if (!time == !rate) throw InputError(file + ": expected either 'time' or 'rate_hz'");
  if (rate) map.rate_hz = rate->Number(kSampleRate_hz);
  if (time) {
    const YamlMap entries(*time, {"column", "unit"});
    map.time_column = entries["column"].Text();
    map.time_scale = OneOf(entries["unit"], {{"s", 1}, {"ms", 1e-3}, {"us", 1e-6}, {"ns", 1e-9}});
  }
  const YamlMap joints(yaml["joints"], {"unit", "columns"});
  map.joint_scale = sim::ReadAngleUnit(joints["unit"]);
  map.joints = sim::ReadJointMaps(joints["columns"]);
  if (map.joints.empty()) joints["columns"].Fail("expected a column for each joint");
  if (const YamlValue* grippers = yaml.Find("grippers")) {
    for (const YamlValue& entry : grippers->Entries()) {
      TrajectoryMap::Gripper& gripper = map.grippers[entry.key()];
      if (entry.is_scalar()) {
        gripper.always = OneOf(entry, {{"open", 1}, {"closed", 0}});
        continue;
      }
      const YamlMap column(entry, {"column", "open", "closed"});
      gripper.column = column["column"].Text();
      gripper.open = column["open"].Number();
      gripper.closed = column["closed"].Number();
      if (gripper.open == gripper.closed) column["open"].Fail("expected a value other than 'closed'");
    }
  }
  if (const YamlValue* objects = yaml.Find("objects")) {
    for (const YamlValue& entry : objects->Entries()) {
      const YamlMap columns(entry, {"position_m", "quaternion_wxyz"}, {"frame"});
      TrajectoryMap::Object& object = map.objects[entry.key()];
      object.where = entry;
      if (const YamlValue* frame = columns.Find("frame")) object.frame = ReadPose(*frame, kFarthest);
      const auto read = [](const YamlValue& value, auto* names) {
        const std::vector<std::string> texts = value.Texts();
        if (texts.size() != names->size()) value.Fail(fmt::format("expected {} columns", names->size()));
        std::ranges::copy(texts, names->begin());
      };
      read(columns["position_m"], &object.position);
      read(columns["quaternion_wxyz"], &object.quaternion);
    }
  }
  return map;
}

void ScoreTrajectories(const fs::path& map_file, const fs::path& data, const fs::path& out) {
  const TrajectoryMap map = ReadTrajectoryMap(ReadInput(map_file, "map of a trajectory"), map_file.string());
  std::vector<fs::path> files;
  if (fs::is_directory(data)) {
    for (const auto& entry : fs::directory_iterator(data)) {
      const std::string ending = entry.path().extension();
      const bool is_one = ending == ".csv" || ending == ".npz" || ending == ".hdf5" || ending == ".h5";
      // Broken links and named pipes are included, because reading them reports the error.
      if (is_one && !entry.is_directory()) files.push_back(entry.path());
    }
    std::ranges::sort(files);
    if (files.empty()) throw InputError(data.string() + ": no *.csv, *.npz, *.hdf5 or *.h5 in this folder");
  } else {
    files = {data};
  }
  Kinematics kinematics(map);
  results::RunFolder folder = results::RunFolder::OfRun(out, "score", false);
  try {
    kinematics.Prepare(folder.path());
    // All files are read before the first one is scored.
    std::vector<std::vector<sim::Sample>> all;
    for (const fs::path& file : files) all.push_back(kinematics.Read(file));
    const sim::PreparedScene& prepared = kinematics.prepared();
    folder.WriteJson(kRunJson, ScoredRunJson(prepared, map_file, data, files));
    fmt::print("{}\n", results::EpisodeHeader(viz::TerminalWidth(stdout)));
    for (size_t i = 0; i < files.size(); ++i) {
      const int episode = static_cast<int>(i);
      fs::create_directories(EpisodeFolder(folder.path(), episode));
      const auto summary = kinematics.Score(all[i], episode, EpisodeLog(folder.path(), episode));
      const auto json = results::EpisodeJson(prepared.task.name, prepared.variation, summary);
      folder.AddEpisode(episode, json);
      fmt::print("{}\n", results::EpisodeLine(json, viz::TerminalWidth(stdout)));
    }
    const metrics::RunSummary summary = results::ReadRun(folder.path()).Statistics().Summary(true);
    folder.WriteJson(kSummaryJson, metrics::SummaryJson(prepared.task.name, prepared.variation, summary));
    fmt::print("\n{}", results::SummaryTable(summary, viz::TerminalWidth(stdout)));
    fmt::print("\nresults  {}\n", (folder.shown() / kEpisodesJsonl).string());
  } catch (...) {
    folder.Remove();
    throw;
  }
}

}  // namespace evalbus::runner
